//! Rays and what they hit.

use glam::Vec3;

/// A half-open ray segment `origin + t · direction`, `0 < t < t_max`. `direction` need not be of
/// unit length; `t` is in units of its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start of the segment (itself excluded).
    pub origin: Vec3,
    /// Direction; any non-zero length.
    pub direction: Vec3,
    /// End of the segment (itself excluded); may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// A ray without end.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_max: f32::INFINITY,
        }
    }

    /// The open segment from `origin` to `origin + t_max · direction`.
    #[inline(always)]
    pub fn segment(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self {
            origin,
            direction,
            t_max,
        }
    }
}

/// The nearest intersection along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Index of the primitive: triangles first, in the order given, then spheres.
    pub primitive: u32,
    /// Barycentric weights of the triangle's second and third vertex (zero for spheres); the first
    /// has `1 − u − v`.
    pub barycentric: [f32; 2],
}
