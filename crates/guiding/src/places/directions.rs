//! The lobes of a region's places, as seen from a position.

use super::place::Place;
use glam::Vec3;
use lightshed_sampling::{
    Density, DirectionDistribution, ONE_MINUS_EPSILON, SolidAngle, VonMisesFisher, with_density,
};

/// `p_ω = Σ_k π_k p_k(ω)` over the places of a region, per steradian.
#[derive(Clone, Copy, Debug)]
pub struct PlaceDirections<'a> {
    /// With ascending cumulative shares; the last is 1 unless all are empty.
    places: &'a [Place],
    position: Vec3,
}

impl<'a> PlaceDirections<'a> {
    pub(super) fn new(places: &'a [Place], position: Vec3) -> Self {
        Self { places, position }
    }
}

impl DirectionDistribution for PlaceDirections<'_> {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let k = self.places.partition_point(|place| place.cumulative <= u[0]);
        let place = self.places.get(k)?;
        let before = k
            .checked_sub(1)
            .map_or(0.0, |before| self.places[before].cumulative);
        let within = (u[0] - before) / (place.cumulative - before);
        let to = place.mean() - self.position;
        let lobe = VonMisesFisher::new(to.normalize_or(Vec3::Z), place.concentration(to));
        with_density(self, lobe.sample([within.clamp(0.0, ONE_MINUS_EPSILON), u[1]]))
    }

    #[inline]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        let (mut before, mut density) = (0.0, 0.0);
        for place in self.places {
            let share = place.cumulative - before;
            before = place.cumulative;
            if share > 0.0 {
                density += share * place.density(place.mean() - self.position, direction);
            }
        }
        Density::new(density)
    }
}
