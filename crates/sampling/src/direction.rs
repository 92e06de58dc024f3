//! Directions that can be sampled.

use crate::{Density, SolidAngle};
use glam::Vec3;

/// A distribution of unit directions with a known density: a lobe, a guide's record of where light comes from, a mixture.
///
/// `∫ p(ω) dω ≤ 1` over the sphere; what is missing is the probability of no direction at all. For any integrand `f` that is zero
/// where `p` is, `∫ f(ω) dω = E[f(ω) / p(ω)]`, where a sample that is none counts as zero.
pub trait DirectionDistribution {
    /// Maps `u`, uniform in [0, 1)², to a direction and its density, which is that of [`pdf`](Self::pdf) to rounding. `None` is a
    /// sample of value zero.
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)>;

    /// Density of a unit direction, finite and not negative.
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle>;
}

impl<D: DirectionDistribution + ?Sized> DirectionDistribution for &D {
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        (**self).sample(u)
    }

    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        (**self).pdf(direction)
    }
}
