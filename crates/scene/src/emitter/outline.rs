//! What an emitting surface covers as seen from a point.

use super::area::{SphereEmitter, TriangleEmitter};
use super::{AreaEmitter, Emitters};
use crate::Rgb;
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// A convex polygon around an emitting surface as it is seen from a point: each straight line from
/// that point to a point of the surface that emits towards it passes through the polygon.
#[derive(Clone, Copy, Debug)]
pub struct EmitterOutline {
    corners: [DVec3; MOST_CORNERS],
    count: usize,
    radiance: Rgb,
}

/// Corners of the polygon around a sphere.
const MOST_CORNERS: usize = 8;

/// Which parts of the sum of coordinates a triangle must lie behind its plane to count as seen from
/// behind: many times the rounding of its normal.
const BEHIND: f64 = 1e-5;

/// How much nearer than this share of the radius to a sphere no polygon is around it.
const NEAR_SPHERE: f64 = 1e-3;

impl EmitterOutline {
    /// The corners in order. None where the surface emits nothing towards the point.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// The surface's radiance.
    pub fn radiance(&self) -> Rgb {
        self.radiance
    }
}

impl Emitters {
    /// The outline of the emitting surface `index` as seen from `from`. `None` where no polygon is
    /// around it, which is so within a sphere and close to one, and for any other index.
    ///
    /// Surfaces are those of exact arithmetic. Rays in single precision miss them by up to some
    /// 2⁻²¹ of the coordinates.
    pub fn outline(&self, index: u32, from: Vec3) -> Option<EmitterOutline> {
        let area = self.areas.get(index as usize)?;
        let (corners, count) = match area {
            AreaEmitter::Triangle(triangle) => triangle.outline(from.as_dvec3()),
            AreaEmitter::Sphere(sphere) => (sphere.outline(from.as_dvec3())?, MOST_CORNERS),
        };
        Some(EmitterOutline {
            corners,
            count,
            radiance: area.radiance(),
        })
    }
}

impl TriangleEmitter {
    /// Its corners, or none from behind.
    fn outline(&self, from: DVec3) -> ([DVec3; MOST_CORNERS], usize) {
        let [a, b, c] =
            [Vec3::ZERO, self.edges[0], self.edges[1]].map(|edge| self.corner.as_dvec3() + edge.as_dvec3());
        let sum = |v: DVec3| v.abs().element_sum();
        let is_behind =
            |corner: DVec3| self.normal.as_dvec3().dot(corner - from) > BEHIND * (sum(from) + sum(corner));
        let count = if [a, b, c].into_iter().all(is_behind) {
            0
        } else {
            3
        };
        ([a, b, c, a, a, a, a, a], count)
    }
}

impl SphereEmitter {
    /// Corners of a regular polygon around the disk that the sphere covers in the plane through its
    /// centre, across the line of sight. `None` within the sphere and close to it.
    fn outline(&self, from: DVec3) -> Option<[DVec3; MOST_CORNERS]> {
        let (center, radius) = (self.sphere.center.as_dvec3(), f64::from(self.sphere.radius));
        let to_center = center - from;
        let distance = to_center.length();
        if !(distance > (1.0 + NEAR_SPHERE) * radius) {
            return None;
        }
        // The tangent cone's radius at the centre, and the corners' outside of it.
        let tangent = radius * distance / (distance * distance - radius * radius).sqrt();
        let reach = tangent / (PI / MOST_CORNERS as f64).cos() * (1.0 + 1e-6);
        let axis = to_center / distance;
        let (u, v) = axis.any_orthonormal_pair();
        Some(std::array::from_fn(|corner| {
            let (sin, cos) = (TAU * corner as f64 / MOST_CORNERS as f64).sin_cos();
            center + (u * cos + v * sin) * reach
        }))
    }
}
