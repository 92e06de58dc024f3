//! WebP, as glTF files have it.

use super::{Encoding, broken, check_size, from_codes, unusable};
use crate::Image;
use crate::import::error::ImportError;
use crate::import::loading::Loading;
use image_webp::{DecodingError, WebPDecoder};
use std::io::Cursor;
use std::path::Path;

/// Whether bytes are a WebP file.
pub(super) fn is_one(bytes: &[u8]) -> bool {
    matches!(
        bytes,
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..]
    )
}

/// Decodes a WebP file; of an animation the first image.
pub(super) fn decode(
    bytes: &[u8],
    encoding: Encoding,
    path: &Path,
    loading: &Loading,
) -> Result<Image, ImportError> {
    let broken = |source: DecodingError| broken(path, source);
    let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let size = [width as usize, height as usize];
    check_size(size[0], size[1], bytes, path)?;
    // Planes and codes of four channels as decoded, then three codes.
    loading.spend_image(size, 12, 3, path)?;
    let length = decoder.output_buffer_size().ok_or_else(|| unusable(path))?;
    let mut codes = vec![0; length];
    decoder.read_image(&mut codes).map_err(broken)?;
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    from_codes((width, height), channels, &codes, encoding).ok_or_else(|| unusable(path))
}
