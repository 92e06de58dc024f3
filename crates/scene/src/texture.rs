//! Textures: constants, images and checkerboards over texture coordinates.

use crate::Rgb;
use glam::Affine2;
use std::sync::Arc;

/// Filtering between texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Bilinear between the four nearest texel centres.
    #[default]
    Bilinear,
    /// The nearest texel.
    Nearest,
}

/// What lies outside the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats mirrored.
    Mirror,
    /// The edge goes on.
    Clamp,
}

/// One channel of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Red.
    Red,
    /// Green.
    Green,
    /// Blue.
    Blue,
    /// Luminance of the colour.
    Luminance,
}

/// Linear RGB pixels, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// An image from linear pixels, row by row from the top. `None` if a side is zero, the count of pixels is not
    /// `width · height` or a value is not finite.
    pub fn from_linear(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Option<Self> {
        let count = (width as usize).checked_mul(height as usize)?;
        let sound = count > 0 && pixels.len() == count && pixels.iter().flatten().all(|v| v.is_finite());
        sound.then_some(Self {
            width,
            height,
            pixels,
        })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Pixels row by row from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }
}

/// An image over texture coordinates.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    /// Texels.
    pub image: Arc<Image>,
    /// Applied to texture coordinates before the look-up.
    pub to_uv: Affine2,
    /// Filtering.
    pub filter: Filter,
    /// Outside the unit square.
    pub wrap: Wrap,
    /// Multiplies the texel.
    pub scale: Rgb,
}

/// Mitsuba's checkerboard: `color0` where both or neither of the fractional coordinates is above one half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkerboard {
    /// Colour of the squares at the origin.
    pub color0: Rgb,
    /// Colour of the others.
    pub color1: Rgb,
    /// Applied to texture coordinates before the look-up.
    pub to_uv: Affine2,
}

/// A colour that may vary over texture coordinates.
#[derive(Clone, Debug)]
pub enum ColorTexture {
    /// The same everywhere.
    Constant(Rgb),
    /// An image.
    Image(ImageTexture),
    /// A checkerboard.
    Checkerboard(Checkerboard),
}

/// A number that may vary over texture coordinates.
#[derive(Clone, Debug)]
pub enum FloatTexture {
    /// The same everywhere.
    Constant(f32),
    /// One channel of an image.
    Image(ImageTexture, Channel),
}
