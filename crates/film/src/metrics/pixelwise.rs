//! Metrics that are means over pixels. All take linear values and sum in `f64`.

use super::MetricError;
use super::error::{paired, same_size};
use crate::RgbImage;
use lightshed_sampling::{Rgb, luminance};

/// The `ε` of [`relative_mean_squared_error`]: without it, black pixels of the reference would
/// dominate.
pub const RELATIVE_MSE_EPSILON: f64 = 0.01;

/// Mean of a function over all pixels and channels.
fn mean_over_channels(
    image: &RgbImage,
    reference: &RgbImage,
    f: impl Fn(f64, f64) -> f64,
) -> Result<f64, MetricError> {
    let pairs = paired(image, reference)?;
    let count = 3.0 * pairs.len() as f64;
    let sum: f64 = pairs
        .flat_map(|(i, r)| i.iter().zip(r))
        .map(|(&i, &r)| f(f64::from(i), f64::from(r)))
        .sum();
    Ok(sum / count)
}

/// Mean squared error, `mean((I − R)²)` over pixels and channels.
///
/// # Errors
///
/// The images differ in size.
pub fn mean_squared_error(image: &RgbImage, reference: &RgbImage) -> Result<f64, MetricError> {
    mean_over_channels(image, reference, |i, r| (i - r) * (i - r))
}

/// Relative mean squared error, `mean((I − R)² / (R² + ε))` over pixels and channels, with
/// `ε =` [`RELATIVE_MSE_EPSILON`] (the form of Rousselle et al. 2011, *Adaptive Sampling and
/// Reconstruction using Greedy Error Minimization*, §4, with the `ε` of later works).
///
/// # Errors
///
/// The images differ in size.
pub fn relative_mean_squared_error(image: &RgbImage, reference: &RgbImage) -> Result<f64, MetricError> {
    mean_over_channels(image, reference, |i, r| {
        (i - r) * (i - r) / (r * r + RELATIVE_MSE_EPSILON)
    })
}

/// Mean absolute percentage error, `mean(|Y_I − Y_R| / (0.01 · mean(Y_R) + Y_R))` over pixels,
/// with `Y` the luminance (Lin et al. 2022, *Generalized Resampled Importance Sampling*; footnote
/// 12 of the dissertation of Lin 2022, which takes a greyscale ground truth). As a fraction: 1 is a
/// hundred per cent. Negative luminance of the reference, which no renderer with a positive filter
/// makes, counts as zero.
///
/// # Errors
///
/// The images differ in size, or the reference is black.
pub fn mean_absolute_percentage_error(image: &RgbImage, reference: &RgbImage) -> Result<f64, MetricError> {
    let pairs = paired(image, reference)?;
    let count = pairs.len() as f64;
    let luminance = |&pixel: &[f32; 3]| {
        // In halves, so that the sum of three large channels stays finite.
        2.0 * f64::from(luminance(0.5 * Rgb::from_array(pixel)))
    };
    let mean = pairs.clone().map(|(_, r)| luminance(r).max(0.0)).sum::<f64>() / count;
    if mean <= 0.0 {
        return Err(MetricError::BlackReference);
    }
    let relative = |(i, r): (&[f32; 3], &[f32; 3])| {
        let (i, r) = (luminance(i), luminance(r));
        (i - r).abs() / (0.01 * mean + r.max(0.0))
    };
    Ok(pairs.map(relative).sum::<f64>() / count)
}

