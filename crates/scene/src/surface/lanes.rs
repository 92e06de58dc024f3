//! Eight surface points at a time, and rays that leave them.

use super::POSITION_ERROR;
use lightshed_lanes::{LaneMask, Lanes, Vec3Lanes};
use lightshed_sampling::FrameLanes;

/// Eight points on diffuse or glossy triangles, as [`Scene::surface`](crate::Scene::surface) and
/// [`Scene::bsdf`](crate::Scene::bsdf) find them, bit for bit.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseLanes<L: Lanes> {
    /// [`SurfacePoint::position`](crate::SurfacePoint::position).
    pub position: Vec3Lanes<L>,
    /// [`SurfacePoint::offset`](crate::SurfacePoint::offset).
    pub offset: L,
    /// [`SurfacePoint::geometric_normal`](crate::SurfacePoint::geometric_normal).
    pub geometric_normal: Vec3Lanes<L>,
    /// [`SurfacePoint::shading`](crate::SurfacePoint::shading).
    pub shading: FrameLanes<L>,
    /// Albedo `ρ` of the BSDF `ρ/π`, where it is diffuse.
    pub reflectance: Vec3Lanes<L>,
    /// Sides from which it is seen.
    pub(crate) front: L::Mask,
    pub(crate) back: L::Mask,
    /// Lanes, of those asked for, whose point is on a diffuse triangle.
    pub diffuse: u32,
    /// Lanes whose point is on a triangle of a material for
    /// [`Scene::scatter_glossy`](crate::Scene::scatter_glossy). Nothing is of meaning in lanes that
    /// are neither of the two.
    pub glossy: u32,
    /// Lanes of these whose surface emits.
    pub emitting: u32,
}

impl<L: Lanes> DiffuseLanes<L> {
    /// Whether the surface is seen along directions of the given local `z`, and a factor for `z`
    /// that brings them above it.
    #[inline(always)]
    pub fn seen_from(&self, cos_theta_out: L) -> (L::Mask, L) {
        let zero = L::splat(0.0);
        let seen = (self.front & zero.less(cos_theta_out)) | (self.back & cos_theta_out.less(zero));
        (seen, L::splat(1.0).copysign(cos_theta_out))
    }

    /// Lanes whose surfaces are seen from the front, and from the back.
    #[inline(always)]
    pub fn sides(&self) -> [u32; 2] {
        [self.front.bits(), self.back.bits()]
    }

    /// [`SurfacePoint::origin_towards`](crate::SurfacePoint::origin_towards).
    #[inline(always)]
    pub fn origin_towards(&self, direction: Vec3Lanes<L>) -> Vec3Lanes<L> {
        offset_along_lanes(self.position, self.geometric_normal, self.offset, direction)
    }
}

/// `position` moved by `offset` along `normal`, to the side of `direction`.
#[inline(always)]
pub fn offset_along_lanes<L: Lanes>(
    position: Vec3Lanes<L>,
    normal: Vec3Lanes<L>,
    offset: L,
    direction: Vec3Lanes<L>,
) -> Vec3Lanes<L> {
    position + normal * offset.copysign(direction.dot(normal))
}

/// [`SurfacePoint::offset_for`](crate::SurfacePoint::offset_for).
#[inline(always)]
pub fn offset_for_lanes<L: Lanes>(normal: Vec3Lanes<L>, terms: Vec3Lanes<L>, extent: L) -> L {
    (normal.abs().dot(terms) + extent) * L::splat(POSITION_ERROR)
}
