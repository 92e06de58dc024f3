//! The perceptual difference ꟻLIP.

use super::MetricError;
use super::error::same_size;
use crate::RgbImage;
use crate::output::srgb_bytes;

/// Mean ꟻLIP error (Andersson et al. 2020, *ꟻLIP: A Difference Evaluator for Alternating
/// Images*) of the images as displayed: clamped to `[0, 1]`, sRGB with 8 bits a channel, at 67
/// pixels a degree. Between 0 (equal) and 1.
///
/// # Errors
///
/// The images differ in size.
pub fn flip(image: &RgbImage, reference: &RgbImage) -> Result<f64, MetricError> {
    same_size(image, reference)?;
    let displayed = |image: &RgbImage| {
        nv_flip::FlipImageRgb8::with_data(image.width(), image.height(), &srgb_bytes(image, 0.0))
    };
    let map = nv_flip::flip(
        displayed(reference),
        displayed(image),
        nv_flip::DEFAULT_PIXELS_PER_DEGREE,
    )
    .to_vec();
    Ok(map.iter().map(|&error| f64::from(error)).sum::<f64>() / map.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constant(colour: [f32; 3]) -> RgbImage {
        RgbImage::from_fn(40, 30, |_, _| colour).unwrap()
    }

    #[test]
    fn black_against_white_has_a_closed_form() {
        // Without edges only the colour term is left. HyAB distances in Hunt-adjusted CIELAB
        // (§4.1.2–4.1.3 of the paper): 100 between black and white, and at most that of sRGB
        // green to sRGB blue.
        let hunt = |[l, a, b]: [f64; 3]| [l, 0.01 * l * a, 0.01 * l * b];
        let (green, blue) = (
            hunt([87.7347, -86.1827, 83.1793]),
            hunt([32.2970, 79.1875, -107.8602]),
        );
        let chroma = ((green[1] - blue[1]).powi(2) + (green[2] - blue[2]).powi(2)).sqrt();
        let most = ((green[0] - blue[0]).abs() + chroma).powf(0.7);
        let (knee, at_knee) = (0.4 * most, 0.95);
        let expected = at_knee + (100f64.powf(0.7) - knee) / (most - knee) * (1.0 - at_knee);
        let found = flip(&constant([1.0; 3]), &constant([0.0; 3])).unwrap();
        assert!((found - expected).abs() < 2e-3, "{found} against {expected}");
    }

    #[test]
    fn it_is_zero_for_equal_images_and_grows_with_the_difference() {
        let error = |value: f32| flip(&constant([value; 3]), &constant([0.5; 3])).unwrap();
        assert_eq!(error(0.5), 0.0);
        assert!(error(0.6) > 0.01 && error(0.9) > error(0.6) && error(0.9) < 1.0);
        let other = RgbImage::from_fn(30, 40, |_, _| [0.5; 3]).unwrap();
        assert!(matches!(
            flip(&other, &constant([0.5; 3])),
            Err(MetricError::Size { .. })
        ));
    }
}
