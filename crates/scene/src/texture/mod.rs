//! Textures: constants, images and checkerboards over texture coordinates.
//!
//! **Orientation.** A mesh's `(u, v)` has `v` upwards: image row 0 is at `v = 1`, as in OBJ. A
//! texture first turns it into texture space `(s, t) = to_uv · (u, 1 − v)`, where row 0 is at
//! `t = 0`. Texture space is that of Mitsuba 3 (whose OBJ reader flips `v` on reading by default,
//! and whose PLY reader and analytic shapes do not) and of glTF 2.0, so a file's own transform is
//! used as it stands.
//!
//! **Texels.** Texel `i` of `W` covers `s ∈ [i/W, (i+1)/W)`; its centre is `(i + ½)/W`.

mod image;
mod place;

pub use image::Image;
pub use place::Place;

use crate::{Rgb, luminance};
use glam::{Affine2, Vec2};
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
    /// Differently along `s` and `t`.
    Mixed([AxisWrap; 2]),
}

/// What lies outside the unit interval along one axis, as [`Wrap`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AxisWrap {
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

/// An image over texture coordinates.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    /// Texels.
    pub image: Arc<Image>,
    /// Texture space from `(u, 1 − v)`: the file's own transform (Mitsuba's `to_uv`, glTF's
    /// `KHR_texture_transform`).
    pub to_uv: Affine2,
    /// Filtering.
    pub filter: Filter,
    /// Outside the unit square.
    pub wrap: Wrap,
    /// Multiplies the texel.
    pub scale: Rgb,
}

/// Mitsuba's checkerboard: `color0` where both or neither of the fractional parts of `(s, t)` is
/// above one half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkerboard {
    /// Colour of the squares at the origin.
    pub color0: Rgb,
    /// Colour of the others.
    pub color1: Rgb,
    /// Texture space from `(u, 1 − v)`.
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
    /// The colour of the mesh's vertices ([`TriangleMesh::colors`](crate::TriangleMesh::colors)),
    /// interpolated, times another texture.
    Vertex(Box<ColorTexture>),
}

/// A number that may vary over texture coordinates.
#[derive(Clone, Debug)]
pub enum FloatTexture {
    /// The same everywhere.
    Constant(f32),
    /// One channel of an image.
    Image(ImageTexture, Channel),
    /// One channel of the colour of the mesh's vertices, interpolated.
    Vertex(Channel),
}

/// Texture space `to_uv · (u, 1 − v)`; the origin where that overflows.
#[inline]
fn texture_space(to_uv: &Affine2, uv: Vec2) -> Vec2 {
    let st = to_uv.transform_point2(Vec2::new(uv.x, 1.0 - uv.y));
    if st.is_finite() { st } else { Vec2::ZERO }
}

/// `x.floor()`, up to the sign of a zero. Without instructions for it, that is the call of a
/// function, which textures would make six times a look-up.
#[inline(always)]
fn floor(x: f32) -> f32 {
    // Next to 1.5·2²³ a number has no digits behind the point.
    const SHIFT: f32 = 12_582_912.0;
    if x.abs() < 4_194_304.0 {
        let nearest = x + SHIFT - SHIFT;
        nearest - f32::from(u8::from(nearest > x))
    } else {
        x.floor()
    }
}

impl Wrap {
    /// The rules along `s` and `t`.
    #[inline(always)]
    pub fn axes(self) -> [AxisWrap; 2] {
        match self {
            Self::Repeat => [AxisWrap::Repeat; 2],
            Self::Mirror => [AxisWrap::Mirror; 2],
            Self::Clamp => [AxisWrap::Clamp; 2],
            Self::Mixed(axes) => axes,
        }
    }

    /// Of the rules along `s` and `t`.
    pub fn of_axes(axes: [AxisWrap; 2]) -> Self {
        match axes {
            [AxisWrap::Repeat, AxisWrap::Repeat] => Self::Repeat,
            [AxisWrap::Mirror, AxisWrap::Mirror] => Self::Mirror,
            [AxisWrap::Clamp, AxisWrap::Clamp] => Self::Clamp,
            _ => Self::Mixed(axes),
        }
    }
}

impl AxisWrap {
    /// A finite coordinate folded into `[0, 1]`.
    #[inline]
    fn fold(self, s: f32) -> f32 {
        match self {
            Self::Repeat => s - floor(s),
            Self::Mirror => {
                let period = s - 2.0 * floor(0.5 * s);
                if period > 1.0 { 2.0 - period } else { period }
            }
            Self::Clamp => s.clamp(0.0, 1.0),
        }
    }

    /// The two texels of `count` whose centres enclose the folded coordinate `s ∈ [0, 1]`, and
    /// the share of the second.
    #[inline]
    fn neighbours(self, s: f32, count: u32) -> (u32, u32, f32) {
        let position = s * count as f32 - 0.5;
        let below = floor(position);
        let share = position - below;
        let last = i64::from(count) - 1;
        let below = below as i64;
        // A mirrored image meets its own edge texel at the edge, so clamping is right there too.
        let wrap = |index: i64| match self {
            Self::Repeat if index < 0 => last,
            Self::Repeat if index > last => 0,
            _ => index.clamp(0, last),
        };
        (wrap(below) as u32, wrap(below + 1) as u32, share)
    }
}

