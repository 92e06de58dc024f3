//! JPEG.

use super::{Encoding, broken, check_size, from_codes, unusable};
use crate::Image;
use crate::import::error::ImportError;
use crate::import::loading::Loading;
use std::path::Path;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Decodes a JPEG file. What is neither grey nor RGB becomes RGB.
pub(super) fn decode(
    bytes: &[u8],
    encoding: Encoding,
    path: &Path,
    loading: &Loading,
) -> Result<Image, ImportError> {
    let broken = |source: DecodeErrors| broken(path, source);
    let options = DecoderOptions::default()
        .set_strict_mode(false)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(broken)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| unusable(path))?;
    check_size(width, height, bytes, path)?;
    // Coefficients of up to four components in words and the decoded codes, then the image's.
    loading.spend_image([width, height], 8 + 3, 3, path)?;
    let space = match decoder.input_colorspace() {
        Some(grey @ (ColorSpace::Luma | ColorSpace::LumaA)) => grey,
        _ => ColorSpace::RGB,
    };
    let options = options.jpeg_set_out_colorspace(space);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let codes = decoder.decode().map_err(broken)?;
    let size = (u32::try_from(width), u32::try_from(height));
    match size {
        (Ok(width), Ok(height)) => from_codes((width, height), space.num_components(), &codes, encoding),
        _ => None,
    }
    .ok_or_else(|| unusable(path))
}
