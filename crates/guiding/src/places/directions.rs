//! The lobes of a region's places, as seen from a position.

use super::block::{PlaceBlock, density, selected};
use glam::Vec3;
use lightshed_lanes::LaneChoice;
use lightshed_sampling::{
    Density, DirectionDistribution, ONE_MINUS_EPSILON, SolidAngle, VonMisesFisher, with_density,
};

/// `p_ω = Σ_k π_k p_k(ω)` over the places of a region, per steradian.
#[derive(Clone, Copy, Debug)]
pub struct PlaceDirections<'a> {
    /// With ascending cumulative shares; the last is 1 unless all are empty.
    blocks: &'a [PlaceBlock],
    position: Vec3,
    lanes: LaneChoice,
}

impl<'a> PlaceDirections<'a> {
    pub(super) fn new(blocks: &'a [PlaceBlock], position: Vec3, lanes: LaneChoice) -> Self {
        Self {
            blocks,
            position,
            lanes,
        }
    }
}

impl DirectionDistribution for PlaceDirections<'_> {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let (place, before) = selected(self.blocks, u[0])?;
        let within = (u[0] - before) / (place.cumulative - before);
        let to = place.mean() - self.position;
        let lobe = VonMisesFisher::new(to.normalize_or(Vec3::Z), place.concentration(to));
        with_density(self, lobe.sample([within.clamp(0.0, ONE_MINUS_EPSILON), u[1]]))
    }

    #[inline]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        Density::new(density(self.lanes, self.blocks, self.position, direction))
    }
}
