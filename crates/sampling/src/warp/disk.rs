//! The unit disk.
//!
//! Density `p(x) = 1/π` with respect to area, for `‖x‖ ≤ 1`. Two maps of the unit square
//! onto it: the concentric map (Shirley and Chiu 1997) keeps neighbours together and shapes
//! compact, the polar map `r = √u₀, φ = 2π u₁` is smooth but for one seam, and its first
//! coordinate alone decides the radius.

use super::turn::{sin_cos_quarter, sin_cos_quarter_lanes, sin_cos_turns, turns_of};
use crate::{Area, Density, ONE_MINUS_EPSILON};
use core::f32::consts::{FRAC_1_PI, FRAC_2_PI};
use glam::Vec2;
use lightshed_lanes::Lanes;

/// `p_A = 1/π` inside the unit disk, 0 outside. Points that a warp put on the border count as
/// inside.
#[inline(always)]
fn density(point: Vec2) -> Density<Area> {
    // Rounding may put a sample outside by two units in the last place.
    Density::new(if point.length_squared() <= 1.0 + 4.0 * f32::EPSILON {
        FRAC_1_PI
    } else {
        0.0
    })
}

/// `a` where the bits of `mask` are set, else `b`.
#[inline(always)]
fn select(mask: u32, a: f32, b: f32) -> f32 {
    f32::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
}

/// Uniform points in the unit disk by the concentric map: squares become disks, ring by ring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConcentricDisk;

impl ConcentricDisk {
    /// Maps `u` in [0, 1)² to the disk.
    #[inline(always)]
    pub fn sample(u: [f32; 2]) -> Vec2 {
        Self::sample_with_radius(u).0
    }

    /// The point, and its signed radius `r` in [−1, 1) free of the rounding in the coordinates.
    #[inline(always)]
    pub(crate) fn sample_with_radius(u: [f32; 2]) -> (Vec2, f32) {
        let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
        // Which half of the square a point lies in is a coin flip: it selects by bits, not by a
        // branch.
        let along_x = u32::from(a.abs() > b.abs()).wrapping_neg();
        let (radius, other) = (select(along_x, a, b), select(along_x, b, a));
        // φ = (π/4)(other/radius) from the x or the y axis.
        let ratio = if radius == 0.0 { 0.0 } else { other / radius };
        let (sin, cos) = sin_cos_quarter(0.5 * ratio);
        let (x, y) = (select(along_x, cos, sin), select(along_x, sin, cos));
        (Vec2::new(radius * x, radius * y), radius)
    }

    /// [`ConcentricDisk::sample`] of eight points, bit for bit.
    #[inline(always)]
    pub fn sample_lanes<L: Lanes>(u: [L; 2]) -> [L; 2] {
        let (x, y, _) = Self::sample_with_radius_lanes(u);
        [x, y]
    }

    /// [`ConcentricDisk::sample_with_radius`] of eight points, bit for bit: `(x, y, r)`.
    #[inline(always)]
    pub(crate) fn sample_with_radius_lanes<L: Lanes>(u: [L; 2]) -> (L, L, L) {
        let (one, two) = (L::splat(1.0), L::splat(2.0));
        let (a, b) = (two * u[0] - one, two * u[1] - one);
        let along_x = b.abs().less(a.abs());
        let (radius, other) = (a.select(along_x, b), b.select(along_x, a));
        let zero = L::splat(0.0);
        let ratio = zero.select(radius.equal(zero), other / radius);
        let (sin, cos) = sin_cos_quarter_lanes(L::splat(0.5) * ratio);
        let (x, y) = (cos.select(along_x, sin), sin.select(along_x, cos));
        (radius * x, radius * y, radius)
    }

    /// Density of [`ConcentricDisk::sample`] per unit area.
    #[inline(always)]
    pub fn density(point: Vec2) -> Density<Area> {
        density(point)
    }

    /// The `u` that [`ConcentricDisk::sample`] maps to `point`, within 3·10⁻⁷ in each
    /// coordinate. A point outside the disk is first moved to its border.
    #[inline]
    pub fn invert(point: Vec2) -> [f32; 2] {
        let radius = point.length().min(1.0);
        let (x, y) = (point.x, point.y);
        let (a, b) = if x.abs() > y.abs() {
            let a = radius.copysign(x);
            (a, a * (y / x).atan() * (2.0 * FRAC_2_PI))
        } else if y != 0.0 {
            let b = radius.copysign(y);
            (b * (x / y).atan() * (2.0 * FRAC_2_PI), b)
        } else {
            (0.0, 0.0)
        };
        [a, b].map(|x| (0.5 * x + 0.5).clamp(0.0, ONE_MINUS_EPSILON))
    }
}

/// Uniform points in the unit disk in polar coordinates, `r = √u₀`, `φ = 2π u₁`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PolarDisk;

impl PolarDisk {
    /// Maps `u` in [0, 1)² to the disk.
    #[inline(always)]
    pub fn sample(u: [f32; 2]) -> Vec2 {
        let radius = u[0].sqrt();
        let (sin, cos) = sin_cos_turns(u[1]);
        Vec2::new(radius * cos, radius * sin)
    }

    /// Density of [`PolarDisk::sample`] per unit area.
    #[inline(always)]
    pub fn density(point: Vec2) -> Density<Area> {
        density(point)
    }

    /// The `u` that [`PolarDisk::sample`] maps to `point`, within 5·10⁻⁷ in each coordinate
    /// (the second of a point at the centre is lost). A point outside the disk is first moved to
    /// its border.
    #[inline]
    pub fn invert(point: Vec2) -> [f32; 2] {
        [
            point.length_squared().min(ONE_MINUS_EPSILON),
            turns_of(point.x, point.y),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};
    use glam::Vec3;

    #[test]
    fn properties_hold() {
        verify(&Case::plane(
            "concentric disk",
            Chart::disk(),
            ConcentricDisk::sample,
            |p| ConcentricDisk::density(p).value(),
            |p| Some(ConcentricDisk::invert(p)),
        ));
        verify(&Case::plane(
            "polar disk",
            Chart::disk(),
            PolarDisk::sample,
            |p| PolarDisk::density(p).value(),
            |p| Some(PolarDisk::invert(p)),
        ));
    }

    #[test]
    fn points_outside_have_density_zero_and_a_defined_inverse() {
        let far = Vec2::new(3.0, -4.0);
        assert_eq!(ConcentricDisk::density(far), Density::ZERO);
        assert_eq!(PolarDisk::density(far), Density::ZERO);
        for p in [far, Vec2::ZERO, Vec2::new(1e-30, -1e-38), Vec2::X, -Vec2::Y] {
            for u in [ConcentricDisk::invert(p), PolarDisk::invert(p)] {
                assert!(u.iter().all(|x| (0.0..1.0).contains(x)), "{p}: {u:?}");
            }
        }
        assert_eq!(ConcentricDisk::sample([0.5, 0.5]), Vec2::ZERO);
    }

    #[test]
    fn values_are_stable() {
        assert_frozen(
            |u| ConcentricDisk::sample(u).extend(0.0),
            [
                Vec3::new(-0.6651757, -0.44445616, 0.0),
                Vec3::new(0.0, 0.5, 0.0),
                Vec3::new(0.6306783, -0.3037186, 0.0),
            ],
        );
        assert_frozen(
            |u| PolarDisk::sample(u).extend(0.0),
            [
                Vec3::new(0.097719744, 0.3007505, 0.0),
                Vec3::new(0.0, -0.70710677, 0.0),
                Vec3::new(-0.28489965, 0.87683076, 0.0),
            ],
        );
    }
}
