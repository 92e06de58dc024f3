//! Errors of settings that have had the same time.

use lightshed::film::{FrameMethod, RgbImage, SampledFrames, process_cpu_seconds};
use lightshed::integrator::{CameraMotion, Neighbourhood, PathTracer, RestirPt, RestirPtOptions, SceneWorld};
use lightshed::scene::{Rgb, Scene};
use lightshed_evaluate::Reference;
use serde_json::{Value, json};
use std::error::Error;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A setting and what came of it.
#[derive(Clone)]
pub struct Measured {
    /// `None` for plain path tracing.
    pub options: Option<RestirPtOptions>,
    /// Frames; of path tracing, of four samples in every pixel.
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

/// Path tracing and all settings, each for `seconds`, a frame at a time in turns.
pub fn race(
    scene: &Scene,
    reference: &Reference,
    settings: &[RestirPtOptions],
    seconds: f64,
) -> Result<Vec<Measured>, Box<dyn Error>> {
    let world = SceneWorld::new(scene, scene.emitters_by_power());
    let [width, height] = reference.size();
    let pixels = width as usize * height as usize;
    let plain = SampledFrames::new(
        PathTracer::new(scene, scene.emitters_by_power()),
        [width, height],
        SAMPLES,
    );
    let mut runners: Vec<(Option<RestirPtOptions>, Box<dyn FrameMethod + '_>)> =
        vec![(None, Box::new(plain))];
    for &options in settings {
        let method = RestirPt::new(&world, options, CameraMotion::STILL)?;
        runners.push((Some(options), Box::new(method)));
    }
    let mut sums = vec![vec![[0.0f64; 3]; pixels]; runners.len()];
    let mut spent = vec![(0u32, 0.0); runners.len()];
    let mut image = vec![Rgb::ZERO; pixels];
    let start = Instant::now();
    let clock = || process_cpu_seconds().unwrap_or_else(|| start.elapsed().as_secs_f64());
    loop {
        let mut running = false;
        for (index, (_, method)) in runners.iter_mut().enumerate() {
            let (frames, used) = &mut spent[index];
            // Stops where half a frame more would not be nearer to the time.
            if *frames > 0 && *used + 0.5 * *used / f64::from(*frames) > seconds {
                continue;
            }
            running = true;
            let before = clock();
            method.render_frame(*frames, index as u64, &mut image, &AtomicBool::new(false));
            *used += clock() - before;
            *frames += 1;
            for (sum, value) in sums[index].iter_mut().zip(&image) {
                for (sum, value) in sum.iter_mut().zip(value.to_array()) {
                    *sum += f64::from(value);
                }
            }
        }
        if !running {
            break;
        }
    }
    let found = runners.iter().zip(sums).zip(spent);
    found
        .map(|(((options, _), sum), (frames, cpu_seconds))| {
            let mean = sum
                .iter()
                .map(|sum| sum.map(|sum| (sum / f64::from(frames)) as f32));
            let errors = reference.errors(&RgbImage::new(width, height, mean.collect())?)?;
            Ok(Measured {
                options: *options,
                frames,
                cpu_seconds,
                mse: errors.mse,
                mape: errors.mape,
            })
        })
        .collect()
}

/// Samples of a pixel in a frame of path tracing.
const SAMPLES: u32 = 4;
