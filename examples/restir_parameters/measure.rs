//! Errors of settings that have had the same time.

use lightshed::integrator::{
    Budget, CameraMotion, Film, FrameMethod, Neighbourhood, PathTracer, PixelEstimator, RenderOptions,
    RestirPt, RestirPtOptions, SceneWorld, process_cpu_seconds, render,
};
use lightshed::scene::{Rgb, Scene, luminance};
use serde_json::{Value, json};
use std::error::Error;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// What is compared with.
pub struct Reference {
    luminance: Vec<f64>,
    /// Mean over pixels of the variance of their luminance.
    variance: f64,
}

fn image_luminance(image: &[Rgb]) -> Vec<f64> {
    image.iter().map(|&value| f64::from(luminance(value))).collect()
}

impl Reference {
    /// Path-traced with `samples` samples in every pixel.
    pub fn new(scene: &Scene, samples: u32) -> Result<Self, Box<dyn Error>> {
        let settings = scene.settings();
        let halves = [1, 2].map(|seed| {
            let mut options = RenderOptions::new(
                settings.width,
                settings.height,
                Budget::Samples(samples.div_ceil(2)),
            );
            options.seed = seed << 32;
            render(
                &PathTracer::new(scene),
                &options,
                &|_| (),
                &AtomicBool::new(false),
            )
        });
        let [a, b] = halves;
        let pixels = |film: &Film| {
            let mean = film.mean_image();
            let places = (0..settings.height).flat_map(|y| (0..settings.width).map(move |x| (x, y)));
            let values = places
                .filter_map(|(x, y)| mean.get(x, y))
                .map(Rgb::from)
                .collect::<Vec<_>>();
            image_luminance(&values)
        };
        let (a, b) = (pixels(&a?.film), pixels(&b?.film));
        let count = a.len() as f64;
        let spread: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
        Ok(Self {
            luminance: a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect(),
            // The variance of a half is that of the difference over two, of their mean half that again.
            variance: spread / count / 4.0,
        })
    }

    fn mse(&self, sum: &[f64], frames: u32) -> f64 {
        let errors = sum.iter().zip(&self.luminance);
        let squares: f64 = errors
            .map(|(sum, truth)| (sum / f64::from(frames) - truth).powi(2))
            .sum();
        squares / sum.len() as f64 - self.variance
    }

    fn mape(&self, sum: &[f64], frames: u32) -> f64 {
        let floor = 0.01 * self.luminance.iter().sum::<f64>() / self.luminance.len() as f64;
        let errors = sum.iter().zip(&self.luminance);
        let shares: f64 = errors
            .map(|(sum, truth)| (sum / f64::from(frames) - truth).abs() / (floor + truth))
            .sum();
        shares / sum.len() as f64
    }
}

/// A setting and what came of it.
#[derive(Clone)]
pub struct Measured {
    /// `None` for plain path tracing.
    pub options: Option<RestirPtOptions>,
    /// Frames, or samples of every pixel.
    pub frames: u32,
    /// Processor time, seconds.
    pub cpu_seconds: f64,
    /// Of the luminance, the reference's variance subtracted.
    pub mse: f64,
    /// Mean absolute percentage error of the luminance.
    pub mape: f64,
}

impl Measured {
    fn neighbourhood(&self) -> Value {
        match self.options.map(|options| options.neighbourhood) {
            Some(Neighbourhood::Disk { radius, count }) => {
                json!({ "disk": { "radius": radius, "count": count } })
            }
            Some(Neighbourhood::Window { radius }) => json!({ "window": { "side": 2 * radius + 1 } }),
            None => Value::Null,
        }
    }

    /// As a JSON object.
    pub fn json(&self) -> Value {
        json!({
            "candidates": self.options.map(|options| options.candidates),
            "rounds": self.options.map(|options| options.rounds),
            "neighbourhood": self.neighbourhood(),
            "frames": self.frames,
            "cpu_seconds": self.cpu_seconds,
            "mse": self.mse,
            "mape": self.mape,
        })
    }

