//! Structural similarity.

use super::MetricError;
use super::error::paired;
use crate::{RgbImage, linear_to_srgb};
use lightshed_sampling::{Rgb, luminance};

/// Side of the window of [`structural_similarity`] in pixels.
pub const SSIM_WINDOW: u32 = 11;

const TAPS: usize = SSIM_WINDOW as usize;
/// Standard deviation of the window's Gaussian, pixels.
const SIGMA: f64 = 1.5;
/// `(K₁ L)²` and `(K₂ L)²` with `K₁ = 0.01`, `K₂ = 0.03` and a dynamic range `L = 1`.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004, *Image Quality Assessment:
/// From Error Visibility to Structural Similarity*, eqs. 13 and 17): at each window
///
/// `SSIM = (2 μ_I μ_R + C₁)(2 σ_IR + C₂) / ((μ_I² + μ_R² + C₁)(σ_I² + σ_R² + C₂))`
///
/// with moments weighted by a Gaussian of 11×11 pixels and standard deviation 1.5, `K₁ = 0.01`,
/// `K₂ = 0.03`, averaged over the windows that lie wholly inside the image. It is defined on
/// displayed images: it sees the luminance, clamped to `[0, 1]` and encoded by [`linear_to_srgb`],
/// with a dynamic range of 1. Between −1 and 1; 1 for equal images.
///
/// # Errors
///
/// The images differ in size, or a side is shorter than [`SSIM_WINDOW`].
pub fn structural_similarity(image: &RgbImage, reference: &RgbImage) -> Result<f64, MetricError> {
    let pairs = paired(image, reference)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    if width < TAPS || height < TAPS {
        return Err(MetricError::TooSmall { window: SSIM_WINDOW });
    }
    let displayed = |&pixel: &[f32; 3]| {
        // In halves, so that the sum of three large channels stays finite.
        f64::from(linear_to_srgb(2.0 * luminance(0.5 * Rgb::from_array(pixel))))
    };
    // First and second moments that a window needs, as planes: I, R, I², R², IR.
    let moments = pairs.map(|(i, r)| {
        let (i, r) = (displayed(i), displayed(r));
        [i, r, i * i, r * r, i * r]
    });
    let moments = blur(&moments.collect::<Vec<_>>(), width, height);
    let count = moments.len() as f64;
    Ok(moments.into_iter().map(similarity).sum::<f64>() / count)
}

/// SSIM of one window from its weighted means of `I, R, I², R², IR`.
fn similarity([mu_i, mu_r, ii, rr, ir]: [f64; 5]) -> f64 {
    let (var_i, var_r) = ((ii - mu_i * mu_i).max(0.0), (rr - mu_r * mu_r).max(0.0));
    let covariance = ir - mu_i * mu_r;
    (2.0 * mu_i * mu_r + C1) * (2.0 * covariance + C2)
        / ((mu_i * mu_i + mu_r * mu_r + C1) * (var_i + var_r + C2))
}

