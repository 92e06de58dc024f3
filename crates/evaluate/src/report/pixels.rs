//! Errors of single pixels over time, as data for the page.

use super::page::escape;
use crate::{Checkpoint, EvaluateError, Reference};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::json;

/// Most curves of a method. Larger images have one curve for each block of pixels.
const MAX_CURVES: u32 = 16_384;
/// Decades of the relative error, from the least to the greatest.
const DECADES: [f64; 2] = [-4.0, 2.0];

/// The plot that shows the pixel under a click; nothing if a method has no checkpoints.
///
/// A curve is the root mean square over a block of `(image − reference) / reference` at each
/// checkpoint, its logarithm in 8 bits between [`DECADES`].
pub fn pixel_plot(
    reference: &Reference,
    names: &[String],
    checkpoints: &[Vec<Checkpoint>],
) -> Result<String, EvaluateError> {
    if checkpoints.len() != names.len() || checkpoints.iter().any(Vec::is_empty) {
        return Ok(String::new());
    }
    let size = reference.size();
    let block = block_side(size);
    let blocks = size.map(|side| side.div_ceil(block));
    let mut seconds = Vec::new();
    let mut data = Vec::new();
    for of_method in checkpoints {
        let mut bytes = Vec::new();
        for checkpoint in of_method {
            let errors = reference.relative_errors(&checkpoint.image)?;
            bytes.extend(block_errors(&errors, size, block).map(code));
        }
        seconds.push(of_method.iter().map(|c| c.seconds).collect::<Vec<_>>());
        data.push(STANDARD.encode(bytes));
    }
    let [low, high] = DECADES;
    let json = json!({
        "width": blocks[0], "height": blocks[1], "block": block, "low": low, "high": high,
        "names": names, "seconds": seconds, "data": data,
    });
    // Within a script nothing else could end it.
    let json = json.to_string().replace('<', "\\u003c");
    let label = escape(
        "|image − reference| / reference of the selected pixel in the last repeat, against CPU seconds.",
    );
    Ok(format!(
        "<div class=\"pixel\" hidden><h3>Error over time of <span class=\"where\"></span></h3><p class=\"small\">{label}</p>\
         <div class=\"plot\"><svg viewBox=\"0 0 720 300\" font-family=\"sans-serif\" font-size=\"12\"></svg></div>\
         <script type=\"application/json\">{json}</script></div>\n"
    ))
}

/// The side of blocks, a power of two, with which no more than [`MAX_CURVES`] cover an image.
fn block_side(size: [u32; 2]) -> u32 {
    let mut side = 1;
    while size
        .map(|length| u64::from(length.div_ceil(side)))
        .iter()
        .product::<u64>()
        > u64::from(MAX_CURVES)
    {
        side *= 2;
    }
    side
}

/// The root mean square of errors over each block, row by row.
fn block_errors(errors: &[f64], size: [u32; 2], side: u32) -> impl Iterator<Item = f64> {
    let blocks = size.map(|length| length.div_ceil(side));
    let mut sums = vec![[0.0; 2]; blocks[0] as usize * blocks[1] as usize];
    for (index, error) in (0u32..).zip(errors) {
        let (x, y) = (index % size[0] / side, index / size[0] / side);
        let [sum, count] = &mut sums[(y * blocks[0] + x) as usize];
        *sum += error * error;
        *count += 1.0;
    }
    sums.into_iter()
        .map(|[sum, count]| (sum / f64::max(count, 1.0)).sqrt())
}

/// The logarithm of an error in 8 bits; NaN counts as the greatest.
fn code(error: f64) -> u8 {
    let [low, high] = DECADES;
    let share = (error.log10() - low) / (high - low);
    if share.is_nan() {
        return u8::MAX;
    }
    (share.clamp(0.0, 1.0) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_film::RgbImage;

    #[test]
    fn blocks_cover_images_of_any_size() {
        assert_eq!(block_side([128, 128]), 1);
        assert_eq!(block_side([129, 128]), 2);
        assert_eq!(block_side([1920, 1080]), 16);
        let errors: Vec<f64> = (0..15).map(f64::from).collect();
        let found: Vec<f64> = block_errors(&errors, [5, 3], 2).collect();
        // Rows of 5: the blocks of the last column and row are cut off.
        let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
        let expected = [
            rms(&[0.0, 1.0, 5.0, 6.0]),
            rms(&[2.0, 3.0, 7.0, 8.0]),
            rms(&[4.0, 9.0]),
            rms(&[10.0, 11.0]),
            rms(&[12.0, 13.0]),
            14.0,
        ];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        assert_eq!(found.len(), 6);
    }

    #[test]
    fn logarithms_fit_into_bytes() {
        assert_eq!(
            [0.0, 1e-9, 1e-4, 0.1, 1e2, 1e9, f64::NAN].map(code),
            [0, 0, 0, 128, 255, 255, 255]
        );
    }

    #[test]
    fn a_plot_needs_checkpoints_of_every_method() {
        let image = RgbImage::new(2, 1, vec![[0.5; 3], [1.0; 3]]).unwrap();
        let reference = Reference::stored(image.clone()).unwrap();
        let names = ["a</script>".to_owned(), "b".to_owned()];
        let checkpoint = Checkpoint { seconds: 0.5, image };
        let none = pixel_plot(&reference, &names, &[vec![checkpoint.clone()], Vec::new()]).unwrap();
        assert_eq!(none, "");
        let plot = pixel_plot(&reference, &names, &[vec![checkpoint.clone()], vec![checkpoint]]).unwrap();
        assert_eq!(
            plot.matches("</script>").count(),
            1,
            "a name cannot end the script"
        );
        assert!(
            plot.contains("\"width\":2") && plot.contains("\"AAA=\""),
            "{plot}"
        );
    }
}
