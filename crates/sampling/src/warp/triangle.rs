//! Points on a triangle, uniform by area.
//!
//! Barycentric coordinates `(b₀, b₁, b₂)` with `p_A = 1/area`. The map folds the unit square
//! over its diagonal and shears each half by half of the smaller coordinate (Heitz 2019, *A
//! Low-Distortion Map Between Triangle and Square*): no square root, and neighbours stay closer
//! together than with `√u`.

use crate::{Area, Density, ONE_MINUS_EPSILON};
use lightshed_lanes::Lanes;

/// Uniform barycentric coordinates of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UniformTriangle;

impl UniformTriangle {
    /// Maps `u` in [0, 1)² to barycentric coordinates: not negative, of sum one up to rounding.
    #[inline(always)]
    pub fn sample(u: [f32; 2]) -> [f32; 3] {
        // Both halves in one form, without a branch: half of the smaller coordinate is exact.
        let half = 0.5 * u[0].min(u[1]);
        let (b0, b1) = (u[0] - half, u[1] - half);
        [b0, b1, 1.0 - b0 - b1]
    }

    /// The first two coordinates that [`UniformTriangle::sample`] gives for each of eight points,
    /// bit for bit.
    #[inline(always)]
    pub fn sample_lanes<L: Lanes>(u: [L; 2]) -> [L; 2] {
        let half = L::splat(0.5) * u[0].min(u[1]);
        [u[0] - half, u[1] - half]
    }

    /// Density of the point at [`UniformTriangle::sample`] per unit area, `1/area`; zero for a
    /// triangle without area.
    #[inline(always)]
    pub fn density(area: f32) -> Density<Area> {
        let density = 1.0 / area;
        Density::new(if density > 0.0 && density <= f32::MAX {
            density
        } else {
            0.0
        })
    }

    /// The `u` that [`UniformTriangle::sample`] maps to the barycentric coordinates, within
    /// 2·10⁻⁷ in each coordinate. Coordinates outside the triangle give a `u` on the border of
    /// the square.
    #[inline]
    pub fn invert(barycentric: [f32; 3]) -> [f32; 2] {
        let [b0, b1, _] = barycentric;
        let u = if b1 > b0 {
            [2.0 * b0, b0 + b1]
        } else {
            [b0 + b1, 2.0 * b1]
        };
        u.map(|x| x.clamp(0.0, ONE_MINUS_EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};
    use glam::{Vec2, Vec3};
    use lightshed_testkit::hostile_unit_f32;

    #[test]
    fn properties_hold() {
        verify(&Case::plane(
            "triangle",
            Chart::triangle([Vec3::ZERO, Vec3::X, Vec3::Y]),
            |u| {
                let [b0, b1, _] = UniformTriangle::sample(u);
                Vec2::new(b0, b1)
            },
            |_| UniformTriangle::density(0.5).value(),
            |p| Some(UniformTriangle::invert([p.x, p.y, 1.0 - p.x - p.y])),
        ));
    }

    #[test]
    fn coordinates_are_never_negative() {
        for u in hostile_unit_f32().flat_map(|a| hostile_unit_f32().map(move |b| [a, b])) {
            let b = UniformTriangle::sample(u);
            assert!(b.iter().all(|x| *x >= 0.0), "{u:?}: {b:?}");
            assert!((b.iter().sum::<f32>() - 1.0).abs() < 2e-7);
        }
    }

    #[test]
    fn degenerate_triangles_have_density_zero() {
        for area in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-45] {
            assert_eq!(UniformTriangle::density(area), Density::ZERO, "{area}");
        }
        assert_eq!(
            UniformTriangle::invert([-1.0, 3.0, -1.0]),
            [0.0, ONE_MINUS_EPSILON]
        );
    }

    #[test]
    fn values_are_stable() {
        assert_frozen(
            |u| Vec3::from_array(UniformTriangle::sample(u)),
            [
                Vec3::new(0.05, 0.15, 0.79999995),
                Vec3::new(0.25, 0.5, 0.25),
                Vec3::new(0.70000005, 0.15, 0.14999995),
            ],
        );
    }
}
