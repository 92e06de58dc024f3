//! Images from files: PNG, JPEG, Radiance HDR and OpenEXR.

use super::error::{ImportError, Location, read_file};
use crate::Image;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::io::Cursor;
use std::path::Path;

/// What the codes of an 8- or 16-bit image mean. Images of floats are linear whatever is said here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// The sRGB transfer function (IEC 61966-2-1): colours.
    #[default]
    Srgb,
    /// Proportional to the value: roughness, metalness, masks, Mitsuba's `raw`.
    Linear,
}

/// Extensions that [`read_image`] knows.
const EXTENSIONS: &str = "png, jpg, jpeg, hdr, exr";

/// Reads an image by its file name's extension: `png`, `jpg`, `jpeg`, `hdr` or `exr`. Alpha is dropped without
/// multiplying; grey becomes RGB. Eight bits a channel stay eight bits in memory.
///
/// # Errors
///
/// The extension is unknown, or the file cannot be read or decoded, or has a value that is not finite.
pub fn read_image(path: impl AsRef<Path>, encoding: Encoding) -> Result<Image, ImportError> {
    let path = path.as_ref();
    let format = format_of(path)?;
    decode(&read_file(path)?, format, encoding, path)
}

/// Decodes an image that is already in memory; `path` gives the format by its extension and is otherwise for messages.
///
/// # Errors
///
/// As [`read_image`], less those of reading.
pub fn parse_image(bytes: &[u8], path: impl AsRef<Path>, encoding: Encoding) -> Result<Image, ImportError> {
    let path = path.as_ref();
    decode(bytes, format_of(path)?, encoding, path)
}

fn format_of(path: &Path) -> Result<ImageFormat, ImportError> {
    match extension(path).as_str() {
        "exr" => Ok(ImageFormat::OpenExr),
        "png" => Ok(ImageFormat::Png),
        "jpg" | "jpeg" => Ok(ImageFormat::Jpeg),
        "hdr" => Ok(ImageFormat::Hdr),
        _ => Err(ImportError::UnknownFormat {
            path: path.to_path_buf(),
            expected: EXTENSIONS,
        }),
    }
}

/// Extension in lower case, empty if there is none.
pub(crate) fn extension(path: &Path) -> String {
    path.extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase()
}

/// Decodes PNG or JPEG bytes, whichever they are.
pub(crate) fn decode_guessed(bytes: &[u8], encoding: Encoding, path: &Path) -> Result<Image, ImportError> {
    let format = image::guess_format(bytes).map_err(|source| broken(path, source))?;
    decode(bytes, format, encoding, path)
}

fn decode(bytes: &[u8], format: ImageFormat, encoding: Encoding, path: &Path) -> Result<Image, ImportError> {
    if format == ImageFormat::OpenExr {
        return decode_exr(bytes, path);
    }
    let broken = |source: image::ImageError| broken(path, source);
    let reader = ImageReader::with_format(Cursor::new(bytes), format);
    let decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    check_size(width as usize, height as usize, bytes, path)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(broken)?;
    from_dynamic(decoded, encoding).ok_or_else(|| unusable(path))
}

/// Most pixels that a byte of a file can stand for: eight to a byte before a compression of 1032 : 1 (deflate's best).
const PIXELS_PER_BYTE: usize = 8 * 1032;

/// Refuses sizes that no file of this length can hold, before memory is taken for them.
fn check_size(width: usize, height: usize, bytes: &[u8], path: &Path) -> Result<(), ImportError> {
    match width.checked_mul(height) {
        Some(pixels) if pixels <= bytes.len().saturating_mul(PIXELS_PER_BYTE) => Ok(()),
        _ => Err(ImportError::malformed(
            Location::file(path),
            format!("{width} × {height} pixels in {} bytes", bytes.len()),
        )),
    }
}

