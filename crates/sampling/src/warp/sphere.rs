//! The unit sphere.

use super::turn::{sin_cos_turns, sin_cos_turns_lanes, turns_of};
use crate::{Density, ONE_MINUS_EPSILON, SolidAngle};
use core::f32::consts::PI;
use glam::Vec3;
use lightshed_lanes::{Lanes, Vec3Lanes};

/// Directions with `p_ω = 1/4π`: `cos θ = 1 − 2u₀`, `φ = 2π u₁` (Archimedes' hat-box
/// theorem).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UniformSphere;

impl UniformSphere {
    /// Maps `u` in [0, 1)² to a unit direction.
    #[inline(always)]
    pub fn sample(u: [f32; 2]) -> Vec3 {
        let sin_theta = 2.0 * (u[0] * (1.0 - u[0])).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u[1]);
        Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, 1.0 - 2.0 * u[0])
    }

    /// [`UniformSphere::sample`] of eight points, bit for bit.
    #[inline(always)]
    pub fn sample_lanes<L: Lanes>(u: [L; 2]) -> Vec3Lanes<L> {
        let (one, two) = (L::splat(1.0), L::splat(2.0));
        let sin_theta = two * (u[0] * (one - u[0])).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns_lanes(u[1]);
        Vec3Lanes::new(sin_theta * cos_phi, sin_theta * sin_phi, one - two * u[0])
    }

    /// Density of [`UniformSphere::sample`] per solid angle, the same everywhere.
    #[inline(always)]
    pub const fn density() -> Density<SolidAngle> {
        Density::new(0.25 / PI)
    }

    /// The `u` that [`UniformSphere::sample`] maps to the unit direction, within 5·10⁻⁷ in
    /// each coordinate (the second of either pole is lost).
    #[inline]
    pub fn invert(direction: Vec3) -> [f32; 2] {
        [
            (0.5 - 0.5 * direction.z).clamp(0.0, ONE_MINUS_EPSILON),
            turns_of(direction.x, direction.y),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};

    #[test]
    fn properties_hold() {
        verify(&Case::directions(
            "sphere",
            Chart::cap(Vec3::Z, 1.0, core::f64::consts::PI),
            UniformSphere::sample,
            |_| UniformSphere::density().value(),
            |d| Some(UniformSphere::invert(d)),
        ));
    }

    #[test]
    fn values_are_stable() {
        assert_frozen(
            UniformSphere::sample,
            [
                Vec3::new(0.18541017, 0.5706339, 0.8),
                Vec3::new(0.0, -1.0, 0.0),
                Vec3::new(-0.22068231, 0.67919016, -0.70000005),
            ],
        );
        assert_eq!(UniformSphere::invert(Vec3::Z), [0.0, 0.0]);
        assert_eq!(UniformSphere::invert(-Vec3::Z)[0], ONE_MINUS_EPSILON);
    }
}