/// The window's weights along one axis; they sum to one.
fn gaussian() -> [f64; TAPS] {
    let centre = (TAPS / 2) as f64;
    let weights: [f64; TAPS] = std::array::from_fn(|k| (-0.5 * ((k as f64 - centre) / SIGMA).powi(2)).exp());
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// Weighted means over all windows inside a `width × height` plane: along rows, then along
/// columns.
fn blur(plane: &[[f64; 5]], width: usize, height: usize) -> Vec<[f64; 5]> {
    let weights = gaussian();
    let weigh = |first: usize, stride: usize, values: &[[f64; 5]]| {
        weights.iter().enumerate().fold([0.0; 5], |sum, (k, weight)| {
            let value = values[first + k * stride];
            std::array::from_fn(|m| sum[m] + weight * value[m])
        })
    };
    let inner_width = width - TAPS + 1;
    let mut rows = Vec::with_capacity(inner_width * height);
    for y in 0..height {
        rows.extend((0..inner_width).map(|x| weigh(y * width + x, 1, plane)));
    }
    let mut blurred = Vec::with_capacity(inner_width * (height - TAPS + 1));
    for y in 0..=height - TAPS {
        blurred.extend((0..inner_width).map(|x| weigh(y * inner_width + x, inner_width, &rows)));
    }
    blurred
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn grey(width: u32, height: u32, mut f: impl FnMut(u32, u32) -> f32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| [f(x, y); 3]).unwrap()
    }

    /// The definition with a two-dimensional window, one window after the other, central moments in
    /// a second pass.
    fn naive(image: &RgbImage, reference: &RgbImage) -> f64 {
        let at =
            |image: &RgbImage, x, y| f64::from(linear_to_srgb(luminance(image.get(x, y).unwrap().into())));
        let weight = |dx: u32, dy: u32| {
            let (dx, dy) = (f64::from(dx) - 5.0, f64::from(dy) - 5.0);
            (-(dx * dx + dy * dy) / (2.0 * 1.5 * 1.5)).exp()
        };
        let window = || (0..11).flat_map(|dy| (0..11).map(move |dx| (dx, dy)));
        let total: f64 = window().map(|(dx, dy)| weight(dx, dy)).sum();
        let (mut sum, mut count) = (0.0, 0.0);
        for y in 0..=image.height() - 11 {
            for x in 0..=image.width() - 11 {
                let mean = |f: &dyn Fn(u32, u32) -> f64| {
                    window()
                        .map(|(dx, dy)| weight(dx, dy) / total * f(x + dx, y + dy))
                        .sum::<f64>()
                };
                let (mi, mr) = (mean(&|x, y| at(image, x, y)), mean(&|x, y| at(reference, x, y)));
                let vi = mean(&|x, y| (at(image, x, y) - mi).powi(2));
                let vr = mean(&|x, y| (at(reference, x, y) - mr).powi(2));
                let cov = mean(&|x, y| (at(image, x, y) - mi) * (at(reference, x, y) - mr));
                sum += (2.0 * mi * mr + 1e-4) * (2.0 * cov + 9e-4)
                    / ((mi * mi + mr * mr + 1e-4) * (vi + vr + 9e-4));
                count += 1.0;
            }
        }
        sum / count
    }

    #[test]
    fn matches_the_definition_window_by_window() {
        for (width, height) in [(11, 11), (16, 13), (12, 20)] {
            let wave = |x: u32, y: u32| (0.5 + 0.5 * (x as f32 * 0.9 + (y * y) as f32 * 0.3).sin()).powi(2);
            let r = grey(width, height, wave);
            let i = grey(width, height, |x, y| {
                0.8 * wave(x, y) + 0.1 * ((x * 7 + y * 5) % 3) as f32
            });
            let found = structural_similarity(&i, &r).unwrap();
            assert_relative_eq!(found, naive(&i, &r), max_relative = 1e-9);
            assert!((0.1..0.99).contains(&found), "{found} tells nothing");
            assert_relative_eq!(
                structural_similarity(&r, &i).unwrap(),
                found,
                max_relative = 1e-12
            );
            assert_relative_eq!(structural_similarity(&r, &r).unwrap(), 1.0, max_relative = 1e-12);
        }
    }

    #[test]
    fn constant_images_have_a_closed_form() {
        // Without structure only the first factor is left, on encoded values.
        let (i, r) = (grey(20, 15, |_, _| 0.25), grey(20, 15, |_, _| 0.5));
        let (a, b) = (f64::from(linear_to_srgb(0.25)), f64::from(linear_to_srgb(0.5)));
        let expected = (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4);
        assert_relative_eq!(
            structural_similarity(&i, &r).unwrap(),
            expected,
            max_relative = 1e-6
        );
        // Beyond white nothing is seen.
        let (i, r) = (grey(20, 15, |_, _| f32::MAX), grey(20, 15, |_, _| 1.0));
        assert_relative_eq!(structural_similarity(&i, &r).unwrap(), 1.0, max_relative = 1e-12);
    }

    #[test]
    fn inverted_structure_is_negative() {
        let stripes = grey(24, 24, |x, _| f32::from(x % 4 < 2));
        let inverted = grey(24, 24, |x, _| f32::from(x % 4 >= 2));
        assert!(structural_similarity(&stripes, &inverted).unwrap() < -0.5);
    }

    #[test]
    fn small_and_unequal_images_are_errors() {
        let (small, large) = (grey(10, 30, |_, _| 0.5), grey(30, 30, |_, _| 0.5));
        assert_eq!(
            structural_similarity(&small, &small),
            Err(MetricError::TooSmall { window: 11 })
        );
        assert!(matches!(
            structural_similarity(&small, &large),
            Err(MetricError::Size { .. })
        ));
    }
}
