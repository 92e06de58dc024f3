//! PNG: 8 bits a channel, sRGB.

use crate::RgbImage;
use std::io::{self, Write};

/// The sRGB transfer function (IEC 61966-2-1) of a linear value: `[0, 1] → [0, 1]`, clamped
/// outside, NaN to 0.
#[inline]
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear >= 1.0 {
        1.0
    } else if linear > 0.003_130_8 {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    } else {
        12.92 * linear.max(0.0)
    }
}

/// The image as sRGB bytes, after multiplying linear values by `2^exposure`.
pub(crate) fn srgb_bytes(image: &RgbImage, exposure: f32) -> Vec<u8> {
    let scale = exposure.exp2();
    let encode = |&linear: &f32| (linear_to_srgb(linear * scale) * 255.0).round() as u8;
    image.pixels().iter().flatten().map(encode).collect()
}

/// Writes `image` as a PNG of 8 bits a channel: linear values are multiplied by `2^exposure`
/// (`exposure` in stops), clamped to `[0, 1]` and encoded by [`linear_to_srgb`].
///
/// # Errors
///
/// Those of `writer`.
pub fn write_png(image: &RgbImage, exposure: f32, mut writer: impl Write) -> io::Result<()> {
    write(image, exposure, &mut writer)
}

/// [`write_png`], compiled once and not for every writer.
fn write(image: &RgbImage, exposure: f32, writer: &mut dyn Write) -> io::Result<()> {
    let mut encoder = png::Encoder::new(writer, image.width(), image.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&srgb_bytes(image, exposure))?;
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transfer_function_inverts_the_standards_decoding() {
        let decode = |v: f64| {
            if v <= 0.04045 {
                v / 12.92
            } else {
                ((v + 0.055) / 1.055).powf(2.4)
            }
        };
        for i in 0..=255 {
            let encoded = f64::from(i) / 255.0;
            let back = f64::from(linear_to_srgb(decode(encoded) as f32));
            assert!((back - encoded).abs() < 2e-6, "{encoded} became {back}");
        }
        for (outside, clamped) in [(-1.0, 0.0), (2.0, 1.0), (f32::NAN, 0.0), (f32::INFINITY, 1.0)] {
            assert_eq!(linear_to_srgb(outside), clamped);
        }
    }

    #[test]
    fn a_written_file_reads_back_with_its_exposure() {
        let image = RgbImage::new(2, 1, vec![[0.0, 0.25, 0.5], [2.0, -1.0, 0.125]]).unwrap();
        for (exposure, expected) in [
            (0.0, [0, 137, 188, 255, 0, 99]),
            (1.0, [0, 188, 255, 255, 0, 137]),
        ] {
            let mut file = Vec::new();
            write_png(&image, exposure, &mut file).unwrap();
            let mut reader = png::Decoder::new(io::Cursor::new(file)).read_info().unwrap();
            let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut bytes).unwrap();
            assert_eq!(
                (info.width, info.height, info.color_type),
                (2, 1, png::ColorType::Rgb)
            );
            assert!(reader.info().srgb.is_some());
            assert_eq!(bytes, expected);
        }
    }
}
