//! Uniform scattering in all directions.

use super::{PhaseFunction, ScatteringAngle};
use core::f32::consts::FRAC_1_PI;

/// `p = 1/4π`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Isotropic;

impl PhaseFunction for Isotropic {
    #[inline(always)]
    fn phase_at(&self, _: ScatteringAngle) -> f32 {
        0.25 * FRAC_1_PI
    }

    #[inline(always)]
    fn sample_angle(&self, u: f32) -> ScatteringAngle {
        ScatteringAngle::from_one_minus_cos(2.0 * u)
    }
}
