//! A candidate's two images.

use super::plan::PilotPlan;
use super::tail::TailBound;
use crate::registry::{Method, MethodError, Motion, Stage, Started};
use lightshed_film::{Budget, RayCounts, RenderError, RenderOptions, RenderOutcome, render, render_frames};
use std::sync::atomic::AtomicBool;

/// Two images of a candidate, made of as many frames each.
pub(super) struct Images {
    /// Frames of an image, or samples.
    pub frames: u32,
    /// Rays of both images; `None` of methods that do not count them.
    pub rays: Option<RayCounts>,
    /// Processor seconds of both, where the platform tells, or those of the clock.
    pub seconds: f64,
    /// Squared error of an image.
    pub error: TailBound,
    /// The same relative to the pixel's squared brightness.
    pub relative: TailBound,
}

/// Seeds of the two images, apart from those that images are rendered with.
const SEEDS: [u64; 2] = [0x5bd1_e995_a1f0_73c4, 0x9e6c_63d0_26b4_1d8b];

/// Brightness that relative errors of darker pixels refer to, as a share of the image's.
const DARKEST: f64 = 0.1;

/// Renders two images of `frames` frames or samples at the size of the stage's scene. `None` if it
/// was interrupted.
pub(super) fn images(
    stage: &Stage<'_>,
    method: &Method,
    frames: u32,
    threads: usize,
    cancel: &AtomicBool,
) -> Result<Option<Images>, MethodError> {
    let settings = stage.scene().settings();
    let mut outcomes = Vec::new();
    for seed in SEEDS {
        let options = RenderOptions {
            seed,
            threads,
            ..RenderOptions::new(settings.width, settings.height, Budget::Samples(frames))
        };
        let outcome: Result<RenderOutcome, RenderError> = match method.start(stage, Motion::STILL)? {
            Started::Samples(estimator) => render(&estimator, &options, &|_| (), cancel),
            Started::Frames(mut method) => render_frames(&mut method, &options, &|_| (), cancel),
        };
        let outcome = outcome.map_err(|error| MethodError::Refused {
            method: method.name(),
            reason: error.to_string(),
        })?;
        if outcome.interrupted {
            return Ok(None);
        }
        outcomes.push(outcome);
    }
    let means = outcomes.iter().map(|outcome| outcome.film.mean_image());
    let means: Vec<_> = means.collect();
    let pixels = || means[0].pixels().iter().zip(means[1].pixels());
    let mut errors: Vec<f64> = pixels().map(|(a, b)| half_squared_difference(a, b)).collect();
    let brightness =
        |(a, b): (&[f32; 3], &[f32; 3])| a.iter().chain(b).map(|v| f64::from(*v)).sum::<f64>() / 6.0;
    let mean = pixels().map(brightness).sum::<f64>() / errors.len().max(1) as f64;
    let squares = pixels().map(|pair| brightness(pair).powi(2) + (DARKEST * mean).powi(2));
    let mut relative: Vec<f64> = errors
        .iter()
        .zip(squares)
        .map(|(error, square)| error / square)
        .collect();
    let seconds = outcomes.iter().map(|o| o.cpu_seconds.unwrap_or(o.seconds)).sum();
    let rays: Option<RayCounts> = outcomes.iter().map(|outcome| outcome.rays).sum::<Option<_>>();
    Ok(Some(Images {
        frames,
        rays: rays.filter(|rays| *rays != RayCounts::default()),
        seconds,
        error: TailBound::of(&mut errors),
        relative: TailBound::of(&mut relative),
    }))
}

/// Half the mean squared difference of two independent values: the variance of one, in the mean.
fn half_squared_difference(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    let squares = a
        .iter()
        .zip(b)
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
    squares.sum::<f64>() / 6.0
}

impl PilotPlan {
    /// Frames of an image of a method whose frames cost as much as `cost` paths of each pixel.
    pub fn frames(&self, cost: f64) -> u32 {
        ((f64::from(self.samples) / cost).round() as u32).max(1)
    }
}
