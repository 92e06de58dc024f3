//! What methods are measured against, and plain path tracing as frames.

use lightshed::integrator::{
    Budget, Film, FrameMethod, PathTracer, PixelEstimator, RayCounts, RenderOptions, SampleId,
    process_cpu_seconds, render,
};
use lightshed::scene::{Rgb, Scene, luminance};
use std::error::Error;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// What is compared with.
pub struct Reference {
    luminance: Vec<f64>,
    /// Mean over pixels of the variance of their luminance.
    variance: f64,
}

/// Luminance of each pixel.
pub fn image_luminance(image: &[Rgb]) -> Vec<f64> {
    image.iter().map(|&value| f64::from(luminance(value))).collect()
}

impl Reference {
    /// Of which luminances are known, with this variance in the mean over pixels.
    pub fn known(luminance: Vec<f64>, variance: f64) -> Self {
        Self { luminance, variance }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.luminance.len()
    }

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
        let luminance = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
        // The variance of a half is that of the difference over two, of their mean half that again.
        Ok(Self::known(luminance, spread / count / 4.0))
    }

    /// Mean squared error of the mean of `frames` frames, the reference's own variance subtracted.
    pub fn mse(&self, sum: &[f64], frames: u32) -> f64 {
        let errors = sum.iter().zip(&self.luminance);
        let squares: f64 = errors
            .map(|(sum, truth)| (sum / f64::from(frames) - truth).powi(2))
            .sum();
        squares / sum.len() as f64 - self.variance
    }

    /// Mean absolute percentage error (Lin 2022 §6.8.3, footnote 12).
    pub fn mape(&self, sum: &[f64], frames: u32) -> f64 {
        let floor = 0.01 * self.luminance.iter().sum::<f64>() / self.luminance.len() as f64;
        let errors = sum.iter().zip(&self.luminance);
        let shares: f64 = errors
            .map(|(sum, truth)| (sum / f64::from(frames) - truth).abs() / (floor + truth))
            .sum();
        shares / sum.len() as f64
    }
}

/// Processor seconds, or those of the clock where the platform does not tell.
pub fn clock(start: Instant) -> f64 {
    process_cpu_seconds().unwrap_or_else(|| start.elapsed().as_secs_f64())
}

/// Path tracing, one sample of every pixel a frame.
pub struct PlainFrames<'a> {
    /// The scene.
    pub scene: &'a Scene,
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
    ) -> Option<RayCounts> {
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
        Some(RayCounts::default())
    }
}
