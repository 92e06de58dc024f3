//! Pixels in memory: linear `f32`, or eight bits a channel decoded on the fly.

use crate::Rgb;
use crate::fingerprint::Fingerprint;
use lightshed_lanes::use_huge_pages;
use std::fmt;
use std::sync::LazyLock;

/// `[s/255]` decoded by the sRGB transfer function (IEC 61966-2-1).
static SRGB_TO_LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let s = code as f64 / 255.0;
        let linear = if s <= 0.04045 {
            s / 12.92
        } else {
            ((s + 0.055) / 1.055).powf(2.4)
        };
        linear as f32
    })
});

/// `s/255`.
static UNIT_TO_LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| (code as f64 / 255.0) as f32));

/// How texels lie in memory.
#[derive(Clone, Debug, PartialEq)]
enum Texels {
    /// Linear values, 12 bytes a texel.
    Linear(Vec<[f32; 3]>),
    /// Codes into a table of linear values, 3 bytes a texel.
    Coded {
        codes: Vec<[u8; 3]>,
        table: &'static [f32; 256],
    },
}

/// An RGB image, row 0 at the top. Texels are read as linear RGB whatever they are stored as.
#[derive(Clone, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    texels: Texels,
    mean: Rgb,
}

/// Shows the size and a fingerprint of the texels, of which there may be millions.
impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut sum = Fingerprint::new();
        let (words, table) = self.words();
        sum.words(words.into_iter());
        sum.reals(
            table
                .into_iter()
                .flatten()
                .map(|&value| [value])
                .collect::<Vec<_>>()
                .into_iter(),
        );
        let Self { width, height, .. } = self;
        write!(f, "Image {width}x{height} {:016x}", sum.value())
    }
}

impl Image {
    /// An image from linear pixels, row by row from the top. `None` if a side is zero, the count of
    /// pixels is not `width · height` or a value is not finite.
    pub fn from_linear(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Option<Self> {
        let finite = pixels.iter().flatten().all(|v| v.is_finite());
        if finite {
            Self::new(width, height, pixels.len(), Texels::Linear(pixels))
        } else {
            None
        }
    }

    /// An image from sRGB-encoded bytes, row by row from the top; it keeps them as they are (a
    /// quarter of the memory of `f32`) and decodes through a table. `None` if a side is zero or the
    /// count of pixels is not `width · height`.
    pub fn from_srgb8(width: u32, height: u32, codes: Vec<[u8; 3]>) -> Option<Self> {
        let table = &*SRGB_TO_LINEAR;
        Self::new(width, height, codes.len(), Texels::Coded { codes, table })
    }

    /// An image from bytes that hold linear values `v/255` (roughness, metalness, masks), row by
    /// row from the top, kept as they are. `None` if a side is zero or the count of pixels is not
    /// `width · height`.
    pub fn from_linear8(width: u32, height: u32, codes: Vec<[u8; 3]>) -> Option<Self> {
        let table = &*UNIT_TO_LINEAR;
        Self::new(width, height, codes.len(), Texels::Coded { codes, table })
    }

    fn new(width: u32, height: u32, count: usize, texels: Texels) -> Option<Self> {
        let expected = (width as usize).checked_mul(height as usize)?;
        if expected == 0 || count != expected {
            return None;
        }
        match &texels {
            Texels::Linear(pixels) => use_huge_pages(pixels),
            Texels::Coded { codes, .. } => use_huge_pages(codes),
        };
        let mut image = Self {
            width,
            height,
            texels,
            mean: Rgb::ZERO,
        };
        let sum = image
            .texels()
            .fold(glam::DVec3::ZERO, |sum, texel| sum + texel.as_dvec3());
        image.mean = (sum / count as f64).as_vec3();
        Some(image)
    }

    /// Width in pixels.
    #[inline]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[inline]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Linear RGB of the texel in column `x` of row `y`, both clamped to the image.
    #[inline]
    pub fn texel(&self, x: u32, y: u32) -> Rgb {
        let index = y.min(self.height - 1) as usize * self.width as usize + x.min(self.width - 1) as usize;
        self.at_index(index)
    }

    #[inline(always)]
    fn at_index(&self, index: usize) -> Rgb {
        match &self.texels {
            Texels::Linear(pixels) => Rgb::from_array(pixels[index]),
            Texels::Coded { codes, table } => {
                let [r, g, b] = codes[index];
                Rgb::new(table[r as usize], table[g as usize], table[b as usize])
            }
        }
    }

    /// The texel in column `x` of row `y`, both within the image, and the one right of it, columns
    /// wrapping around: three numbers each, and two more of no meaning. They lie in the image or,
    /// copied, in `spare`.
    #[inline(always)]
    pub(crate) fn pair<'a>(&'a self, x: u32, y: u32, spare: &'a mut [f32; 8]) -> &'a [f32; 8] {
        let row = y as usize * self.width as usize;
        if let Texels::Linear(pixels) = &self.texels
            && x + 1 < self.width
            && let Some(numbers) = pixels.as_flattened().get(3 * (row + x as usize)..)
            && let Some(numbers) = numbers.first_chunk()
        {
            return numbers;
        }
        let right = if x + 1 < self.width { x + 1 } else { 0 };
        let (a, b) = (
            self.at_index(row + x as usize),
            self.at_index(row + right as usize),
        );
        *spare = [a.x, a.y, a.z, b.x, b.y, b.z, 0.0, 0.0];
        spare
    }

    /// Prefetches the texel that [`Image::texel`] reads.
    #[inline(always)]
    pub(crate) fn prefetch(&self, x: u32, y: u32) {
        let index = y.min(self.height - 1) as usize * self.width as usize + x.min(self.width - 1) as usize;
        match &self.texels {
            Texels::Linear(pixels) => lightshed_lanes::prefetch(&pixels[index]),
            Texels::Coded { codes, .. } => lightshed_lanes::prefetch(&codes[index]),
        }
    }

    /// Linear RGB of every texel, row by row from the top.
    pub fn texels(&self) -> impl ExactSizeIterator<Item = Rgb> + '_ {
        let count = self.width as usize * self.height as usize;
        (0..count).map(|index| self.at_index(index))
    }

