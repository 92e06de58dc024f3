//! A point on a surface, and rays that leave it.

mod lanes;

pub use lanes::DiffuseLanes;
pub(crate) use lanes::{offset_along_lanes, offset_for_lanes};

use crate::Ray;
use glam::{Vec2, Vec3};
use lightshed_sampling::Frame;

/// Bound on the rounding errors of a point on a surface and of the rays through it, relative to the
/// lengths they come from.
///
/// A point `b₀v₀ + b₁v₁ + b₂v₂` is off by at most `γ(7) = 7ε/(1−7ε)` of the sum of
/// its terms' magnitudes, `ε = 2⁻²⁴` (Higham 2002 §3.1; Pharr, Jakob and Humphreys 2023
/// §6.8.4 apply it so), and the weights and the next ray's origin err by as much again each. That
/// is an error of coordinates, which vanishes where they do: on the plane `y = 0`, say. The next
/// ray's test against the same triangle has another one, of the triangle's *extent*: it forms the
/// edges' cross products from differences of coordinates, some 15 roundings of that size deep.
/// Both, rounded up.
const POSITION_ERROR: f32 = 16.0 * f32::EPSILON;

/// A point on a surface as shading sees it.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// World position, computed from the surface's own parameters rather than along the ray.
    pub position: Vec3,
    /// How far along the geometric normal a new ray must start so as not to meet this surface
    /// again.
    pub offset: f32,
    /// Unit geometric normal, by the winding.
    pub geometric_normal: Vec3,
    /// Shading frame, around the interpolated normal where there is one.
    pub shading: Frame,
    /// Texture coordinates; on triangles without, the barycentric weights of the second and third
    /// vertex.
    pub uv: Vec2,
    /// Index of the primitive.
    pub primitive: u32,
    /// Index of the material.
    pub material: u32,
    /// Index of the area emitter, or [`SurfacePoint::NO_EMITTER`].
    pub emitter: u32,
}

impl SurfacePoint {
    /// In place of an emitter's index.
    pub const NO_EMITTER: u32 = u32::MAX;

    /// The offset for a point whose coordinates were summed from terms of magnitude `terms`, on a
    /// primitive of which no two points differ in a coordinate by more than `extent`.
    #[inline(always)]
    pub(crate) fn offset_for(geometric_normal: Vec3, terms: Vec3, extent: f32) -> f32 {
        (geometric_normal.abs().dot(terms) + extent) * POSITION_ERROR
    }

    /// Where a ray towards the side of `direction` starts.
    #[inline(always)]
    pub fn origin_towards(&self, direction: Vec3) -> Vec3 {
        offset_along(self.position, self.geometric_normal, self.offset, direction)
    }

    /// The segment that must be free for this point and `other` to see each other: between the two,
    /// moved off their surfaces.
    #[inline]
    pub fn segment_to(&self, other: &Self) -> Ray {
        let between = other.position - self.position;
        let (origin, target) = (self.origin_towards(between), other.origin_towards(-between));
        Ray::segment(origin, target - origin, 1.0)
    }

    /// The ray from this point in `direction`.
    #[inline(always)]
    pub fn spawn(&self, direction: Vec3) -> Ray {
        Ray::new(self.origin_towards(direction), direction)
    }
}

/// `position` moved by `offset` along `normal`, to the side of `direction`.
#[inline(always)]
pub(crate) fn offset_along(position: Vec3, normal: Vec3, offset: f32, direction: Vec3) -> Vec3 {
    position + normal * offset.copysign(direction.dot(normal))
}
