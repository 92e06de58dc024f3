//! Two phase functions in one.

use super::{PhaseError, PhaseFunction, ScatteringAngle};
use lightshed_sampling::remap;

/// `p = (1 − b) p₀ + b p₁`. Sampling selects one of the two; the density is that of both
/// together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend<A, B> {
    first: A,
    second: B,
    share: f32,
}

impl<A: PhaseFunction, B: PhaseFunction> Blend<A, B> {
    /// `first` with a part of `second`, its `share` in [0, 1].
    ///
    /// # Errors
    /// [`PhaseError::Share`].
    pub fn new(first: A, second: B, share: f32) -> Result<Self, PhaseError> {
        if (0.0..=1.0).contains(&share) {
            Ok(Self { first, second, share })
        } else {
            Err(PhaseError::Share)
        }
    }
}

impl<A: PhaseFunction, B: PhaseFunction> PhaseFunction for Blend<A, B> {
    #[inline]
    fn phase_at(&self, angle: ScatteringAngle) -> f32 {
        (1.0 - self.share) * self.first.phase_at(angle) + self.share * self.second.phase_at(angle)
    }

    #[inline]
    fn sample_angle(&self, u: f32) -> ScatteringAngle {
        if u < self.share {
            self.second.sample_angle(remap(u, 0.0, self.share))
        } else {
            self.first.sample_angle(remap(u, self.share, 1.0))
        }
    }
}