    /// Mean linear RGB over the texels (summed in `f64`).
    #[inline]
    pub fn mean(&self) -> Rgb {
        self.mean
    }

    /// The texels as words, row by row: codes of eight bits a channel, red in the lowest, with the
    /// table that they lead into; or the bits of three numbers each.
    pub(crate) fn words(&self) -> (Vec<u32>, Option<&'static [f32; 256]>) {
        match &self.texels {
            Texels::Linear(pixels) => (pixels.iter().flatten().map(|v| v.to_bits()).collect(), None),
            Texels::Coded { codes, table } => {
                let word = |&[r, g, b]: &[u8; 3]| u32::from_le_bytes([r, g, b, 0]);
                (codes.iter().map(word).collect(), Some(*table))
            }
        }
    }

    /// Bytes that the texels take.
    pub fn texel_bytes(&self) -> usize {
        match &self.texels {
            Texels::Linear(pixels) => std::mem::size_of_val(pixels.as_slice()),
            Texels::Coded { codes, .. } => std::mem::size_of_val(codes.as_slice()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_wrong_sizes_and_values() {
        assert!(Image::from_linear(0, 4, vec![]).is_none());
        assert!(Image::from_linear(2, 2, vec![[0.0; 3]; 3]).is_none());
        assert!(Image::from_linear(1, 1, vec![[f32::NAN, 0.0, 0.0]]).is_none());
        assert!(Image::from_srgb8(u32::MAX, u32::MAX, vec![[0; 3]; 3]).is_none());
        assert!(Image::from_srgb8(3, 1, vec![[0; 3]; 3]).is_some());
    }

    #[test]
    fn bytes_decode_by_their_transfer_function() {
        let srgb = Image::from_srgb8(2, 1, vec![[0, 255, 188], [10, 11, 128]]).unwrap();
        // IEC 61966-2-1: code 188 is (188/255 + 0.055)/1.055 to the 2.4th, code 10 is on the linear
        // foot.
        assert!(
            (srgb.texel(0, 0) - Rgb::new(0.0, 1.0, 0.502_886_5))
                .abs()
                .max_element()
                < 1e-6
        );
        assert!(
            (srgb.texel(1, 0) - Rgb::new(0.003_035_27, 0.003_346_536, 0.215_860_53))
                .abs()
                .max_element()
                < 1e-7
        );
        let linear = Image::from_linear8(1, 1, vec![[0, 51, 255]]).unwrap();
        assert_eq!(linear.texel(0, 0), Rgb::new(0.0, 0.2, 1.0));
        assert_eq!(srgb.texel_bytes(), 6);
    }

    #[test]
    fn mean_is_of_linear_values() {
        let image = Image::from_srgb8(2, 1, vec![[0; 3], [255; 3]]).unwrap();
        assert!((image.mean() - Rgb::splat(0.5)).abs().max_element() < 1e-7);
        assert_eq!(image.texels().len(), 2);
    }
}
