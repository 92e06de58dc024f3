//! Linear RGB images.

use std::fmt;

/// Most pixels an image or film may have, `2^27`: a bound that turns a mistyped size into an error
/// rather than into an exhausted machine.
pub const MAX_PIXELS: usize = 1 << 27;

/// An image of finite linear RGB values (Rec. 709 primaries), row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbImage {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

/// Why an [`RgbImage`] or a [`Film`](crate::Film) could not be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ImageError {
    /// A side is zero.
    Empty {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// More than [`MAX_PIXELS`] pixels, or more than memory holds.
    TooLarge {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The number of pixels is not `width · height`.
    PixelCount {
        /// Pixels given.
        found: usize,
        /// Pixels needed.
        expected: usize,
    },
    /// A pixel has a NaN or infinite channel.
    NonFinite {
        /// Column of the first such pixel.
        x: u32,
        /// Row of the first such pixel.
        y: u32,
    },
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { width, height } => write!(f, "an image of {width}x{height} pixels has no pixels"),
            Self::TooLarge { width, height } => write!(f, "an image of {width}x{height} pixels is too large"),
            Self::PixelCount { found, expected } => {
                write!(f, "{found} pixels given where {expected} are needed")
            }
            Self::NonFinite { x, y } => write!(f, "pixel ({x}, {y}) is not finite"),
        }
    }
}

impl std::error::Error for ImageError {}

/// `width · height`, or why no image can have that size.
pub(crate) fn pixel_count(width: u32, height: u32) -> Result<usize, ImageError> {
    if width == 0 || height == 0 {
        return Err(ImageError::Empty { width, height });
    }
    (width as usize)
        .checked_mul(height as usize)
        .filter(|&count| count <= MAX_PIXELS)
        .ok_or(ImageError::TooLarge { width, height })
}

impl RgbImage {
    /// An image from its pixels, row by row from the top.
    ///
    /// # Errors
    ///
    /// A zero side, more than [`MAX_PIXELS`] pixels, a count other than `width · height`, or a
    /// pixel that is not finite.
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self, ImageError> {
        let expected = pixel_count(width, height)?;
        if pixels.len() != expected {
            let found = pixels.len();
            return Err(ImageError::PixelCount { found, expected });
        }
        if let Some(index) = pixels
            .iter()
            .position(|pixel| !pixel.iter().all(|v| v.is_finite()))
        {
            let (x, y) = ((index % width as usize) as u32, (index / width as usize) as u32);
            return Err(ImageError::NonFinite { x, y });
        }
        Ok(Self {
            width,
            height,
            pixels,
        })
    }

    /// An image whose pixel in column `x` of row `y` is `f(x, y)`.
    ///
    /// # Errors
    ///
    /// As [`RgbImage::new`].
    pub fn from_fn(
        width: u32,
        height: u32,
        mut f: impl FnMut(u32, u32) -> [f32; 3],
    ) -> Result<Self, ImageError> {
        let count = pixel_count(width, height)?;
        let mut pixels = Vec::with_capacity(count);
        for y in 0..height {
            pixels.extend((0..width).map(|x| f(x, y)));
        }
        Self::new(width, height, pixels)
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

    /// Pixels row by row from the top.
    #[inline]
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// The pixel in column `x` of row `y`; `None` outside the image.
    #[inline]
    pub fn get(&self, x: u32, y: u32) -> Option<[f32; 3]> {
        let inside = x < self.width && y < self.height;
        inside.then(|| self.pixels[y as usize * self.width as usize + x as usize])
    }

    /// Mean of each channel over all pixels, summed in `f64`.
    pub fn mean(&self) -> [f64; 3] {
        let count = self.pixels.len() as f64;
        std::array::from_fn(|c| self.pixels.iter().map(|pixel| f64::from(pixel[c])).sum::<f64>() / count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_counts_and_values_are_checked() {
        let empty = ImageError::Empty { width: 0, height: 3 };
        assert_eq!(RgbImage::new(0, 3, Vec::new()), Err(empty));
        let large = ImageError::TooLarge {
            width: u32::MAX,
            height: u32::MAX,
        };
        assert_eq!(RgbImage::new(u32::MAX, u32::MAX, Vec::new()), Err(large));
        let count = ImageError::PixelCount {
            found: 5,
            expected: 6,
        };
        assert_eq!(RgbImage::new(2, 3, vec![[0.0; 3]; 5]), Err(count));
        for bad in [f32::NAN, f32::INFINITY] {
            let made = RgbImage::from_fn(3, 2, |x, y| {
                if (x, y) == (1, 1) {
                    [0.0, 0.0, bad]
                } else {
                    [1.0; 3]
                }
            });
            assert_eq!(made, Err(ImageError::NonFinite { x: 1, y: 1 }));
        }
    }

    #[test]
    fn pixels_are_found_by_column_and_row() {
        let image = RgbImage::from_fn(3, 2, |x, y| [x as f32, y as f32, 0.5]).unwrap();
        assert_eq!(image.get(2, 1), Some([2.0, 1.0, 0.5]));
        assert_eq!((image.get(3, 0), image.get(0, 2)), (None, None));
        assert_eq!(image.mean(), [1.0, 0.5, 0.5]);
    }
}
