//! Equi-angular sampling of distances.
//!
//! Along a ray seen from a point light at distance `D` from it, closest at `t = Δ`: points whose
//! directions from the light are uniform in angle,
//! `p(t) = D / ((θ_b − θ_a) (D² + (t − Δ)²))` per unit of `t` (Kulla and Fajardo 2012, eq.
//! 5): in proportion to the light's inverse square. Angles are taken between the light's directions
//! to the interval's ends, without the difference of two arc tangents that cancels for lights far
//! away.

use crate::{FieldRay, Interval};
use glam::Vec3;
use lightshed_sampling::{Density, Length};

/// Equi-angular sampling of one interval for one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EquiAngular {
    interval: Interval,
    /// `D` in units of `t`.
    distance: f64,
    /// `t₀ − Δ`.
    start: f64,
    /// `θ_b − θ_a`, in (0, π].
    angle: f64,
}

/// A point of an equi-angular distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EquiAngularSample {
    /// Where on the ray.
    pub t: f32,
    /// The density per unit of `t`.
    pub pdf: Density<Length>,
}

/// Lower bound of `D`, as a part of the interval's length and the light's distance along the ray.
/// Closer lights count as that far, for density and samples alike.
const LEAST_DISTANCE: f64 = 1e-6;

impl EquiAngular {
    /// For a `light` at a point in the space of `ray` (which must not be distorted against the
    /// world's). `None` unless the interval has a positive, finite length and everything is finite.
    pub fn new(ray: &FieldRay, interval: Interval, light: Vec3) -> Option<Self> {
        let direction = ray.direction.as_dvec3();
        let towards = light.as_dvec3() - ray.origin.as_dvec3();
        let squared = direction.length_squared();
        let (t0, t1) = (f64::from(interval.t0), f64::from(interval.t1));
        let closest = towards.dot(direction) / squared;
        let across = (towards - direction * closest).length() / squared.sqrt();
        let (start, end) = (t0 - closest, t1 - closest);
        let distance = across.max(LEAST_DISTANCE * (t1 - t0 + start.abs()));
        let angle = (distance * (end - start)).atan2(distance * distance + start * end);
        let valid = t1 > t0 && distance.is_finite() && angle > 0.0;
        valid.then_some(Self {
            interval,
            distance,
            start,
            angle,
        })
    }

    /// Maps `u` in [0, 1) to a point of the interval. Its density is *known in closed form*.
    #[inline]
    pub fn sample(&self, u: f32) -> EquiAngularSample {
        let (sin, cos) = (f64::from(u) * self.angle).sin_cos();
        // tan(θ_a + φ) − tan θ_a = sec² θ_a · sin φ / (cos φ − tan θ_a sin φ), times
        // D.
        let squared = self.distance * self.distance + self.start * self.start;
        let along = squared * sin / (self.distance * cos - self.start * sin);
        let t = (f64::from(self.interval.t0) + along) as f32;
        let t = t.clamp(self.interval.t0, self.interval.t1);
        EquiAngularSample { t, pdf: self.pdf(t) }
    }

    /// The density of [`EquiAngular::sample`] per unit of `t`; 0 outside of the interval.
    #[inline]
    pub fn pdf(&self, t: f32) -> Density<Length> {
        if !(t >= self.interval.t0 && t <= self.interval.t1) {
            return Density::ZERO;
        }
        let from_closest = self.start + (f64::from(t) - f64::from(self.interval.t0));
        let squared = self.distance * self.distance + from_closest * from_closest;
        Density::new((self.distance / (self.angle * squared)).min(f64::from(f32::MAX)) as f32)
    }
}