/// Relative deviation of each channel's mean, `mean(I_c) / mean(R_c) − 1`: the measure of bias
/// that noise hides least. `None` for a channel whose mean in the reference is zero.
///
/// # Errors
///
/// The images differ in size.
pub fn relative_mean(image: &RgbImage, reference: &RgbImage) -> Result<[Option<f64>; 3], MetricError> {
    same_size(image, reference)?;
    let (found, expected) = (image.mean(), reference.mean());
    Ok(std::array::from_fn(|c| {
        (expected[c] != 0.0).then(|| found[c] / expected[c] - 1.0)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn image(f: impl FnMut(u32, u32) -> [f32; 3]) -> RgbImage {
        RgbImage::from_fn(7, 5, f).unwrap()
    }

    /// A reference with dark, bright and coloured pixels.
    fn reference() -> RgbImage {
        image(|x, y| [(x * y) as f32, 0.5 + x as f32, 0.25 * y as f32])
    }

    #[test]
    fn equal_images_do_not_differ() {
        let r = reference();
        assert_eq!(mean_squared_error(&r, &r), Ok(0.0));
        assert_eq!(relative_mean_squared_error(&r, &r), Ok(0.0));
        assert_eq!(mean_absolute_percentage_error(&r, &r), Ok(0.0));
        assert_eq!(relative_mean(&r, &r), Ok([Some(0.0); 3]));
    }

    #[test]
    fn constant_images_have_closed_forms() {
        let (i, r) = (image(|_, _| [2.5; 3]), image(|_, _| [2.0; 3]));
        assert_relative_eq!(mean_squared_error(&i, &r).unwrap(), 0.25);
        assert_relative_eq!(relative_mean_squared_error(&i, &r).unwrap(), 0.25 / 4.01);
        assert_relative_eq!(
            mean_absolute_percentage_error(&i, &r).unwrap(),
            0.25 / 1.01,
            max_relative = 1e-6
        );
        for deviation in relative_mean(&i, &r).unwrap() {
            assert_relative_eq!(deviation.unwrap(), 0.25);
        }
    }

    /// Footnote 12, pixel by pixel and in `f64`, written out a second time.
    fn naive_mape(image: &RgbImage, reference: &RgbImage) -> f64 {
        let y = |p: &[f32; 3]| {
            0.212671 * f64::from(p[0]) + 0.715160 * f64::from(p[1]) + 0.072169 * f64::from(p[2])
        };
        let n = reference.pixels().len();
        let mut mean = 0.0;
        for p in reference.pixels() {
            mean += y(p) / n as f64;
        }
        let mut sum = 0.0;
        for k in 0..n {
            let (i, r) = (y(&image.pixels()[k]), y(&reference.pixels()[k]));
            sum += (i - r).abs() / (0.01 * mean + r);
        }
        sum / n as f64
    }

    #[test]
    fn varying_images_match_the_naive_sums() {
        let r = reference();
        let i = image(|x, y| [(x * y) as f32 + 0.5, x as f32, 0.25 * (y as f32).powi(2)]);
        let (mut squared, mut relative) = (0.0, 0.0);
        for (i, r) in i.pixels().iter().flatten().zip(r.pixels().iter().flatten()) {
            let (i, r) = (f64::from(*i), f64::from(*r));
            squared += (i - r).powi(2) / 105.0;
            relative += (i - r).powi(2) / (r.powi(2) + 0.01) / 105.0;
        }
        assert_relative_eq!(mean_squared_error(&i, &r).unwrap(), squared, max_relative = 1e-12);
        assert_relative_eq!(
            relative_mean_squared_error(&i, &r).unwrap(),
            relative,
            max_relative = 1e-12
        );
        let mape = mean_absolute_percentage_error(&i, &r).unwrap();
        assert_relative_eq!(mape, naive_mape(&i, &r), max_relative = 1e-6);
        // Planted faults, each far outside the tolerance: image and reference swapped; the mean
        // left out.
        assert!((mean_absolute_percentage_error(&r, &i).unwrap() - mape).abs() > 1e-2);
        assert!((relative_mean_squared_error(&r, &i).unwrap() - relative).abs() > 1e-2 * relative);
    }

    #[test]
    fn sizes_must_agree_and_a_black_reference_has_no_percentage() {
        let (r, other) = (reference(), RgbImage::from_fn(5, 7, |_, _| [1.0; 3]).unwrap());
        let size = MetricError::Size {
            image: [5, 7],
            reference: [7, 5],
        };
        assert_eq!(mean_squared_error(&other, &r), Err(size));
        assert_eq!(relative_mean_squared_error(&other, &r), Err(size));
        assert_eq!(mean_absolute_percentage_error(&other, &r), Err(size));
        assert_eq!(relative_mean(&other, &r), Err(size));
        let black = image(|_, _| [0.0; 3]);
        assert_eq!(
            mean_absolute_percentage_error(&r, &black),
            Err(MetricError::BlackReference)
        );
        assert_eq!(relative_mean(&r, &black), Ok([None; 3]));
        assert!(relative_mean_squared_error(&r, &black).unwrap().is_finite());
    }

    #[test]
    fn extremes_stay_finite() {
        let (i, r) = (
            image(|_, _| [f32::MAX; 3]),
            image(|x, _| [if x == 0 { f32::MIN } else { f32::MAX }; 3]),
        );
        assert!(mean_squared_error(&i, &r).unwrap().is_finite());
        assert!(relative_mean_squared_error(&i, &r).unwrap().is_finite());
        assert!(mean_absolute_percentage_error(&i, &r).unwrap().is_finite());
    }
}
