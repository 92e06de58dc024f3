//! Free flight through a homogeneous medium.
//!
//! Distances `t ≥ 0` with density `p(t) = σ e^{−σt}` per unit length: the first collision of
//! a photon in a medium of collision coefficient `σ`. `t = −ln(1 − u)/σ`.

use crate::{Density, Length, ONE_MINUS_EPSILON};

/// Exponentially distributed distances of rate `σ > 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeFlight {
    rate: f32,
}

impl FreeFlight {
    /// Flight through a medium of collision coefficient `σ` per unit length; `None` unless it is
    /// positive and finite. In a medium without collisions there is nothing to sample: the segment
    /// is crossed without drawing a number.
    #[inline(always)]
    pub fn new(rate: f32) -> Option<Self> {
        if rate > 0.0 && rate <= f32::MAX {
            Some(Self { rate })
        } else {
            None
        }
    }

    /// Maps `u` in [0, 1) to a distance; finite (at most 17/σ, and at most `f32::MAX`).
    #[inline(always)]
    pub fn sample(&self, u: f32) -> f32 {
        (-(-u).ln_1p() / self.rate).min(f32::MAX)
    }

    /// Density of [`FreeFlight::sample`], per unit length; 0 for negative distances.
    #[inline(always)]
    pub fn density(&self, distance: f32) -> Density<Length> {
        if distance >= 0.0 {
            Density::new(self.rate * self.transmittance(distance))
        } else {
            Density::ZERO
        }
    }

    /// The probability `e^{−σt}` of getting farther than `distance`; 1 for negative distances.
    #[inline(always)]
    pub fn transmittance(&self, distance: f32) -> f32 {
        (-self.rate * distance.max(0.0)).exp()
    }

    /// The `u` that [`FreeFlight::sample`] maps to `distance`, within 2·10⁻⁷; 0 for negative
    /// distances.
    #[inline]
    pub fn invert(&self, distance: f32) -> f32 {
        (-(-self.rate * distance.max(0.0)).exp_m1()).min(ONE_MINUS_EPSILON)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};
    use glam::{Vec2, Vec3};

    #[test]
    fn properties_hold() {
        for rate in [1e-6f32, 0.3, 1.0, 1e5] {
            let flight = FreeFlight::new(rate).unwrap();
            verify(
                &Case::plane(
                    format!("free flight {rate}"),
                    Chart::half_line(f64::from(rate)),
                    move |u| Vec2::new(flight.sample(u[0]), u[1]),
                    move |p| flight.density(p.x).value(),
                    move |p| Some([flight.invert(p.x), p.y]),
                )
                .tolerances(1e-5, 1e-3, 3e-7),
            );
        }
    }

    #[test]
    fn extreme_media_are_defined() {
        for rate in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(FreeFlight::new(rate).is_none());
        }
        for rate in [1e-45, f32::MIN_POSITIVE, 1e30, f32::MAX] {
            let flight = FreeFlight::new(rate).unwrap();
            assert_eq!(flight.sample(0.0), 0.0);
            for t in [flight.sample(ONE_MINUS_EPSILON), 0.0, -1.0, f32::MAX] {
                assert!(
                    t.is_finite() && flight.density(t).value().is_finite() && flight.transmittance(t) <= 1.0
                );
                assert!((0.0..1.0).contains(&flight.invert(t)));
            }
        }
    }

    #[test]
    fn small_distances_keep_their_digits() {
        let flight = FreeFlight::new(1.0).unwrap();
        assert!((flight.sample(1e-7) / 1e-7 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn values_are_stable() {
        assert_frozen(
            |u| Vec3::new(FreeFlight::new(0.5).unwrap().sample(u[0]), u[1], 0.0),
            [
                Vec3::new(0.21072103, 0.2, 0.0),
                Vec3::new(1.3862944, 0.75, 0.0),
                Vec3::new(3.7942402, 0.3, 0.0),
            ],
        );
    }
}
