//! PNG.

use super::{Encoding, broken, check_size, from_codes, unusable};
use crate::Image;
use crate::import::error::ImportError;
use crate::import::loading::Loading;
use png::{BitDepth, Decoder, DecodingError, Transformations};
use std::io::Cursor;
use std::path::Path;

/// Decodes a PNG file. Palettes and fewer than eight bits a channel become eight bits.
pub(super) fn decode(
    bytes: &[u8],
    encoding: Encoding,
    path: &Path,
    loading: &Loading,
) -> Result<Image, ImportError> {
    let broken = |source: DecodingError| broken(path, source);
    let mut decoder = Decoder::new(Cursor::new(bytes));
    let header = decoder.read_header_info().map_err(broken)?;
    let size = (header.width, header.height);
    check_size(size.0 as usize, size.1 as usize, bytes, path)?;
    // Four channels as decoded, then three codes or three floats.
    let wide = header.bit_depth == BitDepth::Sixteen;
    let (decoded, kept) = if wide { (8, 12) } else { (4, 3) };
    loading.spend_image([size.0 as usize, size.1 as usize], decoded, kept, path)?;
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(broken)?;
    let length = reader.output_buffer_size().ok_or_else(|| unusable(path))?;
    let mut samples = vec![0; length];
    let frame = reader.next_frame(&mut samples).map_err(broken)?;
    samples.truncate(frame.buffer_size());
    let channels = frame.color_type.samples();
    let image = match frame.bit_depth {
        BitDepth::Sixteen => from_words(size, channels, &samples, encoding),
        _ => from_codes(size, channels, &samples, encoding),
    };
    image.ok_or_else(|| unusable(path))
}

/// An image of sixteen bits a channel, big-endian as PNG has them.
fn from_words(
    (width, height): (u32, u32),
    channels: usize,
    bytes: &[u8],
    encoding: Encoding,
) -> Option<Image> {
    let linear = |code: u16| {
        let value = f32::from(code) / 65535.0;
        match encoding {
            Encoding::Linear | Encoding::Alpha => value,
            Encoding::Srgb if value <= 0.04045 => value / 12.92,
            Encoding::Srgb => ((value + 0.055) / 1.055).powf(2.4),
        }
    };
    let rgb = |pixel: &[u8]| {
        let word = |channel: usize| {
            let word = pixel.get(2 * channel..).and_then(|rest| rest.first_chunk());
            linear(word.map_or(0, |&word| u16::from_be_bytes(word)))
        };
        if encoding == Encoding::Alpha {
            [if channels.is_multiple_of(2) {
                word(channels - 1)
            } else {
                1.0
            }; 3]
        } else if channels < 3 {
            [word(0); 3]
        } else {
            [word(0), word(1), word(2)]
        }
    };
    let pixels = bytes.chunks_exact((2 * channels).max(1)).map(rgb).collect();
    Image::from_linear(width, height, pixels)
}
