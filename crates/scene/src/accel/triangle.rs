//! The watertight triangle test, one triangle at a time: the specification of the eight-wide one.

use super::{Hit, Ray};
use glam::Vec3;

/// Intersects `ray` with one triangle as the eight-wide traversal does, operation by operation; see
/// there for why no ray passes between neighbours. `primitive` is copied into the hit.
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
