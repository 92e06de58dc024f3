//! How a sampler of emitters samples the environment.

use super::SkySampling;
use lightshed_lanes::Lanes;
use lightshed_sampling::{Density, SolidAngle};

/// How the directions towards an environment are sampled by a sampler of emitters that chooses it
/// with the same probability at every point: a direction of density `p_sky` by
/// [`sky`](Self::sky) has the density `P p_sky`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentChoice {
    sky: SkySampling,
    share: f32,
    probability: f32,
}

impl EnvironmentChoice {
    /// The environment is chosen with `probability`.
    #[inline(always)]
    pub fn new(sky: SkySampling, probability: f32) -> Self {
        Self {
            sky,
            share: probability,
            probability: 1.0,
        }
    }

    /// The same where that choice is made with `probability`.
    #[inline(always)]
    #[must_use]
    pub fn chosen_with(self, probability: f32) -> Self {
        Self {
            probability: self.probability * probability,
            ..self
        }
    }

    /// Which directions are sampled.
    #[inline(always)]
    pub fn sky(self) -> SkySampling {
        self.sky
    }

    /// `P p_sky`, from `p_sky`.
    #[inline(always)]
    pub fn pdf(self, of_sky: Density<SolidAngle>) -> Density<SolidAngle> {
        of_sky * self.share * self.probability
    }

    /// [`pdf`](Self::pdf) of eight densities per solid angle, bit for bit.
    #[inline(always)]
    pub fn pdf_lanes<L: Lanes>(self, of_sky: L) -> L {
        of_sky * L::splat(self.share) * L::splat(self.probability)
    }
}
