//! What textures are looked up by.

use crate::Rgb;
use glam::Vec2;

/// A place on a surface as textures see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Texture coordinates of the mesh.
    pub uv: Vec2,
    /// Colour of the mesh's vertices, interpolated; white where it has none.
    pub color: Rgb,
}

impl From<Vec2> for Place {
    /// A place of white vertices.
    #[inline(always)]
    fn from(uv: Vec2) -> Self {
        Self { uv, color: Rgb::ONE }
    }
}