impl ImageTexture {
    /// Filtered linear RGB at mesh coordinates `uv`, times the scale.
    pub fn at(&self, uv: Vec2) -> Rgb {
        let st = texture_space(&self.to_uv, uv);
        let [along_s, along_t] = self.wrap.axes();
        let (s, t) = (along_s.fold(st.x), along_t.fold(st.y));
        let image = &*self.image;
        let (width, height) = (image.width(), image.height());
        let texel = match self.filter {
            // `texel` clamps, which is what `s = 1` needs.
            Filter::Nearest => image.texel((s * width as f32) as u32, (t * height as f32) as u32),
            Filter::Bilinear => {
                let (x0, x1, share_x) = along_s.neighbours(s, width);
                let (y0, y1, share_y) = along_t.neighbours(t, height);
                let upper = image.texel(x0, y0).lerp(image.texel(x1, y0), share_x);
                let lower = image.texel(x0, y1).lerp(image.texel(x1, y1), share_x);
                upper.lerp(lower, share_y)
            }
        };
        texel * self.scale
    }

    /// Prefetches the texels that [`ImageTexture::at`] reads, but for those beyond a seam.
    #[inline]
    pub(crate) fn prefetch(&self, uv: Vec2) {
        let [x, y] = self.first_texel(uv);
        self.image.prefetch(x, y);
        self.image.prefetch(x, y + 1);
    }

    /// Column and row of the first of the texels whose centres enclose a place; the first of all
    /// beyond the first centre.
    #[inline(always)]
    fn first_texel(&self, uv: Vec2) -> [u32; 2] {
        let st = texture_space(&self.to_uv, uv);
        let [along_s, along_t] = self.wrap.axes();
        let (width, height) = (self.image.width() as f32, self.image.height() as f32);
        // Negative numbers become 0.
        [
            (along_s.fold(st.x) * width - 0.5) as u32,
            (along_t.fold(st.y) * height - 0.5) as u32,
        ]
    }

    /// Whether another texture reads the same texels everywhere.
    pub(crate) fn reads_as(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.image, &other.image) && self.to_uv == other.to_uv && self.wrap == other.wrap
    }
}

impl Checkerboard {
    /// The colour at mesh coordinates `uv`.
    pub fn at(&self, uv: Vec2) -> Rgb {
        let st = texture_space(&self.to_uv, uv);
        let above = [st.x, st.y].map(|s| s - floor(s) > 0.5);
        // By an address: squares follow one another like flips of a coin.
        *[&self.color0, &self.color1][usize::from(above[0] != above[1])]
    }
}

impl ColorTexture {
    /// The colour of one that is the same everywhere.
    #[inline]
    pub(crate) fn as_constant(&self) -> Option<Rgb> {
        match self {
            Self::Constant(color) => Some(*color),
            _ => None,
        }
    }

    /// Linear RGB at a place of a mesh, or at its coordinates alone.
    #[inline(always)]
    pub fn at(&self, place: impl Into<Place>) -> Rgb {
        let place = place.into();
        match self {
            Self::Constant(rgb) => *rgb,
            Self::Image(image) => image.at(place.uv),
            Self::Checkerboard(board) => board.at(place.uv),
            Self::Vertex(other) => other.of_vertices(place),
        }
    }

    #[inline(never)]
    fn of_vertices(&self, place: Place) -> Rgb {
        self.at(place) * place.color
    }

    /// Whether it depends on the colour of vertices.
    pub(crate) fn has_vertices(&self) -> bool {
        matches!(self, Self::Vertex(_))
    }

    /// The image, if there is one.
    pub(crate) fn image(&self) -> Option<&ImageTexture> {
        match self {
            Self::Image(image) => Some(image),
            Self::Vertex(other) => other.image(),
            Self::Constant(_) | Self::Checkerboard(_) => None,
        }
    }

    /// Mean linear RGB over the unit square of texture space, of white vertices.
    pub fn mean(&self) -> Rgb {
        match self {
            Self::Constant(rgb) => *rgb,
            Self::Image(texture) => texture.image.mean() * texture.scale,
            Self::Checkerboard(board) => 0.5 * (board.color0 + board.color1),
            Self::Vertex(other) => other.mean(),
        }
    }
}

impl Channel {
    /// The channel's value of a colour.
    #[inline]
    pub fn of(self, rgb: Rgb) -> f32 {
        match self {
            Self::Red => rgb.x,
            Self::Green => rgb.y,
            Self::Blue => rgb.z,
            Self::Luminance => luminance(rgb),
        }
    }
}

impl FloatTexture {
    /// The value at a place of a mesh, or at its coordinates alone.
    #[inline(always)]
    pub fn at(&self, place: impl Into<Place>) -> f32 {
        let place = place.into();
        match self {
            Self::Constant(value) => *value,
            Self::Image(image, channel) => channel.of(image.at(place.uv)),
            Self::Vertex(channel) => channel.of(place.color),
        }
    }

    /// The image, if there is one.
    pub(crate) fn image(&self) -> Option<&ImageTexture> {
        match self {
            Self::Image(image, _) => Some(image),
            Self::Constant(_) | Self::Vertex(_) => None,
        }
    }

    /// Mean value over the unit square of texture space, of white vertices.
    pub fn mean(&self) -> f32 {
        match self {
            Self::Constant(value) => *value,
            Self::Image(texture, channel) => channel.of(texture.image.mean() * texture.scale),
            Self::Vertex(_) => 1.0,
        }
    }
}

impl From<Rgb> for ColorTexture {
    fn from(rgb: Rgb) -> Self {
        Self::Constant(rgb)
    }
}

impl From<f32> for FloatTexture {
    fn from(value: f32) -> Self {
        Self::Constant(value)
    }
}

#[cfg(test)]
mod tests;
