//! The hemisphere `z > 0`, uniformly and by the cosine.

use super::disk::ConcentricDisk;
use super::turn::{sin_cos_turns, turns_of};
use crate::{Density, ONE_MINUS_EPSILON, SolidAngle};
use core::f32::consts::{FRAC_1_PI, TAU};
use glam::{Vec2, Vec3};
use lightshed_lanes::{Lanes, Vec3Lanes};

/// Directions with `p_ω = cos θ / π` in the hemisphere around z, by lifting the concentric disk
/// (Malley's method).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CosineHemisphere;

impl CosineHemisphere {
    /// Maps `u` in [0, 1)² to a unit direction with `z > 0`.
    #[inline(always)]
    pub fn sample(u: [f32; 2]) -> Vec3 {
        let (point, radius) = ConcentricDisk::sample_with_radius(u);
        // 1 − r² = (1 − |r|)(1 + |r|), the first factor exact: no cancellation at the horizon.
        // The smallest u reaches r = −1; there the middle of the cell that u stands for is taken,
        // so that no sample has density zero.
        let radius = radius.abs();
        let z_squared = ((1.0 - radius) * (1.0 + radius)).max(f32::EPSILON);
        Vec3::new(point.x, point.y, z_squared.sqrt())
    }

    /// [`CosineHemisphere::sample`] of eight points, bit for bit.
    #[inline(always)]
    pub fn sample_lanes<L: Lanes>(u: [L; 2]) -> Vec3Lanes<L> {
        let (x, y, radius) = ConcentricDisk::sample_with_radius_lanes(u);
        let (radius, one) = (radius.abs(), L::splat(1.0));
        let z_squared = ((one - radius) * (one + radius)).max(L::splat(f32::EPSILON));
        Vec3Lanes::new(x, y, z_squared.sqrt())
    }

    /// Density of [`CosineHemisphere::sample`] per solid angle, `max(cos θ, 0) / π`.
    #[inline(always)]
    pub fn density(cos_theta: f32) -> Density<SolidAngle> {
        Density::new(cos_theta.max(0.0) * FRAC_1_PI)
    }

    /// The `u` that [`CosineHemisphere::sample`] maps to the unit direction, within 4·10⁻⁷ in
    /// each coordinate. Directions below the horizon give the `u` of the horizon or of the
    /// direction mirrored in it: their density is zero.
    #[inline]
    pub fn invert(direction: Vec3) -> [f32; 2] {
        ConcentricDisk::invert(Vec2::new(direction.x, direction.y))
    }
}

/// Directions with `p_ω = 1/2π` in the hemisphere around z: `cos θ = 1 − u₀`,
/// `φ = 2π u₁`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UniformHemisphere;

impl UniformHemisphere {
    /// Maps `u` in [0, 1)² to a unit direction with `z > 0`.
    #[inline(always)]
    pub fn sample(u: [f32; 2]) -> Vec3 {
        let sin_theta = (u[0] * (2.0 - u[0])).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u[1]);
        Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, 1.0 - u[0])
    }

    /// Density of [`UniformHemisphere::sample`] per solid angle: 1/2π above the horizon, 0 at and
    /// below it.
    #[inline(always)]
    pub fn density(cos_theta: f32) -> Density<SolidAngle> {
        Density::new(if cos_theta > 0.0 { 1.0 / TAU } else { 0.0 })
    }

    /// The `u` that [`UniformHemisphere::sample`] maps to the unit direction, within 5·10⁻⁷ in
    /// each coordinate (the second of the pole is lost). Directions below the horizon give the `u`
    /// of the horizon.
    #[inline]
    pub fn invert(direction: Vec3) -> [f32; 2] {
        [
            (1.0 - direction.z).clamp(0.0, ONE_MINUS_EPSILON),
            turns_of(direction.x, direction.y),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};
    use core::f64::consts::FRAC_PI_2;

    #[test]
    fn properties_hold() {
        verify(&Case::directions(
            "cosine hemisphere",
            Chart::cap(Vec3::Z, 1.0, FRAC_PI_2),
            CosineHemisphere::sample,
            |d| CosineHemisphere::density(d.z).value(),
            |d| Some(CosineHemisphere::invert(d)),
        ));
        verify(&Case::directions(
            "uniform hemisphere",
            Chart::cap(Vec3::Z, 1.0, FRAC_PI_2),
            UniformHemisphere::sample,
            |d| UniformHemisphere::density(d.z).value(),
            |d| Some(UniformHemisphere::invert(d)),
        ));
    }

    #[test]
    fn below_the_horizon_the_density_is_zero() {
        assert_eq!(CosineHemisphere::density(-0.5), Density::ZERO);
        assert_eq!(CosineHemisphere::density(f32::NAN), Density::ZERO);
        assert_eq!(UniformHemisphere::density(-0.5), Density::ZERO);
        for d in [-Vec3::Z, Vec3::X, Vec3::new(0.6, 0.0, -0.8)] {
            for u in [CosineHemisphere::invert(d), UniformHemisphere::invert(d)] {
                assert!(u.iter().all(|x| (0.0..1.0).contains(x)), "{d}: {u:?}");
            }
        }
    }

    #[test]
    fn values_are_stable() {
        assert_frozen(
            CosineHemisphere::sample,
            [
                Vec3::new(-0.6651757, -0.44445616, 0.59999996),
                Vec3::new(0.0, 0.5, 0.8660254),
                Vec3::new(0.6306783, -0.3037186, 0.7141428),
            ],
        );
        assert_frozen(
            UniformHemisphere::sample,
            [
                Vec3::new(0.13469738, 0.41455594, 0.9),
                Vec3::new(0.0, -0.8660254, 0.5),
                Vec3::new(-0.30552086, 0.94029623, 0.14999998),
            ],
        );
    }
}
