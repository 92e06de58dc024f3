//! Images from files: PNG, JPEG, BMP, Radiance HDR and OpenEXR.

mod bmp;
mod jpeg;
mod openexr;
mod png;
mod radiance;
#[cfg(feature = "gltf")]
mod webp;

use super::error::{ImportError, Location, extension};
use super::loading::Loading;
use crate::Image;
use std::path::Path;

/// What the codes of an 8- or 16-bit image mean. Images of floats are linear whatever is said here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// The sRGB transfer function (IEC 61966-2-1): colours.
    #[default]
    Srgb,
    /// Proportional to the value: roughness, metalness, masks, Mitsuba's `raw`.
    Linear,
    /// The alpha channel alone, as grey; white where there is none.
    Alpha,
}

/// Extensions that [`read_image`] knows.
const EXTENSIONS: &str = "png, jpg, jpeg, bmp, hdr, exr";

/// Reads an image by its file name's extension: `png`, `jpg`, `jpeg`, `bmp`, `hdr` or `exr`. Alpha
/// is dropped without multiplying; grey becomes RGB. Eight bits a channel stay eight bits in
/// memory.
///
/// # Errors
///
/// The extension is unknown, or the file cannot be read or decoded, or has a value that is not
/// finite.
pub fn read_image(path: impl AsRef<Path>, encoding: Encoding) -> Result<Image, ImportError> {
    read_within(path.as_ref(), encoding, &Loading::of_file())
}

/// Reads an image within the budget of a loading.
pub(super) fn read_within(path: &Path, encoding: Encoding, loading: &Loading) -> Result<Image, ImportError> {
    let format = format_of(path)?;
    decode(&loading.read(path)?, format, encoding, path, loading)
}

/// Decodes an image that is already in memory; `path` gives the format by its extension and is
/// otherwise for messages.
///
/// # Errors
///
/// As [`read_image`], less those of reading.
pub fn parse_image(bytes: &[u8], path: impl AsRef<Path>, encoding: Encoding) -> Result<Image, ImportError> {
    let path = path.as_ref();
    decode(bytes, format_of(path)?, encoding, path, &Loading::of_file())
}

/// A format that is decoded here.
#[derive(Clone, Copy)]
enum Format {
    Png,
    Jpeg,
    Bmp,
    Radiance,
    OpenExr,
}

fn format_of(path: &Path) -> Result<Format, ImportError> {
    match extension(path).as_str() {
        "exr" => Ok(Format::OpenExr),
        "png" => Ok(Format::Png),
        "jpg" | "jpeg" => Ok(Format::Jpeg),
        "bmp" => Ok(Format::Bmp),
        "hdr" => Ok(Format::Radiance),
        _ => Err(ImportError::UnknownFormat {
            path: path.to_path_buf(),
            expected: EXTENSIONS,
        }),
    }
}

/// Decodes PNG, JPEG or WebP bytes, whichever they are.
#[cfg(feature = "gltf")]
pub(crate) fn decode_guessed(
    bytes: &[u8],
    encoding: Encoding,
    path: &Path,
    loading: &Loading,
) -> Result<Image, ImportError> {
    let format = if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Format::Png
    } else if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
        Format::Jpeg
    } else if webp::is_one(bytes) {
        return webp::decode(bytes, encoding, path, loading);
    } else {
        return Err(ImportError::malformed(
            Location::file(path),
            "the image is neither PNG nor JPEG nor WebP",
        ));
    };
    decode(bytes, format, encoding, path, loading)
}

fn decode(
    bytes: &[u8],
    format: Format,
    encoding: Encoding,
    path: &Path,
    loading: &Loading,
) -> Result<Image, ImportError> {
    match format {
        Format::Png => png::decode(bytes, encoding, path, loading),
        Format::Jpeg => jpeg::decode(bytes, encoding, path, loading),
        Format::Bmp => bmp::decode(bytes, encoding, path, loading),
        Format::Radiance => radiance::decode(bytes, path, loading),
        Format::OpenExr => openexr::decode(bytes, path, loading),
    }
}

/// An image of eight bits a channel: one (grey), two (grey and alpha), three or four channels
/// (colours and alpha).
fn from_codes(
    (width, height): (u32, u32),
    channels: usize,
    codes: &[u8],
    encoding: Encoding,
) -> Option<Image> {
    let rgb = |pixel: &[u8]| match *pixel {
        [.., alpha] if encoding == Encoding::Alpha => {
            [if channels.is_multiple_of(2) {
                alpha
            } else {
                u8::MAX
            }; 3]
        }
        [r, g, b, ..] => [r, g, b],
        [grey, ..] => [grey; 3],
        [] => [0; 3],
    };
    let codes = codes.chunks_exact(channels.max(1)).map(rgb).collect();
    match encoding {
        Encoding::Srgb => Image::from_srgb8(width, height, codes),
        Encoding::Linear | Encoding::Alpha => Image::from_linear8(width, height, codes),
    }
}

/// Most pixels that a byte of a file can stand for: eight to a byte before a compression of 1032 :
/// 1 (deflate's best).
const PIXELS_PER_BYTE: usize = 8 * 1032;

/// Refuses sizes that no file of this length can hold, before memory is taken for them. What they
/// cost otherwise, [`Loading::spend_image`] counts.
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

fn broken(path: &Path, source: impl std::error::Error + Send + Sync + 'static) -> ImportError {
    ImportError::Decode {
        path: path.to_path_buf(),
        source: Box::new(source),
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
