//! Radiance HDR: `RGBE` pixels, as they are or run-length encoded (Ward, *Real Pixels*, Graphics
//! Gems II, 1991).

use super::{check_size, unusable};
use crate::Image;
use crate::import::error::{ImportError, Location};
use crate::import::loading::Loading;
use std::path::Path;

/// Mantissas of red, green and blue and their common exponent.
type Rgbe = [u8; 4];

/// Decodes a Radiance HDR file whose rows run from top to bottom and whose columns run from left to
/// right. Exposure and colour correction of the header are not applied.
pub(super) fn decode(bytes: &[u8], path: &Path, loading: &Loading) -> Result<Image, ImportError> {
    let mut reader = Reader { bytes, at: 0 };
    let wrong = |at: usize, what: String| ImportError::malformed(Location::byte(path, at as u64), what);
    let (width, height) = match reader.header() {
        Ok(size) => size,
        Err(Refused::Malformed(what)) => return Err(wrong(reader.at, what)),
        Err(Refused::Unsupported(what)) => {
            let location = Location::byte(path, reader.at as u64);
            return Err(ImportError::unsupported(location, what));
        }
    };
    check_size(width as usize, height as usize, bytes, path)?;
    loading.spend_image([width as usize, height as usize], 0, 12, path)?;
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    let mut row = vec![[0; 4]; width as usize];
    if width > 0 {
        for _ in 0..height {
            let outcome = reader.row(&mut row);
            outcome.map_err(|what| wrong(reader.at, what.to_owned()))?;
            pixels.extend(row.iter().copied().map(linear));
        }
    }
    Image::from_linear(width, height, pixels).ok_or_else(|| unusable(path))
}

/// `mantissa · 2^(exponent − 136)`; exponent 0 is black.
fn linear([r, g, b, exponent]: Rgbe) -> [f32; 3] {
    // 2^(e − 128), subnormal for e = 1, then 2^−8.
    let bits = match exponent {
        0 => 0,
        1 => 1 << 22,
        e => u32::from(e - 1) << 23,
    };
    let scale = f32::from_bits(bits) * (1.0 / 256.0);
    [r, g, b].map(|mantissa| scale * f32::from(mantissa))
}

/// Why a header is refused.
enum Refused {
    Malformed(String),
    Unsupported(String),
}

const CUT_SHORT: &str = "the file ends in the middle of the image";
const TOO_LONG: &str = "a run reaches beyond its row";

