//! A lobe around a place, and the same lobe seen from a point.

use crate::vmf::peak_density;
use glam::Vec3;
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle, VonMisesFisher, with_density};

/// A von Mises–Fisher lobe towards a place: from every point it looks in the direction of the
/// place (Dittebrandt 2025 §6.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetLobe {
    target: Vec3,
    concentration: f32,
    /// Density at the mean.
    peak: f32,
    /// Share of the normal in the mean.
    tilt: f32,
}

impl TargetLobe {
    #[inline]
    pub(super) fn new(target: Vec3, concentration: f32, tilt: f32) -> Self {
        Self {
            target,
            concentration,
            peak: peak_density(concentration),
            tilt,
        }
    }

    /// The place.
    #[inline(always)]
    pub fn target(&self) -> Vec3 {
        self.target
    }

    /// The concentration `κ`, 0 to [`MAX_CONCENTRATION`](crate::MAX_CONCENTRATION).
    #[inline(always)]
    pub fn concentration(&self) -> f32 {
        self.concentration
    }

    /// The lobe as seen from a point with the unit `normal`, which only the prior on the mean uses.
    /// At the place itself it has the direction of the normal.
    #[inline]
    pub fn at(&self, point: Vec3, normal: Vec3) -> SeenLobe {
        let towards = (self.target - point).normalize_or(normal);
        let mean = if self.tilt > 0.0 {
            (towards * (1.0 - self.tilt) + normal * self.tilt).normalize_or(towards)
        } else {
            towards
        };
        SeenLobe {
            mean,
            concentration: self.concentration,
            peak: self.peak,
        }
    }
}

/// A [`TargetLobe`] seen from a point:
/// `p_ω = κ/(2π(1 − e^{−2κ})) e^{−½ κ ‖ω − μ‖²}` per steradian.
///
/// Stable for every `κ` from 0 to 10⁶: the exponent keeps its digits where the dot product of
/// near-equal directions loses them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenLobe {
    mean: Vec3,
    concentration: f32,
    peak: f32,
}

impl SeenLobe {
    /// The mean direction `μ`.
    #[inline(always)]
    pub fn mean(&self) -> Vec3 {
        self.mean
    }
}

impl DirectionDistribution for SeenLobe {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        with_density(self, VonMisesFisher::new(self.mean, self.concentration).sample(u))
    }

    #[inline(always)]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        let chord = (direction - self.mean).length_squared();
        Density::new(self.peak * (-0.5 * self.concentration * chord).exp())
    }
}