fn unusable(path: &Path) -> ImportError {
    ImportError::malformed(
        Location::file(path),
        "the image is empty or has a value that is not finite",
    )
}

fn from_dynamic(decoded: DynamicImage, encoding: Encoding) -> Option<Image> {
    let (width, height) = (decoded.width(), decoded.height());
    match decoded {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            let pixels = decoded.into_rgb32f().pixels().map(|p| p.0).collect();
            Image::from_linear(width, height, pixels)
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let linear = |code: u16| {
                let value = f32::from(code) / 65535.0;
                match encoding {
                    Encoding::Linear => value,
                    Encoding::Srgb if value <= 0.04045 => value / 12.92,
                    Encoding::Srgb => ((value + 0.055) / 1.055).powf(2.4),
                }
            };
            let pixels = decoded.into_rgb16().pixels().map(|p| p.0.map(linear)).collect();
            Image::from_linear(width, height, pixels)
        }
        _ => {
            let codes = decoded.into_rgb8().pixels().map(|p| p.0).collect();
            match encoding {
                Encoding::Srgb => Image::from_srgb8(width, height, codes),
                Encoding::Linear => Image::from_linear8(width, height, codes),
            }
        }
    }
}

fn broken(path: &Path, source: impl std::error::Error + Send + Sync + 'static) -> ImportError {
    ImportError::Decode {
        path: path.to_path_buf(),
        source: Box::new(source),
    }
}

/// The first layer of an OpenEXR file with channels R, G, B, or with Y alone.
fn decode_exr(bytes: &[u8], path: &Path) -> Result<Image, ImportError> {
    use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
    let broken = |source: exr::error::Error| broken(path, source);
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken)?;
    for header in &meta.headers {
        check_size(header.layer_size.width(), header.layer_size.height(), bytes, path)?;
    }
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken)?;
    let layer = &file.layer_data;
    let find = |name: &str| {
        let mut list = layer.channel_data.list.iter();
        list.find(|channel| channel.name.to_string().eq_ignore_ascii_case(name))
    };
    let rgb = ["R", "G", "B"].map(find);
    let channels = match (rgb, find("Y")) {
        ([Some(r), Some(g), Some(b)], _) => [r, g, b],
        (_, Some(y)) => [y, y, y],
        _ => {
            return Err(ImportError::unsupported(
                Location::file(path),
                "the image has neither channels R, G, B nor Y",
            ));
        }
    };
    let value = |samples: &FlatSamples, index: usize| -> Option<f32> {
        match samples {
            FlatSamples::F16(v) => v.get(index).map(|h| h.to_f32()),
            FlatSamples::F32(v) => v.get(index).copied(),
            FlatSamples::U32(v) => v.get(index).map(|&u| u as f32),
        }
    };
    let (width, height) = (layer.size.width(), layer.size.height());
    let pixel = |index| -> Option<[f32; 3]> {
        let [r, g, b] = channels.map(|channel| value(&channel.sample_data, index));
        Some([r?, g?, b?])
    };
    let pixels: Option<Vec<_>> = (0..width * height).map(pixel).collect();
    let size = (u32::try_from(width), u32::try_from(height));
    match (size, pixels) {
        ((Ok(width), Ok(height)), Some(pixels)) => {
            Image::from_linear(width, height, pixels).ok_or_else(|| unusable(path))
        }
        _ => Err(unusable(path)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Memory for the pixels is asked for only where the file could hold them.
    #[test]
    fn sizes_that_no_file_of_this_length_can_hold_are_refused() {
        let size =
            |width, height, length: usize| check_size(width, height, &vec![0; length], Path::new("a.png"));
        assert!(size(PIXELS_PER_BYTE, 100, 100).is_ok());
        let error = size(PIXELS_PER_BYTE, 101, 100).expect_err("one row too many");
        assert!(error.to_string().contains("101 pixels in 100 bytes"), "{error}");
        assert!(size(usize::MAX, 2, 100).is_err());
    }
}
