//! Pictures for a page.

use crate::EvaluateError;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use lightshed_film::{RgbImage, write_png};

/// An image as a `data:` address of a PNG.
pub fn png_data(image: &RgbImage, exposure: f32) -> Result<String, EvaluateError> {
    let mut file = Vec::new();
    write_png(image, exposure, &mut file)
        .map_err(|error| EvaluateError::Record(format!("a picture cannot be written: {error}")))?;
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(file)))
}

/// Signed errors as colours, linear: white at 0, blue below, red above, full at −1 and 1.
pub fn error_colours(size: [u32; 2], errors: &[f64]) -> Result<RgbImage, EvaluateError> {
    let colour = |&error: &f64| {
        let strength = error.abs().min(1.0) as f32;
        let less = 1.0 - strength;
        match error {
            _ if error.is_nan() => [0.0; 3],
            _ if error > 0.0 => [1.0 - 0.2 * strength, less * less, less * less],
            _ => [less * less, less * less, 1.0 - 0.2 * strength],
        }
    };
    Ok(RgbImage::new(
        size[0],
        size[1],
        errors.iter().map(colour).collect(),
    )?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_have_colours() {
        let image = error_colours([3, 1], &[-2.0, 0.0, 0.5]).unwrap();
        let [low, zero, high] = image.pixels() else {
            panic!()
        };
        assert_eq!(*zero, [1.0; 3]);
        assert!(low[2] > low[0] && high[0] > high[2]);
    }

    #[test]
    fn pictures_are_data() {
        let image = RgbImage::new(10, 1, (0..10).map(|i| [0.3 * i as f32; 3]).collect()).unwrap();
        assert!(
            png_data(&image, 0.0)
                .unwrap()
                .starts_with("data:image/png;base64,iVBOR")
        );
    }
}
