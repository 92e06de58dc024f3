//! Windows bitmaps without compression: palettes of eight bits, 24 and 32 bits a pixel.

use super::{Encoding, check_size, from_codes, unusable};
use crate::Image;
use crate::import::error::{ImportError, Location};
use crate::import::loading::Loading;
use std::path::Path;

/// Decodes a BMP file.
pub(super) fn decode(
    bytes: &[u8],
    encoding: Encoding,
    path: &Path,
    loading: &Loading,
) -> Result<Image, ImportError> {
    let malformed = |what: &str| ImportError::malformed(Location::file(path), what);
    let header = Header::read(bytes).ok_or_else(|| malformed("the file ends in its header"))?;
    if !(header.compression == 0 || (header.compression == 3 && header.bits == 32)) {
        return Err(ImportError::unsupported(
            Location::file(path),
            "a compressed BMP file is not supported",
        ));
    }
    let [width, height] = [header.width, header.height.unsigned_abs()].map(|side| side as usize);
    check_size(width, height, bytes, path)?;
    loading.spend_image([width, height], 3, 3, path)?;
    let bytes_per_pixel = match header.bits {
        8 | 24 | 32 => usize::from(header.bits / 8),
        bits => {
            return Err(ImportError::unsupported(
                Location::file(path),
                format!("a BMP file of {bits} bits a pixel is not supported"),
            ));
        }
    };
    // Rows are padded to four bytes, and the lowest is first unless the height is negative.
    let stride = (width * bytes_per_pixel).next_multiple_of(4);
    let mut codes = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        let row = if header.height > 0 { height - 1 - y } else { y };
        let start = row
            .checked_mul(stride)
            .and_then(|at| at.checked_add(header.pixels));
        let row = start.and_then(|start| bytes.get(start..start.checked_add(width * bytes_per_pixel)?));
        let row = row.ok_or_else(|| malformed("the file ends in the middle of its pixels"))?;
        for pixel in row.chunks_exact(bytes_per_pixel) {
            let color = match *pixel {
                [index] => bytes.get(header.palette + 4 * usize::from(index)..),
                _ => Some(pixel),
            };
            let Some([b, g, r, ..]) = color else {
                return Err(malformed("a pixel is beyond the palette"));
            };
            codes.extend([r, g, b]);
        }
    }
    from_codes((width as u32, height as u32), 3, &codes, encoding).ok_or_else(|| unusable(path))
}

/// What a header says.
struct Header {
    /// Offsets of the pixels and the palette.
    pixels: usize,
    palette: usize,
    width: u32,
    height: i32,
    bits: u16,
    compression: u32,
}

impl Header {
    fn read(bytes: &[u8]) -> Option<Self> {
        let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?)) };
        if !bytes.starts_with(b"BM") {
            return None;
        }
        Some(Self {
            pixels: word(10)? as usize,
            palette: 14 + word(14)? as usize,
            width: word(18)?,
            height: word(22)?.cast_signed(),
            bits: (word(28)? & 0xffff) as u16,
            compression: word(30)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;

    /// Two by two pixels: red, green above blue, white, each row padded to eight bytes.
    fn file(bits: u16, height: i32) -> Vec<u8> {
        let palette: [[u8; 4]; 4] = [[0, 0, 255, 0], [0, 255, 0, 0], [255, 0, 0, 0], [255; 4]];
        let mut bytes = b"BM".to_vec();
        let pixels: u32 = 54 + 16;
        bytes.extend([0_u32, 0, pixels, 40, 2].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(height.to_le_bytes());
        bytes.extend([1_u16, bits].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend([0_u32; 6].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(palette.as_flattened());
        let rows: [[u8; 2]; 2] = if height > 0 {
            [[2, 3], [0, 1]]
        } else {
            [[0, 1], [2, 3]]
        };
        for row in rows {
            let start = bytes.len();
            for index in row {
                match bits {
                    8 => bytes.push(index),
                    _ => bytes.extend(&palette[usize::from(index)][..usize::from(bits / 8)]),
                }
            }
            bytes.resize(start + (bytes.len() - start).next_multiple_of(4), 0);
        }
        bytes
    }

    #[test]
    fn every_depth_and_order_of_rows_is_the_same_image() {
        for bits in [8, 24, 32] {
            for height in [2, -2] {
                let bytes = file(bits, height);
                let image = decode(&bytes, Encoding::Linear, Path::new("a.bmp"), &Loading::of_file());
                let image = image.expect("it is sound");
                let texels: Vec<Rgb> = image.texels().collect();
                assert_eq!(texels, [Rgb::X, Rgb::Y, Rgb::Z, Rgb::ONE], "{bits} {height}");
                for cut in [3, 20, bytes.len() - 9] {
                    let cut = decode(
                        &bytes[..cut],
                        Encoding::Linear,
                        Path::new("a.bmp"),
                        &Loading::of_file(),
                    );
                    assert!(cut.is_err());
                }
            }
        }
    }
}
