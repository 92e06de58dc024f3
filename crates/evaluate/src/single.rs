//! Single frames of a chain, as an interactive program shows them.

use crate::{Errors, EvaluateError, Reference};
use lightshed_film::{FrameMethod, RgbImage, process_cpu_seconds};
use lightshed_sampling::Rgb;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Single frames of a chain that has had time to fill its history, compared with a plain method in
/// the time of one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SingleFrames {
    /// Processor seconds of a frame.
    pub seconds: f64,
    /// Errors of a frame, on average.
    pub errors: Errors,
    /// Samples of the plain method in every pixel, as many as fit into that time; at least one.
    pub plain_samples: u32,
    /// Its errors, on average.
    pub plain_errors: Errors,
}

/// Frames that fill the history, and frames that are evaluated.
const WARM: u32 = 20;
const JUDGED: u32 = 4;

impl SingleFrames {
    /// Runs `chain` for 24 frames and evaluates the last four. `plain(n)` makes frames of `n`
    /// samples in every pixel.
    ///
    /// # Errors
    /// [`EvaluateError::Size`] where sizes differ, [`EvaluateError::Interrupted`] if `cancel` was
    /// set, and those of `plain`.
    pub fn run<'a>(
        chain: &mut dyn FrameMethod,
        plain: &dyn Fn(u32) -> Result<Box<dyn FrameMethod + 'a>, EvaluateError>,
        reference: &Reference,
        seed: u64,
        cancel: &AtomicBool,
    ) -> Result<Self, EvaluateError> {
        let size = reference.size();
        let mut image = vec![Rgb::ZERO; size[0] as usize * size[1] as usize];
        let mut frame = |method: &mut dyn FrameMethod, number: u32| {
            if method.size() != size {
                return Err(EvaluateError::Size {
                    image: method.size(),
                    reference: size,
                });
            }
            let start = Instant::now();
            let clock = || process_cpu_seconds().unwrap_or_else(|| start.elapsed().as_secs_f64());
            let before = clock();
            let done = method.render_frame(number, seed, &mut image, cancel);
            let seconds = clock() - before;
            if done.is_none() || cancel.load(Ordering::Relaxed) {
                return Err(EvaluateError::Interrupted);
            }
            let pixels = image.iter().map(|value| value.to_array()).collect();
            let errors = reference.errors(&RgbImage::new(size[0], size[1], pixels)?)?;
            Ok((seconds, errors))
        };
        let (mut judged, mut seconds) = (Vec::new(), 0.0);
        for number in 0..WARM + JUDGED {
            let (spent, errors) = frame(chain, number)?;
            if number >= WARM {
                judged.push(errors);
                seconds += spent / f64::from(JUDGED);
            }
        }
        // Long enough to measure the time of a sample.
        const TRIAL: u32 = 8;
        let (trial, _) = frame(plain(TRIAL)?.as_mut(), 0)?;
        let samples = (seconds / (trial / f64::from(TRIAL)).max(1e-9)).round();
        let plain_samples = samples.clamp(1.0, f64::from(u32::MAX / JUDGED)) as u32;
        let mut method = plain(plain_samples)?;
        let plain_judged: Result<Vec<Errors>, EvaluateError> = (0..JUDGED)
            .map(|number| Ok(frame(method.as_mut(), number)?.1))
            .collect();
        Ok(Self {
            seconds,
            errors: mean(&judged),
            plain_samples,
            plain_errors: mean(&plain_judged?),
        })
    }
}

fn mean(errors: &[Errors]) -> Errors {
    let count = errors.len() as f64;
    let mean = |of: fn(&Errors) -> f64| errors.iter().map(of).sum::<f64>() / count;
    Errors {
        mse: mean(|errors| errors.mse),
        rel_mse: mean(|errors| errors.rel_mse),
        mape: mean(|errors| errors.mape),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_integrator::{Method, Motion, PathTracer, Stage};
    use lightshed_scene::{Scene, builtin};

    #[test]
    fn a_frame_of_reuse_is_set_against_samples() {
        let mut description = builtin::cornell();
        (description.settings.width, description.settings.height) = (24, 24);
        description.settings.max_depth = Some(2);
        let scene = Scene::new(&description).unwrap();
        let methods: [Method; 2] = ["direct", "restir-di"].map(|name| name.parse().unwrap());
        let (stage, size) = (Stage::new(&scene), [24, 24]);
        let never = AtomicBool::new(false);
        let reference = Reference::rendered(
            &PathTracer::new(&scene, scene.emitters_by_power()),
            size,
            512,
            &|_| (),
            &never,
        )
        .unwrap();
        let started = |method: &Method, samples| match method.start(&stage, Motion::STILL) {
            Ok(started) => Ok(started.into_frames(size, samples)),
            Err(error) => Err(EvaluateError::method(error)),
        };
        let plain = |samples| started(&methods[0], samples);
        let mut chain = started(&methods[1], 1).unwrap();
        let single = SingleFrames::run(chain.as_mut(), &plain, &reference, 1, &never).unwrap();
        assert!(single.seconds > 0.0 && single.plain_samples >= 1);
        // It is the error of a single image, not of a mean of many.
        assert!(single.errors.mape > 0.0 && single.errors.mape < 0.6, "{single:?}");
        assert!(single.plain_errors.mape > 0.0, "{single:?}");
        let cancelled = AtomicBool::new(true);
        assert!(SingleFrames::run(chain.as_mut(), &plain, &reference, 1, &cancelled).is_err());
    }
}
