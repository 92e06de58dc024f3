//! Directions in numbers.

use super::error::CachingError;
use glam::{Vec2, Vec3};
use lightshed_sampling::{octahedral_decode, octahedral_encode};

/// Most facets along a side of the square of all directions.
pub const MAX_FACETS: u16 = 22;

/// The directions in `n²` facets of about the same size, the squares of the octahedral map.
///
/// A glossy surface sends different light in different directions. With the facet of the direction
/// in its site ([`SurfaceSite::with_facet`](lightshed_spatial::SurfaceSite::with_facet)) and cells
/// that are separated by it
/// ([`LevelGridOptions::facets`](lightshed_spatial::LevelGridOptions::facets)), the surface has a
/// record for each direction that was asked about. A facet is about `√(4π) / n` radians wide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facets {
    side: u16,
}

impl Facets {
    /// `side²` facets.
    ///
    /// # Errors
    /// A side of 0 or above [`MAX_FACETS`].
    pub fn new(side: u16) -> Result<Self, CachingError> {
        match (1..=MAX_FACETS).contains(&side) {
            true => Ok(Self { side }),
            false => Err(CachingError::Option {
                name: "the side of the facets",
                value: f64::from(side),
                range: "1 to 22",
            }),
        }
    }

    /// Facets along a side of the square.
    pub fn side(&self) -> u16 {
        self.side
    }

    /// Number of a direction's facet, from 1 on.
    #[inline]
    pub fn facet(&self, direction: Vec3) -> u16 {
        self.at(octahedral_encode(direction))
    }

    /// The facet of the direction after it has moved by up to half a facet along each axis of the
    /// square, given by `u` in `[0, 1)²`. In the mean over `u` this interpolates between facets.
    #[inline]
    pub fn moved(&self, direction: Vec3, u: [f32; 2]) -> u16 {
        let by = Vec2::from(u) - 0.5;
        self.at(across(octahedral_encode(direction) + by / f32::from(self.side)))
    }

    /// The direction at the middle of a facet.
    pub fn middle(&self, facet: u16) -> Vec3 {
        let place = facet.saturating_sub(1);
        let [x, y] = [place % self.side, place / self.side].map(f32::from);
        octahedral_decode(Vec2::new(x + 0.5, y + 0.5) / f32::from(self.side))
    }

    #[inline]
    fn at(&self, uv: Vec2) -> u16 {
        // The conversion saturates, and NaN gives 0.
        let [x, y] = (uv * f32::from(self.side))
            .to_array()
            .map(|c| (c as u16).min(self.side - 1));
        1 + y * self.side + x
    }
}

/// A point at most a square's side outside of the unit square, where the octahedral map has it: the
/// two halves of each side of the square are the same directions.
#[inline]
fn across(mut uv: Vec2) -> Vec2 {
    for axis in 0..2 {
        let inside = uv[axis].clamp(0.0, 1.0);
        if inside != uv[axis] {
            uv[axis] = 2.0 * inside - uv[axis];
            uv[1 - axis] = 1.0 - uv[1 - axis];
        }
    }
    uv
}
