//! The watertight triangle test, one triangle at a time: the specification of the eight-wide one.
//!
//! # Needles
//! The ray parameter is a mean of those of the corners, weighted by areas. Across a needle of
//! length `L` and height `h` these are differences of products `L/h` times as large. The parameter
//! is then off by some `ulp(L) L/h`: for a slat of 6 m by 2 mm that is a tenth of a millimetre,
//! more than a ray starts above the surface that it leaves. So the ray may hit that surface again,
//! and whether it does depends on which leaves a tree lets it visit. Near the start of a ray,
//! therefore, a hit counts only if the triangle's plane is ahead in `f64` too ([`is_ahead`]).

use super::{Hit, Ray};
use glam::Vec3;

/// Intersects `ray` with one triangle as the eight-wide traversal does, operation by operation; see
/// there for why no ray passes between neighbours. `primitive` is copied into the hit.
///
/// Shaders do the same. Trees also ask whether the triangle's plane is ahead; this does not.
#[inline]
pub fn intersect_triangle(ray: &Ray, corners: &[Vec3; 3], primitive: u32, t_max: f32) -> Option<Hit> {
    let d = ray.direction;
    let kz = {
        let m = d.abs();
        if m.x > m.y {
            if m.x > m.z { 0 } else { 2 }
        } else if m.y > m.z {
            1
        } else {
            2
        }
    };
    let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
    let inverse_z = 1.0 / d[kz];
    let (shear_x, shear_y) = (d[kx] * inverse_z, d[ky] * inverse_z);
    let sheared = corners.map(|corner| {
        let p = corner - ray.origin;
        Vec3::new(p[kx] - shear_x * p[kz], p[ky] - shear_y * p[kz], p[kz])
    });
    let [a, b, c] = sheared;
    let area_a = c.x * b.y - c.y * b.x;
    let area_b = a.x * c.y - a.y * c.x;
    let area_c = b.x * a.y - b.y * a.x;
    let inside = (area_a >= 0.0 && area_b >= 0.0 && area_c >= 0.0)
        || (area_a <= 0.0 && area_b <= 0.0 && area_c <= 0.0);
    if !inside {
        return None;
    }
    let inverse_determinant = 1.0 / (area_a + (area_b + area_c));
    let z = area_a * a.z + (area_b * b.z + area_c * c.z);
    let t = z * inverse_z * inverse_determinant;
    if !(t > 0.0 && t < t_max) {
        return None;
    }
    let (u, v) = (area_a * inverse_determinant, area_b * inverse_determinant);
    Some(Hit {
        t,
        primitive,
        barycentric: [v, (1.0 - u - v).max(0.0)],
    })
}

/// The hit of [`intersect_triangle`] if the triangle's plane is ahead: what a tree returns.
#[cfg(any(test, feature = "obvhs"))]
#[inline]
pub fn intersect_ahead(ray: &Ray, corners: &[Vec3; 3], primitive: u32, t_max: f32) -> Option<Hit> {
    intersect_triangle(ray, corners, primitive, t_max)
        .filter(|_| is_ahead(ray.origin, ray.direction, corners))
}

/// Hits nearer than this share of the largest side of the box around all triangles are looked at
/// again. Errors of more are not found.
const DOUBTFUL: f32 = 1.0 / 16_384.0;

/// The distance along a coordinate below which hits in a box are to be looked at again.
#[inline]
pub fn doubtful_reach(min: Vec3, max: Vec3) -> f32 {
    let reach = (max - min).max_element() * DOUBTFUL;
    if reach.is_finite() { reach } else { 0.0 }
}

/// Whether a line meets a triangle's plane ahead of `origin`.
///
/// # Precision
/// In `f64`: wrong only where the distance is below 10⁻¹⁴ times `L²/h`, for a triangle of length
/// and distance `L` and height `h`.
pub fn is_ahead(origin: Vec3, direction: Vec3, corners: &[Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3() - origin.as_dvec3());
    let normal = (b - a).cross(c - a);
    normal.dot(a) * normal.dot(direction.as_dvec3()) > 0.0
}

/// Whether a triangle is so thin that a hit may be off by more than a ray starts above a surface,
/// some 64 units in the last place.
pub fn is_needle(corners: &[Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let sides = [b - a, c - b, a - c].map(|side| side.length_squared());
    let longest = sides[0].max(sides[1]).max(sides[2]);
    let doubled_area = (b - a).cross(c - a).length();
    // One without area is never hit.
    doubled_area > 0.0 && longest > 64.0 * doubled_area
}
