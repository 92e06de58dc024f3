//! The von Mises–Fisher distribution on the sphere.
//!
//! `p_ω = κ / (2π (1 − e^{−2κ})) · e^{κ(μ·ω − 1)}`, with mean direction `μ` and
//! concentration `κ ≥ 0`; 1/4π at `κ = 0`.
//!
//! In single precision the usual forms lose every digit as `κ` grows. Here
//! - `κ(μ·ω − 1)` is `−½ κ ‖ω − μ‖²`: the dot product of near-equal vectors is
//!   off by 6·10⁻⁸, times `κ`;
//! - `1 − e^{−2κ}` is `−expm1(−2κ)`, and both it and `κ` vanish together;
//! - samples are `s = 1 − cos θ = −ln1p(u₀ expm1(−2κ))/κ`, `sin θ = √(s(2 − s))`.

use super::clamp_or_low;
use super::turn::{sin_cos_turns, turns_of};
use crate::{Density, Frame, ONE_MINUS_EPSILON, SolidAngle};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Beyond this concentration a lobe is narrower than `f32` directions resolve.
const MAX_CONCENTRATION: f32 = 1e7;

/// Below this the distribution is uniform up to rounding, and `0/0` near.
const MIN_CONCENTRATION: f32 = 1e-7;

/// A von Mises–Fisher distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VonMisesFisher {
    frame: Frame,
    concentration: f32,
    /// `expm1(−2κ)`.
    span: f32,
    /// `κ / (2π (1 − e^{−2κ}))`, the density at the mean.
    peak: f32,
}

impl VonMisesFisher {
    /// A lobe around the direction of `mean` (normalised; z if it has none). The concentration is
    /// clamped to [0, 10⁷]; NaN becomes 0.
    #[inline]
    pub fn new(mean: Vec3, concentration: f32) -> Self {
        let concentration = clamp_or_low(concentration, 0.0, MAX_CONCENTRATION);
        let span = (-2.0 * concentration).exp_m1();
        let peak = if concentration > MIN_CONCENTRATION {
            -0.5 * FRAC_1_PI * concentration / span
        } else {
            0.25 * FRAC_1_PI
        };
        Self {
            frame: Frame::from_normal(mean.normalize_or(Vec3::Z)),
            concentration,
            span,
            peak,
        }
    }

    /// The mean direction `μ`.
    #[inline(always)]
    pub fn mean(&self) -> Vec3 {
        self.frame.normal
    }

    /// The concentration `κ` after clamping.
    #[inline(always)]
    pub fn concentration(&self) -> f32 {
        self.concentration
    }

