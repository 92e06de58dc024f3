//! The Henyey–Greenstein phase function.
//!
//! `p = (1/4π) (1 − g²) / (1 + g² − 2 g cos θ)^{3/2}` (Henyey and Greenstein 1941). In
//! single precision
//! - the denominator is `(1 − |g|)² + 2 |g| (1 ∓ cos θ)`, a sum of positive terms;
//! - the inverse of its distribution function is `1 − cos θ = (1 − g) v (q + 1 − g)/d` for
//!   `g ≥ 0`, with `v` uniform, `d = 1 + g − 2 g v` and `q = (1 − g²)/d`: without the
//!   division by `g` of the usual form, so that `g = 0` is no special case.

use super::{PhaseError, PhaseFunction, ScatteringAngle, check_asymmetry};
use core::f32::consts::FRAC_1_PI;

/// Henyey–Greenstein scattering of asymmetry `g`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HenyeyGreenstein {
    g: f32,
}

impl HenyeyGreenstein {
    /// Of asymmetry `g`, the mean cosine: positive forward, 0 isotropic.
    ///
    /// # Errors
    /// [`PhaseError::Asymmetry`] beyond ±[`MAX_ASYMMETRY`](super::MAX_ASYMMETRY).
    pub fn new(g: f32) -> Result<Self, PhaseError> {
        check_asymmetry(g).map(|g| Self { g })
    }

    /// The mean cosine `g`.
    #[inline(always)]
    pub fn asymmetry(&self) -> f32 {
        self.g
    }
}

impl PhaseFunction for HenyeyGreenstein {
    #[inline]
    fn phase_at(&self, angle: ScatteringAngle) -> f32 {
        let magnitude = self.g.abs();
        let rest = 1.0 - magnitude;
        let squared = rest * rest + 2.0 * magnitude * angle.lobe_ahead(self.g).one_minus_cos;
        0.25 * FRAC_1_PI * rest * (1.0 + magnitude) / (squared * squared.sqrt())
    }

    #[inline]
    fn sample_angle(&self, u: f32) -> ScatteringAngle {
        let magnitude = self.g.abs();
        // Small `u` are the ones with many digits, and they go to the lobe.
        let rest = 1.0 - magnitude;
        let d = rest + 2.0 * magnitude * (1.0 - u);
        let q = rest * (1.0 + magnitude) / d;
        let one_minus_cos = (rest * u * (q + rest) / d).min(2.0);
        ScatteringAngle::from_one_minus_cos(one_minus_cos).lobe_ahead(self.g)
    }
}
