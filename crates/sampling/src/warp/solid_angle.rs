//! Solid angles of flat shapes.

use glam::{DVec3, Vec3};

/// The solid angle in steradians, in [0, 2π], of the flat triangle `a b c` seen from the origin
/// (Van Oosterom and Strackee 1983):
///
/// `tan(Ω/2) = |a·(b×c)| / (‖a‖‖b‖‖c‖ + (a·b)‖c‖ + (b·c)‖a‖ + (c·a)‖b‖)`.
///
/// The triple product is taken as `a·((b−a)×(c−a))` and all of it in `f64`, so that tiny and
/// distant triangles keep all digits that their vertices have. Zero for degenerate triangles and
/// those seen edge-on, and for vertices that are not finite.
#[inline]
pub fn triangle_solid_angle(a: Vec3, b: Vec3, c: Vec3) -> f32 {
    solid_angle([a, b, c].map(Vec3::as_dvec3)) as f32
}

/// As [`triangle_solid_angle`], in `f64` throughout.
#[inline]
pub(crate) fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let volume = a.dot((b - a).cross(c - a)).abs();
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    if volume > 0.0 && volume.is_finite() {
        2.0 * volume.atan2(denominator)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::{FRAC_PI_2, TAU};
    use lightshed_testkit::{GaussLegendre, check_faults, hostile_f32};

    #[test]
    fn an_octant_and_a_half_space() {
        assert!((triangle_solid_angle(Vec3::X, Vec3::Y, Vec3::Z) - FRAC_PI_2).abs() < 1e-6);
        assert!((triangle_solid_angle(Vec3::X, Vec3::Y * 1e-3, Vec3::Z * 1e5) - FRAC_PI_2).abs() < 1e-6);
        // A huge triangle just below the origin.
        let below = triangle_solid_angle(
            Vec3::new(-1e6, -1e6, -1.0),
            Vec3::new(2e6, -1e6, -1.0),
            Vec3::new(-1e6, 2e6, -1.0),
        );
        assert!((below - TAU).abs() < 1e-4, "{below}");
    }

    #[test]
    fn agrees_with_quadrature_down_to_tiny_triangles() {
        check_faults(&["half"], |fault| {
            let rule = GaussLegendre::new(24);
            for size in [1.0f32, 1e-2, 1e-5, 1e-12] {
                let a = Vec3::new(0.3, -0.4, 1.0);
                let (e, f) = (Vec3::new(0.7, 0.2, 0.1) * size, Vec3::new(-0.1, 0.5, -0.3) * size);
                // Edges after rounding of the vertices.
                let vertices = if size < 1e-7 {
                    [e * 0.0 + a * size, a * size + e, a * size + f]
                } else {
                    [a, a + e, a + f]
                };
                let [a, b, c] = vertices.map(Vec3::as_dvec3);
                let (e, f) = (b - a, c - a);
                let n = e.cross(f);
                let integral = rule.integrate_rectangle(
                    |s, t| {
                        let p = a + e * (s * (1.0 - t)) + f * (s * t);
                        s * p.dot(n).abs() / p.length().powi(3)
                    },
                    [0.0, 0.0],
                    [1.0, 1.0],
                );
                let computed = f64::from(triangle_solid_angle(vertices[0], vertices[1], vertices[2]));
                let computed = if fault.is_some() { 0.5 * computed } else { computed };
                if !((computed / integral - 1.0).abs() < 1e-6) {
                    return Err((size, computed, integral));
                }
            }
            Ok(())
        })
        .unwrap();
    }

    #[test]
    fn hostile_triangles_are_finite() {
        for x in hostile_f32() {
            for y in hostile_f32() {
                for triangle in [
                    [Vec3::new(x, y, 1.0), Vec3::new(y, x, x), Vec3::X],
                    [Vec3::splat(x), Vec3::splat(y), Vec3::Y],
                    [Vec3::ZERO, Vec3::new(x, 0.0, 0.0), Vec3::new(0.0, y, 0.0)],
                ] {
                    let omega = triangle_solid_angle(triangle[0], triangle[1], triangle[2]);
                    assert!((0.0..=TAU + 1e-6).contains(&omega), "{triangle:?}: {omega}");
                }
            }
        }
    }
}
