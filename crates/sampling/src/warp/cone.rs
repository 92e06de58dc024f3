//! Directions in a cone.
//!
//! `p_ω = 1 / (2π (1 − cos θ_max))` for directions within `θ_max` of z. Everything is in
//! terms of `1 − cos θ`: for narrow cones `cos θ` itself has no digits left in `f32` (below
//! 3·10⁻⁴ radians it rounds to one).

use super::clamp_or_low;
use super::turn::{sin_cos_turns, turns_of};
use crate::{Density, ONE_MINUS_EPSILON, SolidAngle};
use core::f32::consts::TAU;
use glam::Vec3;

/// Cones narrower than this (in `1 − cos θ`) are widened to it, so that densities stay finite.
const MIN_ONE_MINUS_COS: f32 = 1e-30;

/// Uniform directions in the cone around z of half-angle `θ_max`, in a local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniformCone {
    one_minus_cos_theta_max: f32,
}

impl UniformCone {
    /// The cone with `1 − cos θ_max`, clamped to [10⁻³⁰, 2] (a ray to the full sphere); NaN
    /// becomes 10⁻³⁰.
    #[inline(always)]
    pub fn from_one_minus_cos(one_minus_cos_theta_max: f32) -> Self {
        Self {
            one_minus_cos_theta_max: clamp_or_low(one_minus_cos_theta_max, MIN_ONE_MINUS_COS, 2.0),
        }
    }

    /// The cone of directions that meet a sphere of squared radius `r²` whose centre is at squared
    /// distance `d²`: `sin² θ_max = r²/d²`,
    /// `1 − cos θ_max = sin² θ_max / (1 + cos θ_max)`. `None` from within the sphere.
    #[inline]
    pub fn of_sphere(radius_squared: f32, distance_squared: f32) -> Option<Self> {
        let sin_squared = radius_squared / distance_squared;
        if sin_squared < 1.0 {
            Some(Self::from_one_minus_cos(
                sin_squared / (1.0 + (1.0 - sin_squared).sqrt()),
            ))
        } else {
            None
        }
    }

    /// `1 − cos θ_max`.
    #[inline(always)]
    pub fn one_minus_cos_theta_max(&self) -> f32 {
        self.one_minus_cos_theta_max
    }

    /// The cone's solid angle `2π (1 − cos θ_max)` in steradians.
    #[inline(always)]
    pub fn solid_angle(&self) -> f32 {
        TAU * self.one_minus_cos_theta_max
    }

    /// Maps `u` in [0, 1)² to a unit direction in the local frame.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        let one_minus_cos = u[0] * self.one_minus_cos_theta_max;
        let sin_theta = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u[1]);
        Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, 1.0 - one_minus_cos)
    }

    /// Density of [`UniformCone::sample`] per solid angle. The border is taken to be 10⁻⁶ wider
    /// (relatively, in `1 − cos θ`), so that no sample falls out by rounding.
    #[inline(always)]
    pub fn density(&self, direction: Vec3) -> Density<SolidAngle> {
        if one_minus_cos(direction) <= self.one_minus_cos_theta_max * 1.000_001 {
            Density::new(1.0 / self.solid_angle())
        } else {
            Density::ZERO
        }
    }

    /// The `u` that [`UniformCone::sample`] maps to the unit direction, within 10⁻⁶ in each
    /// coordinate (the second of the axis is lost); `None` outside the cone.
    #[inline]
    pub fn invert(&self, direction: Vec3) -> Option<[f32; 2]> {
        if !self.density(direction).is_positive() {
            return None;
        }
        Some([
            (one_minus_cos(direction) / self.one_minus_cos_theta_max).min(ONE_MINUS_EPSILON),
            turns_of(direction.x, direction.y),
        ])
    }
}

/// `1 − cos θ` of a unit direction, from the sine where the cosine has lost its digits.
#[inline(always)]
fn one_minus_cos(direction: Vec3) -> f32 {
    if direction.z > 0.5 {
        (direction.x * direction.x + direction.y * direction.y) / (1.0 + direction.z)
    } else {
        1.0 - direction.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};

    #[test]
    fn properties_hold() {
        for one_minus_cos in [1e-20f32, 1e-7, 1e-3, 0.5, 1.0, 2.0] {
            let cone = UniformCone::from_one_minus_cos(one_minus_cos);
            let maximum = 2.0 * (f64::from(one_minus_cos) / 2.0).sqrt().asin();
            verify(&Case::directions(
                format!("cone {one_minus_cos}"),
                Chart::cap(Vec3::Z, maximum, maximum),
                move |u| cone.sample(u),
                // The chart ends where the cone does, but for rounding.
                move |_| cone.density(cone.sample([0.5, 0.5])).value(),
                move |d| cone.invert(d),
            ));
        }
    }

    #[test]
    fn the_border_is_where_it_should_be() {
        for one_minus_cos in [1e-10f32, 1e-3, 1.5] {
            let cone = UniformCone::from_one_minus_cos(one_minus_cos);
            let wider = UniformCone::from_one_minus_cos(one_minus_cos * 1.00001);
            for i in 0..100 {
                let u1 = i as f32 / 100.0;
                assert!(cone.density(cone.sample([ONE_MINUS_EPSILON, u1])).is_positive());
                let outside = wider.sample([ONE_MINUS_EPSILON, u1]);
                assert!(!cone.density(outside).is_positive() && cone.invert(outside).is_none());
            }
        }
    }

    #[test]
    fn degenerate_cones_are_defined() {
        for value in [0.0, -1.0, f32::NAN] {
            let cone = UniformCone::from_one_minus_cos(value);
            assert_eq!(cone.sample([0.5, 0.5]).z, 1.0);
            assert!(cone.density(Vec3::Z).value().is_finite());
        }
        assert_eq!(
            UniformCone::from_one_minus_cos(f32::INFINITY).one_minus_cos_theta_max(),
            2.0
        );
        assert!(UniformCone::of_sphere(1.0, 0.99).is_none());
        assert!(UniformCone::of_sphere(0.0, 0.0).is_none());
        let far = UniformCone::of_sphere(1.0, 1e12).unwrap();
        assert!((far.solid_angle() / (core::f32::consts::PI * 1e-12) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn values_are_stable() {
        assert_frozen(
            |u| UniformCone::from_one_minus_cos(0.25).sample(u),
            [
                Vec3::new(0.06866507, 0.21132939, 0.975),
                Vec3::new(0.0, -0.48412293, 0.875),
                Vec3::new(-0.19045174, 0.58615005, 0.7875),
            ],
        );
    }
}
