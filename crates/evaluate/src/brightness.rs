//! Luminances of images, and the exposure that shows one well.

use lightshed_film::RgbImage;
use lightshed_sampling::{Rgb, luminance};

/// Luminances of an image's pixels.
pub(crate) fn luminances(image: &RgbImage) -> Vec<f64> {
    let of_pixel = |&pixel: &[f32; 3]| f64::from(luminance(Rgb::from(pixel)));
    image.pixels().iter().map(of_pixel).collect()
}

/// Stops that bring the 90th percentile of an image's luminance to 0.6.
pub fn exposure_of(image: &RgbImage) -> f32 {
    let mut values = luminances(image);
    let place = values.len() * 9 / 10;
    let (_, high, _) = values.select_nth_unstable_by(place, f64::total_cmp);
    if *high > 0.0 && high.is_finite() {
        (0.6 / *high).log2() as f32
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_exposed_by_their_bright_parts() {
        let image = RgbImage::new(10, 1, (0..10).map(|i| [0.3 * i as f32; 3]).collect()).unwrap();
        assert!((exposure_of(&image) - (0.6f32 / 2.7).log2()).abs() < 1e-3);
        let black = RgbImage::new(1, 1, vec![[0.0; 3]]).unwrap();
        assert_eq!(exposure_of(&black), 0.0);
    }
}
