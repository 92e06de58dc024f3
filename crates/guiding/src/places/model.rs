//! Places as the model of a field.

use super::directions::PlaceDirections;
use super::exchange::exchange;
use super::options::PlaceOptions;
use super::place::{Batch, Place, nearest};
use crate::GuidingError;
use crate::model::DirectionalModel;
use crate::sample::TrainingSample;
use glam::Vec3;
use lightshed_spatial::Bounds;

/// Distance, in extents of a region, that represents infinity.
const FAR: f32 = 1e5;

/// Up to some dozens of [`Place`]s in each region, for scenes with many small lights that no list
/// of lights leads to.
///
/// Each sample belongs to the place within three of whose standard deviations it came from. Another
/// one is a new place: it takes an empty slot or that of the place with least weight. Shares of
/// places follow the weights of their samples, so that directions are sampled in proportion to what
/// they bring.
#[derive(Clone, Debug)]
pub struct PlaceModel {
    options: PlaceOptions,
}

impl PlaceModel {
    /// Places that are learnt in this way.
    ///
    /// # Errors
    /// [`GuidingError::Option`].
    pub fn new(options: PlaceOptions) -> Result<Self, GuidingError> {
        options.check()?;
        Ok(Self { options })
    }

    /// Shares in proportion to weights, and a part that is the same for all.
    fn share(&self, places: &mut [Place]) {
        let known = places.iter().filter(|place| place.is_known()).count();
        let total: f64 = places.iter().map(|place| f64::from(place.weight())).sum();
        let even = match total > 0.0 {
            true => f64::from(self.options.even_share),
            false => 1.0,
        };
        let (mut sum, mut last) = (0.0, None);
        for (k, place) in places.iter_mut().enumerate() {
            if place.is_known() {
                let share = f64::from(place.weight()) / total.max(f64::MIN_POSITIVE);
                sum += even / known as f64 + (1.0 - even) * share;
                last = Some(k);
            }
            place.cumulative = sum.min(1.0) as f32;
        }
        if let Some(last) = last {
            places[last..].iter_mut().for_each(|place| place.cumulative = 1.0);
        }
    }
}

impl DirectionalModel for PlaceModel {
    const ORDERED: bool = true;

    type Record = Place;
    type Distribution<'a> = PlaceDirections<'a>;

    fn stride(&self) -> usize {
        self.options.places as usize
    }

    fn reset(&self, places: &mut [Place]) {
        places.fill(Place::default());
    }

    fn learn(&self, places: &mut [Place], samples: &[TrainingSample], region: &Bounds) {
        let far = FAR * (region.max - region.min).max_element();
        let mut batches = vec![Batch::default(); places.len()];
        for sample in samples {
            let (position, distance) = (sample.position(), sample.distance().min(far));
            let from = position + sample.direction() * distance;
            let place = nearest(places, from).or_else(|| {
                let weight = |k: usize| f64::from(places[k].weight()) + batches[k].weight();
                let least = (0..places.len()).min_by(|&a, &b| weight(a).total_cmp(&weight(b)))?;
                (weight(least) < f64::from(sample.weight())).then(|| {
                    places[least] = Place::found(from, distance, &self.options);
                    batches[least] = Batch::default();
                    least
                })
            });
            if let Some(place) = place {
                batches[place].add(f64::from(sample.weight()), from, f64::from(distance));
            }
        }
        for (place, batch) in places
            .iter_mut()
            .zip(&batches)
            .filter(|(place, _)| place.is_known())
        {
            place.update(batch, &self.options);
        }
        self.share(places);
    }

    fn exchange(&self, places: &mut [Place], middles: &[Option<Vec3>]) {
        if self.options.exchanges {
            exchange(places, self.stride(), middles);
            places
                .chunks_mut(self.stride())
                .for_each(|places| self.share(places));
        }
    }

    fn directions<'a>(&'a self, places: &'a [Place], position: Vec3) -> PlaceDirections<'a> {
        PlaceDirections::new(places, position)
    }

    fn is_sound(&self, places: &[Place]) -> bool {
        places.iter().all(Place::is_sound)
    }
}
