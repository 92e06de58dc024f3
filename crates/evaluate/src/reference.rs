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
            let squared = self.squared(index, x);
            sums[0] += squared;
            sums[1] += squared / (truth * truth + self.floor * self.floor);
            sums[2] += (x - truth).abs() / (truth.max(0.0) + self.floor);
        }
        let [mse, rel_mse, mape] = sums.map(|sum| sum / self.truth.len() as f64);
        Ok(Errors { mse, rel_mse, mape })
    }

    /// Mean squared error over the pixels that `keep` says; `None` if it says none. Noise is
    /// treated as in [`errors`](Self::errors).
    ///
    /// # Errors
    /// [`EvaluateError::Size`], also where `keep` has another number of pixels.
    pub fn mse_where(&self, image: &RgbImage, keep: &[bool]) -> Result<Option<f64>, EvaluateError> {
        let values = self.luminances(image)?;
        if keep.len() != values.len() {
            return Err(EvaluateError::Size {
                image: [keep.len() as u32, 1],
                reference: self.size(),
            });
        }
        let kept = values.iter().enumerate().filter(|(index, _)| keep[*index]);
        let (sum, count) = kept.fold((0.0, 0.0), |(sum, count), (index, &x)| {
            (sum + self.squared(index, x), count + 1.0)
        });
        Ok((count > 0.0).then(|| sum / count))
    }

    /// Mean squared error of the change from one frame to the next, `⟨((y − x) − (ν − μ))²⟩`, with
    /// `x` and `μ` the image and the reference (`before`) of one, `y` and `ν` those of the other:
    /// what flickers.
    ///
    /// # Errors
    /// [`EvaluateError::Size`].
    pub fn change_error(&self, before: &Self, [x, y]: [&RgbImage; 2]) -> Result<f64, EvaluateError> {
        let (x, y) = (before.luminances(x)?, self.luminances(y)?);
        if before.size() != self.size() {
            return Err(EvaluateError::Size {
                image: before.size(),
                reference: self.size(),
            });
        }
        let squared = |index: usize| {
            let change = y[index] - x[index];
            match (&self.uncertainty, &before.uncertainty) {
                (Uncertainty::Halves([a, b]), Uncertainty::Halves([c, d])) => {
                    (change - (a[index] - c[index])) * (change - (b[index] - d[index]))
                }
                _ => (change - (self.truth[index] - before.truth[index])).powi(2),
            }
        };
        Ok((0..y.len()).map(squared).sum::<f64>() / y.len() as f64)
    }

    /// Covariance of two frames of the same view, `⟨(x − μ)(y − μ)⟩`: 0 on average for independent
    /// frames without bias, below 0 where random numbers are stratified over the frames, and the
    /// variance for the same frame twice. Unlike
    /// [`autocovariance`](crate::TemporalStudy::autocovariance) it is about the truth, so it is not
    /// too low for frames that hang together for long; a bias adds its square.
    ///
    /// # Errors
    /// [`EvaluateError::Size`].
    pub fn covariance(&self, [x, y]: [&RgbImage; 2]) -> Result<f64, EvaluateError> {
        let (x, y) = (self.luminances(x)?, self.luminances(y)?);
        let product = |index: usize| {
            let (x, y) = (x[index], y[index]);
            match &self.uncertainty {
                Uncertainty::Unknown => (x - self.truth[index]) * (y - self.truth[index]),
                Uncertainty::Halves([a, b]) => {
                    let (a, b) = (a[index], b[index]);
                    0.5 * ((x - a) * (y - b) + (x - b) * (y - a))
                }
            }
        };
        Ok((0..y.len()).map(product).sum::<f64>() / y.len() as f64)
    }

    /// The squared error that the reference itself has, if it is known: a quarter of the mean
    /// squared difference of its halves.
    pub fn noise(&self) -> Option<f64> {
        match &self.uncertainty {
            Uncertainty::Unknown => None,
            Uncertainty::Halves([a, b]) => {
                let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
                Some(0.25 * sum / a.len() as f64)
            }
        }
    }

    /// `(x − μ)²` of a pixel, without the noise of a reference of halves on average.
    fn squared(&self, index: usize, x: f64) -> f64 {
        match &self.uncertainty {
            Uncertainty::Unknown => (x - self.truth[index]).powi(2),
            Uncertainty::Halves([a, b]) => (x - a[index]) * (x - b[index]),
        }
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

    #[test]
    fn errors_of_some_pixels_and_of_changes() {
        let halves = |values: [[f32; 3]; 2]| Reference::of_halves(values.map(|half| image(&half))).unwrap();
        let (first, second) = (
            halves([[1.0, 3.0, 2.0], [1.0, 3.0, 4.0]]),
            halves([[2.0, 3.0, 2.0], [2.0, 3.0, 2.0]]),
        );
        let x = image(&[1.5, 3.0, 4.0]);
        let close =
            |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        close(first.mse_where(&x, &[true, true, false]).unwrap().unwrap(), 0.125);
        close(first.mse_where(&x, &[false, false, true]).unwrap().unwrap(), 0.0);
        assert_eq!(first.mse_where(&x, &[false; 3]).unwrap(), None);
        assert!(first.mse_where(&x, &[true; 2]).is_err());
        close(first.noise().unwrap(), 0.25 * 4.0 / 3.0);
        assert_eq!(Reference::stored(x.clone()).unwrap().noise(), None);
        // (x − a)(y − b) and the other way round; the variance where x is y.
        let y = image(&[0.5, 4.0, 3.0]);
        close(
            first.covariance([&x, &y]).unwrap(),
            (-0.25 + 0.0 - 0.5 * 2.0 * 1.0) / 3.0,
        );
        close(first.covariance([&x, &x]).unwrap(), first.errors(&x).unwrap().mse);
        close(second.covariance([&y, &y]).unwrap(), (2.25 + 1.0 + 1.0) / 3.0);
        // A constant error does not flicker; one in a single frame does.
        let y = image(&[2.5, 3.0, 3.0]);
        close(
            second.change_error(&first, [&x, &y]).unwrap(),
            (0.0 + 0.0 - 1.0) / 3.0,
        );
        let y = image(&[3.5, 3.0, 3.0]);
        close(
            second.change_error(&first, [&x, &y]).unwrap(),
            (1.0 + 0.0 - 1.0) / 3.0,
        );
        let stored = |values: [f32; 3]| Reference::stored(image(&values)).unwrap();
        let (first, second) = (stored([1.0, 3.0, 3.0]), stored([2.0, 3.0, 2.0]));
        close(second.change_error(&first, [&x, &y]).unwrap(), 1.0 / 3.0);
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
