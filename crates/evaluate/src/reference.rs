//! References for the errors of methods.

use crate::brightness::luminances;
use crate::{Errors, EvaluateError};
use lightshed_film::{Budget, PixelEstimator, Progress, RenderOptions, RgbImage, render};
use std::sync::atomic::AtomicBool;

/// The true image, as far as it is known.
#[derive(Clone, Debug)]
pub struct Reference {
    image: RgbImage,
    /// Luminance of each pixel.
    truth: Vec<f64>,
    uncertainty: Uncertainty,
    /// `ε` of [`Errors`].
    floor: f64,
}

/// The uncertainty of a reference's pixels.
#[derive(Clone, Debug)]
enum Uncertainty {
    /// Unknown: errors include that of the reference.
    Unknown,
    /// Luminances of two independent images, of which the reference is the mean.
    Halves([Vec<f64>; 2]),
}

impl Reference {
    /// A stored image, used unchanged.
    ///
    /// # Errors
    /// [`EvaluateError::Black`] if its mean is not positive, or not finite.
    pub fn stored(image: RgbImage) -> Result<Self, EvaluateError> {
        let truth = luminances(&image);
        Self::assembled(image, truth, Uncertainty::Unknown)
    }

    /// The mean of two independent images of the same precision: their difference tells how precise
    /// it is.
    ///
    /// # Errors
    /// [`EvaluateError::Size`] of images of different size, [`EvaluateError::Black`].
    pub fn of_halves(halves: [RgbImage; 2]) -> Result<Self, EvaluateError> {
        let sizes = [&halves[0], &halves[1]].map(size);
        if sizes[0] != sizes[1] {
            return Err(EvaluateError::Size {
                image: sizes[1],
                reference: sizes[0],
            });
        }
        let pixels = halves[0].pixels().iter().zip(halves[1].pixels());
        let mean = pixels
            .map(|(a, b)| std::array::from_fn(|channel| 0.5 * (a[channel] + b[channel])))
            .collect();
        let image = RgbImage::new(sizes[0][0], sizes[0][1], mean)?;
        let [a, b] = halves.map(|half| luminances(&half));
        let truth = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
        Self::assembled(image, truth, Uncertainty::Halves([a, b]))
    }

    /// Renders two independent halves of `size` pixels with `samples / 2` samples of an unbiased
    /// estimator in each.
    ///
    /// # Errors
    /// [`EvaluateError::Interrupted`] if `cancel` was set meanwhile, [`EvaluateError::Black`], and
    /// those of rendering.
    pub fn rendered(
        estimator: &impl PixelEstimator,
        [width, height]: [u32; 2],
        samples: u32,
        observer: &(dyn Fn(&Progress) + Sync),
        cancel: &AtomicBool,
    ) -> Result<Self, EvaluateError> {
        let samples = samples.div_ceil(2).max(1);
        let half = |seed| -> Result<RgbImage, EvaluateError> {
            let budget = Budget::Samples(samples);
            let options = RenderOptions {
                seed,
                ..RenderOptions::new(width, height, budget)
            };
            let outcome = render(estimator, &options, observer, cancel)?;
            if outcome.samples_per_pixel < samples {
                return Err(EvaluateError::Interrupted);
            }
            Ok(outcome.film.mean_image())
        };
        // Seeds that the methods of a contest do not use.
        Self::of_halves([half(u64::MAX - 1)?, half(u64::MAX - 2)?])
    }

    fn assembled(image: RgbImage, truth: Vec<f64>, uncertainty: Uncertainty) -> Result<Self, EvaluateError> {
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        if !(mean > 0.0 && mean.is_finite()) {
            return Err(EvaluateError::Black);
        }
        Ok(Self {
            image,
            truth,
            uncertainty,
            floor: 0.01 * mean,
        })
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        size(&self.image)
    }

    /// The image.
    pub fn image(&self) -> &RgbImage {
        &self.image
    }

    /// Errors of an image.
    ///
    /// Of a reference of two halves `a` and `b`, `(x − a)(x − b)` has the expectation
    /// `(x − μ)²`, whatever their noise.
    ///
    /// # Errors
    /// [`EvaluateError::Size`].
    pub fn errors(&self, image: &RgbImage) -> Result<Errors, EvaluateError> {
        let mut sums = [0.0; 3];
        for (index, (x, &truth)) in self.luminances(image)?.into_iter().zip(&self.truth).enumerate() {
            let squared = match &self.uncertainty {
                Uncertainty::Unknown => (x - truth).powi(2),
                Uncertainty::Halves([a, b]) => (x - a[index]) * (x - b[index]),
            };
            sums[0] += squared;
            sums[1] += squared / (truth * truth + self.floor * self.floor);
            sums[2] += (x - truth).abs() / (truth.max(0.0) + self.floor);
        }
        let [mse, rel_mse, mape] = sums.map(|sum| sum / self.truth.len() as f64);
        Ok(Errors { mse, rel_mse, mape })
    }

    /// Mean ꟻLIP error of an image as pages show it: with the exposure that brings the
    /// reference's 90th percentile to 0.6. Between 0 and 1. It includes the reference's own noise.
    ///
    /// # Errors
    /// [`EvaluateError::Size`].
    #[cfg(feature = "flip")]
    pub fn flip(&self, image: &RgbImage) -> Result<f64, EvaluateError> {
        self.luminances(image)?;
        let scale = crate::brightness::exposure_of(&self.image).exp2();
        let shown = |image: &RgbImage| {
            let pixels = image
                .pixels()
                .iter()
                .map(|pixel| pixel.map(|value| scale * value));
            RgbImage::new(image.width(), image.height(), pixels.collect())
        };
        lightshed_film::flip(&shown(image)?, &shown(&self.image)?)
            .map_err(|error| EvaluateError::Contest(error.to_string()))
    }