/// Bytes and the place reached in them.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    /// A line without its end, `None` at the end of the file.
    fn line(&mut self) -> Option<String> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&b| b == b'\n');
        self.at += length.map_or(rest.len(), |length| length + 1);
        let line = &rest[..length.unwrap_or(rest.len())];
        Some(String::from_utf8_lossy(line).trim_end_matches('\r').to_owned())
    }

    /// Width and height.
    fn header(&mut self) -> Result<(u32, u32), Refused> {
        let malformed = |what: &str| Refused::Malformed(what.to_owned());
        let ends = || malformed("the file ends in its header");
        let first = self.line().ok_or_else(ends)?;
        if !first.starts_with("#?RADIANCE") && !first.starts_with("#?RGBE") {
            return Err(malformed("the file does not start with `#?RADIANCE`"));
        }
        loop {
            let line = self.line().ok_or_else(ends)?;
            if line.is_empty() {
                break;
            }
            match line.split_once('=') {
                Some((key, format)) if key.trim() == "FORMAT" && format.trim() != "32-bit_rle_rgbe" => {
                    return Err(Refused::Unsupported(format!(
                        "the format `{}` is not supported, only 32-bit_rle_rgbe",
                        format.trim()
                    )));
                }
                _ => {}
            }
        }
        let line = self.line().ok_or_else(ends)?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let [first, height, second, width] = words[..] else {
            return Err(malformed("expected `-Y height +X width`"));
        };
        if (first, second) != ("-Y", "+X") {
            return Err(Refused::Unsupported(format!(
                "the orientation `{first} {second}` is not supported, only `-Y +X`"
            )));
        }
        match (width.parse(), height.parse()) {
            (Ok(width), Ok(height)) => Ok((width, height)),
            _ => Err(malformed("expected `-Y height +X width`")),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], &'static str> {
        let chunk = self.bytes.get(self.at..).and_then(|rest| rest.first_chunk());
        let chunk = chunk.ok_or(CUT_SHORT)?;
        self.at += N;
        Ok(*chunk)
    }

    /// One row, which has at least one pixel.
    fn row(&mut self, row: &mut [Rgbe]) -> Result<(), &'static str> {
        let first: Rgbe = self.take()?;
        if let [2, 2, 0..128, _] = first {
            for channel in 0..4 {
                self.channel(row, channel)?;
            }
            return Ok(());
        }
        self.old_row(first, row)
    }

    /// One channel of a row as runs: a count up to 128 of values that follow, or 128 and a count of
    /// repetitions of one value.
    fn channel(&mut self, row: &mut [Rgbe], channel: usize) -> Result<(), &'static str> {
        let mut done = 0;
        while done < row.len() {
            let [code] = self.take()?;
            let (count, run) = match code {
                0..=128 => (usize::from(code), None),
                _ => (usize::from(code - 128), Some(self.take::<1>()?[0])),
            };
            let pixels = row.get_mut(done..done + count).ok_or(TOO_LONG)?;
            for pixel in pixels {
                pixel[channel] = match run {
                    Some(value) => value,
                    None => self.take::<1>()?[0],
                };
            }
            done += count;
        }
        Ok(())
    }

    /// Pixels as they are, where (1, 1, 1, n) repeats the last one; each repetition that follows
    /// another counts 256 times as much.
    fn old_row(&mut self, first: Rgbe, row: &mut [Rgbe]) -> Result<(), &'static str> {
        if let [1, 1, 1, _] = first {
            return Err("a row starts with a repetition");
        }
        row[0] = first;
        let (mut last, mut done, mut factor) = (first, 1, 1_usize);
        while done < row.len() {
            let pixel: Rgbe = self.take()?;
            if let [1, 1, 1, count] = pixel {
                let count = usize::from(count).checked_mul(factor).ok_or(TOO_LONG)?;
                let end = done.checked_add(count).ok_or(TOO_LONG)?;
                row.get_mut(done..end).ok_or(TOO_LONG)?.fill(last);
                done = end;
                factor = factor.saturating_mul(256);
            } else {
                row[done] = pixel;
                (last, done, factor) = (pixel, done + 1, 1);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(body: &[u8], width: u32) -> Result<Vec<[f32; 3]>, ImportError> {
        let mut bytes = format!("#?RADIANCE\nEXPOSURE=2\n\n-Y 1 +X {width}\n").into_bytes();
        bytes.extend(body);
        let image = decode(&bytes, Path::new("a.hdr"), &Loading::of_file())?;
        Ok((0..width).map(|x| image.texel(x, 0).to_array()).collect())
    }

    #[test]
    fn mantissas_and_exponents_are_exact() {
        let of = |pixel: Rgbe| pixels(&pixel, 1).unwrap()[0];
        assert_eq!(of([128, 64, 1, 129]), [1.0, 0.5, 1.0 / 128.0]);
        assert_eq!(of([255, 255, 255, 0]), [0.0; 3]);
        assert_eq!(of([1, 2, 128, 1]), [-135.0, -134.0, -128.0].map(f32::exp2));
        assert_eq!(
            of([255, 0, 255, 255]),
            [255.0 * 119.0_f32.exp2(), 0.0, 255.0 * 119.0_f32.exp2()]
        );
    }

    #[test]
    fn runs_repeat_pixels_and_keep_within_their_row() {
        let (a, b) = ([128, 0, 0, 129], [0, 128, 0, 129]);
        let row = |pixels: &[Rgbe]| pixels.concat();
        let old = pixels(&row(&[a, [1, 1, 1, 2], b]), 4).unwrap();
        let (red, green) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert_eq!(old, [red, red, red, green]);
        // Two repetitions in a row: 1 + 256 · 1.
        let long = pixels(&row(&[a, [1, 1, 1, 1], [1, 1, 1, 1], b]), 259).unwrap();
        assert_eq!((long[257], long[258]), (red, green));

        let new = [2, 2, 0, 3, 2, 128, 0, 129, 0, 130, 0, 1, 128, 131, 0, 131, 129];
        assert_eq!(pixels(&new, 3).unwrap(), [red, [0.0; 3], green]);

        for (body, width) in [
            (row(&[a, [1, 1, 1, 3]]), 3),
            (row(&[[1, 1, 1, 1], a]), 2),
            (row(&[a]), 2),
            (vec![2, 2, 0, 3, 132, 128], 3),
            (vec![2, 2, 0, 3, 4, 1, 2, 3, 4], 3),
        ] {
            assert!(pixels(&body, width).is_err(), "{body:?}");
        }
    }
}