    /// Maps `u` in [0, 1)² to a unit direction.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        let one_minus_cos = if self.concentration > MIN_CONCENTRATION {
            (-(u[0] * self.span).ln_1p() / self.concentration).min(2.0)
        } else {
            2.0 * u[0]
        };
        let sin_theta = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u[1]);
        self.frame.to_world(Vec3::new(
            sin_theta * cos_phi,
            sin_theta * sin_phi,
            1.0 - one_minus_cos,
        ))
    }

    /// Density of [`VonMisesFisher::sample`] per solid angle, of a unit direction. May underflow to
    /// zero far from the mean (from `κ(1 − cos θ) ≈ 100` on), where samples never fall.
    ///
    /// # Precision
    /// Relative error about 10⁻⁷ κ θ, from the rounding of the direction itself.
    #[inline]
    pub fn density(&self, direction: Vec3) -> Density<SolidAngle> {
        let chord_squared = (direction - self.frame.normal).length_squared();
        Density::new(self.peak * (-0.5 * self.concentration * chord_squared).exp())
    }

    /// The `u` that [`VonMisesFisher::sample`] maps to the unit direction, within about
    /// `10⁻⁷ (1 + √κ)` in the first coordinate and `10⁻⁷ (1 + 1/sin θ)` in the second:
    /// what the rounding of the direction leaves.
    #[inline]
    pub fn invert(&self, direction: Vec3) -> [f32; 2] {
        let local = self.frame.to_local(direction);
        let one_minus_cos = 0.5 * (direction - self.frame.normal).length_squared();
        let u0 = if self.concentration > MIN_CONCENTRATION {
            (-self.concentration * one_minus_cos).exp_m1() / self.span
        } else {
            0.5 * one_minus_cos
        };
        [u0.clamp(0.0, ONE_MINUS_EPSILON), turns_of(local.x, local.y)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart, assert_frozen, verify};
    use core::f64::consts::{PI, TAU};
    use lightshed_testkit::check_faults;

    #[test]
    fn properties_hold_at_every_concentration() {
        let tilted = Vec3::new(0.48, -0.6, 0.64);
        for (mean, kappa, (integral, jacobian, inverse)) in [
            (tilted, 0.0f32, (1e-5, 1e-3, 2e-6)),
            (tilted, 1e-8, (1e-5, 1e-3, 2e-6)),
            (tilted, 1e-6, (1e-5, 1e-3, 2e-6)),
            (tilted, 1e-3, (1e-5, 1e-3, 2e-6)),
            (tilted, 1.0, (1e-5, 1e-3, 2e-6)),
            (-tilted, 88.0, (1e-5, 2e-3, 1e-5)),
            (tilted, 1e4, (1e-4, 5e-3, 1e-4)),
            (tilted, 1e5, (1e-4, f64::INFINITY, 3e-4)),
            (tilted, 1e7, (1e-3, f64::INFINITY, 3e-3)),
            // Around an axis the directions keep their digits; around others they round to
            // 10⁻⁷, a thousandth of the width of the narrowest lobe.
            (Vec3::Z, 1e5, (1e-5, 2e-3, 1e-5)),
            (Vec3::Z, 1e7, (1e-5, 2e-3, 1e-5)),
        ] {
            let lobe = VonMisesFisher::new(mean, kappa);
            let width = 1.0 / f64::from(kappa.max(1.0)).sqrt();
            // Beyond, the integral over the chart is below the tolerance and its density
            // underflows.
            let maximum = (8.0 * width).min(PI);
            let case = Case::directions(
                format!("vMF {kappa}"),
                Chart::cap(lobe.mean(), width, maximum),
                move |u| lobe.sample(u),
                move |d| lobe.density(d).value(),
                move |d| Some(lobe.invert(d)),
            );
            verify(&case.tolerances(integral, jacobian, inverse));
        }
    }

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        DotProductForm,
        OverflowingNorm,
    }

    #[test]
    fn the_density_agrees_with_double_precision() {
        check_faults(&[Fault::DotProductForm, Fault::OverflowingNorm], |fault| {
            for kappa in [0.0f32, 1e-7, 1e-4, 0.1, 10.0, 100.0, 1e4, 1e6, 1e7] {
                let lobe = VonMisesFisher::new(Vec3::new(0.48, -0.6, 0.64), kappa);
                for i in 1..40 {
                    let d = lobe.sample([i as f32 / 40.0, 0.3]);
                    let mean = lobe.mean();
                    let density = match fault {
                        None => lobe.density(d).value(),
                        Some(Fault::DotProductForm) => lobe.peak * (kappa * (mean.dot(d) - 1.0)).exp(),
                        Some(Fault::OverflowingNorm) => {
                            0.25 * FRAC_1_PI * kappa / kappa.sinh() * (kappa * mean.dot(d)).exp()
                        }
                    };
                    let chord: f64 = (0..3)
                        .map(|k| (f64::from(d[k]) - f64::from(mean[k])).powi(2))
                        .sum();
                    let kappa = f64::from(kappa);
                    let peak = if kappa == 0.0 {
                        0.5 / TAU
                    } else {
                        -kappa / (TAU * (-2.0 * kappa).exp_m1())
                    };
                    let truth = peak * (-0.5 * kappa * chord).exp();
                    if !((f64::from(density) / truth - 1.0).abs() < 2e-6) {
                        return Err((kappa, density, truth));
                    }
                }
            }
            Ok(())
        })
        .unwrap();
    }

    #[test]
    fn degenerate_lobes_are_defined() {
        for (mean, kappa) in [
            (Vec3::ZERO, 10.0),
            (Vec3::Z, f32::NAN),
            (Vec3::Z, -1.0),
            (Vec3::X, f32::INFINITY),
            (-Vec3::Z, f32::MAX),
        ] {
            let lobe = VonMisesFisher::new(mean, kappa);
            for d in [Vec3::X, -Vec3::X, Vec3::Z, -Vec3::Z, lobe.sample([0.3, 0.6])] {
                assert!(lobe.density(d).value().is_finite());
                assert!(lobe.invert(d).iter().all(|x| (0.0..1.0).contains(x)));
            }
        }
        assert_eq!(
            VonMisesFisher::new(Vec3::Z, f32::NAN).density(Vec3::X).value(),
            0.25 * FRAC_1_PI
        );
    }

    #[test]
    fn values_are_stable() {
        assert_frozen(
            |u| VonMisesFisher::new(Vec3::new(0.48, -0.6, 0.64), 20.0).sample(u),
            [
                Vec3::new(0.52181906, -0.5151844, 0.679919),
                Vec3::new(0.4175328, -0.7829019, 0.46122777),
                Vec3::new(0.39255837, -0.25060496, 0.88492656),
            ],
        );
    }
}