    /// Error of each pixel, `(x − μ) / (μ + ε)`, for pictures.
    ///
    /// # Errors
    /// [`EvaluateError::Size`].
    pub fn relative_errors(&self, image: &RgbImage) -> Result<Vec<f64>, EvaluateError> {
        let values = self.luminances(image)?;
        let pairs = values.iter().zip(&self.truth);
        Ok(pairs
            .map(|(x, truth)| (x - truth) / (truth.max(0.0) + self.floor))
            .collect())
    }

    fn luminances(&self, image: &RgbImage) -> Result<Vec<f64>, EvaluateError> {
        if size(image) != self.size() {
            return Err(EvaluateError::Size {
                image: size(image),
                reference: self.size(),
            });
        }
        Ok(luminances(image))
    }
}

fn size(image: &RgbImage) -> [u32; 2] {
    [image.width(), image.height()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_film::Rgb;
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::check_faults;

    fn image(values: &[f32]) -> RgbImage {
        let pixels = values.iter().map(|&value| [value; 3]).collect();
        RgbImage::new(values.len() as u32, 1, pixels).unwrap()
    }

    #[test]
    fn errors_are_those_of_the_formulas() {
        let reference = Reference::stored(image(&[1.0, 3.0])).unwrap();
        let errors = reference.errors(&image(&[2.0, 2.0])).unwrap();
        assert!((errors.mse - 1.0).abs() < 1e-6);
        let floor = 0.02;
        let rel_mse = 0.5 * (1.0 / (1.0 + floor * floor) + 1.0 / (9.0 + floor * floor));
        assert!((errors.rel_mse - rel_mse).abs() < 1e-6);
        assert!((errors.mape - 0.5 * (1.0 / 1.02 + 1.0 / 3.02)).abs() < 1e-6);
        assert!(reference.errors(&image(&[1.0])).is_err());
        assert!(matches!(
            Reference::stored(image(&[0.0, 0.0])),
            Err(EvaluateError::Black)
        ));
        assert!(matches!(
            Reference::of_halves([image(&[1.0]), image(&[1.0, 1.0])]),
            Err(EvaluateError::Size { .. })
        ));
    }

    #[derive(Clone, Copy, Debug)]
    struct NoiseKept;

    /// The squared error of a known distance against a noisy reference. The noise has 50 times its
    /// size; with 40,000 pixels the estimate is within 6 standard errors but for 2 in 10⁹.
    #[test]
    fn the_noise_of_halves_is_not_counted() {
        let count = 40_000;
        let mut state = 1u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 40) as f32 / (1u64 << 24) as f32 - 0.5) * 1.2
        };
        let mut half = || image(&(0..count).map(|_| 1.0 + noise()).collect::<Vec<_>>());
        let halves = [half(), half()];
        let x = image(&vec![1.05; count]);
        check_faults(&[NoiseKept], |fault| {
            let reference = match fault {
                None => Reference::of_halves(halves.clone())?,
                Some(NoiseKept) => Reference::stored(Reference::of_halves(halves.clone())?.image)?,
            };
            let mse = reference.errors(&x)?.mse;
            // Of (x − a)(x − b): variance σ⁴ + 2 σ² d² with σ² = 0.12, d = 0.05.
            let tolerance = 6.0 * ((0.12f64.powi(2) + 2.0 * 0.12 * 0.0025) / count as f64).sqrt();
            if (mse - 0.0025).abs() < tolerance {
                Ok(())
            } else {
                Err(EvaluateError::Contest(format!("{mse}")))
            }
        })
        .unwrap();
    }

    /// Of two noisy images the noisier is further from the truth, whatever the unit of radiance.
    #[cfg(feature = "flip")]
    #[test]
    fn perceived_errors_do_not_depend_on_the_unit() {
        let noisy = |amount: f32, unit: f32| {
            RgbImage::from_fn(40, 30, |x, y| {
                let sign = if (x * 7 + y * 3) % 5 < 2 { 1.0 } else { -1.0 };
                [unit * (1.0 + amount * sign); 3]
            })
            .unwrap()
        };
        let errors = [1.0, 1e4].map(|unit| {
            let reference = Reference::stored(noisy(0.0, unit)).unwrap();
            assert_eq!(reference.flip(&noisy(0.0, unit)).unwrap(), 0.0);
            [0.1, 0.4].map(|amount| reference.flip(&noisy(amount, unit)).unwrap())
        });
        assert!(
            errors[0][0] > 0.0 && errors[0][1] > 2.0 * errors[0][0],
            "{errors:?}"
        );
        assert!((errors[0][0] - errors[1][0]).abs() < 1e-3, "{errors:?}");
        let reference = Reference::stored(noisy(0.0, 1.0)).unwrap();
        let other = RgbImage::from_fn(30, 40, |_, _| [1.0; 3]).unwrap();
        assert!(matches!(reference.flip(&other), Err(EvaluateError::Size { .. })));
    }

    #[test]
    fn a_reference_that_was_interrupted_is_none() {
        /// Noise about 1.
        struct Noise;
        impl PixelEstimator for Noise {
            fn sample(&self, x: u32, y: u32, sample: u32, seed: u64) -> Rgb {
                Rgb::splat(2.0 * CounterRng::new(seed, y << 16 | x, sample).next_f32())
            }
        }
        let rendered = |cancel| Reference::rendered(&Noise, [8, 6], 4, &|_| (), &AtomicBool::new(cancel));
        assert!(matches!(rendered(true), Err(EvaluateError::Interrupted)));
        let reference = rendered(false).unwrap();
        assert_eq!(reference.size(), [8, 6]);
        // Its halves are independent.
        assert!(reference.errors(reference.image()).unwrap().mse < 0.0);
    }
}