    /// As a line.
    pub fn text(&self) -> String {
        let what = match &self.options {
            None => "path tracing".to_owned(),
            Some(options) => {
                let neighbours = match options.neighbourhood {
                    Neighbourhood::Disk { radius, count } => format!("{count:2} within {radius:2}"),
                    Neighbourhood::Window { radius } => format!("window of {0}x{0}", 2 * radius + 1),
                };
                let (candidates, rounds) = (options.candidates, options.rounds);
                format!("{candidates:2} candidates, {rounds} rounds, {neighbours}")
            }
        };
        let Self {
            frames,
            cpu_seconds,
            mse,
            mape,
            ..
        } = self;
        format!("{what:<42} {frames:5} frames {cpu_seconds:6.2} s  MSE {mse:.3e}  MAPE {mape:.4}")
    }
}

/// Processor seconds, or those of the clock where the platform does not tell.
fn clock(start: Instant) -> f64 {
    process_cpu_seconds().unwrap_or_else(|| start.elapsed().as_secs_f64())
}

/// Path tracing and all settings, each for `seconds`, a frame at a time in turns.
pub fn race(
    scene: &Scene,
    reference: &Reference,
    settings: &[RestirPtOptions],
    seconds: f64,
) -> Result<Vec<Measured>, Box<dyn Error>> {
    let world = SceneWorld::new(scene);
    let pixels = reference.luminance.len();
    let mut runners: Vec<(Option<RestirPtOptions>, Box<dyn FrameMethod + '_>)> =
        vec![(None, Box::new(PlainFrames { scene }))];
    for &options in settings {
        let method = RestirPt::new(&world, options, CameraMotion::STILL)?;
        runners.push((Some(options), Box::new(method)));
    }
    let mut sums = vec![vec![0.0; pixels]; runners.len()];
    let mut spent = vec![(0u32, 0.0); runners.len()];
    let mut image = vec![Rgb::ZERO; pixels];
    let start = Instant::now();
    loop {
        let mut running = false;
        for (index, (_, method)) in runners.iter_mut().enumerate() {
            let (frames, used) = &mut spent[index];
            // Stops where half a frame more would not be nearer to the time.
            if *frames > 0 && *used + 0.5 * *used / f64::from(*frames) > seconds {
                continue;
            }
            running = true;
            let before = clock(start);
            method.render_frame(*frames, index as u64, &mut image, &AtomicBool::new(false));
            *used += clock(start) - before;
            *frames += 1;
            for (sum, value) in sums[index].iter_mut().zip(image_luminance(&image)) {
                *sum += value;
            }
        }
        if !running {
            break;
        }
    }
    let found = runners.iter().zip(sums).zip(spent);
    Ok(found
        .map(|(((options, _), sum), (frames, cpu_seconds))| Measured {
            options: *options,
            frames,
            cpu_seconds,
            mse: reference.mse(&sum, frames),
            mape: reference.mape(&sum, frames),
        })
        .collect())
}

/// Path tracing, one sample of every pixel a frame.
struct PlainFrames<'a> {
    scene: &'a Scene,
}

impl FrameMethod for PlainFrames<'_> {
    fn size(&self) -> [u32; 2] {
        [self.scene.settings().width, self.scene.settings().height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        _: &AtomicBool,
    ) -> Option<lightshed::integrator::RayCounts> {
        use lightshed::integrator::SampleId;
        let (tracer, width) = (PathTracer::new(self.scene), self.size()[0]);
        // Blocks of a row, so that rays go together as they do in a rendering.
        for (block, values) in image.chunks_mut(64).enumerate() {
            let ids: Vec<SampleId> = (0..values.len() as u32)
                .map(|place| {
                    let pixel = block as u32 * 64 + place;
                    let (x, y) = (pixel % width, pixel / width);
                    SampleId { x, y, index: frame }
                })
                .collect();
            tracer.sample_many(&ids, seed, values);
        }
        Some(lightshed::integrator::RayCounts::default())
    }
}
