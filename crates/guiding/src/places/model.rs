//! Places as the model of a field.

use super::block::{PlaceBlock, blocks_of, lightest, nearest, place, places, set_place};
use super::directions::PlaceDirections;
use super::exchange::exchange;
use super::options::PlaceOptions;
use super::place::{Batch, Place};
use crate::GuidingError;
use crate::model::DirectionalModel;
use crate::sample::TrainingSample;
use glam::Vec3;
use lightshed_lanes::LaneChoice;
use lightshed_spatial::Bounds;

/// Distance, in extents of a region, that represents infinity.
const FAR: f32 = 1e5;

/// Up to some dozens of places in each region, in [`PlaceBlock`]s, for scenes with many small
/// lights that no list of lights leads to.
///
/// Each sample belongs to the place within three of whose standard deviations it came from. Another
/// one is a new place: it takes an empty slot or that of the place with least weight. Shares of
/// places follow the weights of their samples, so that directions are sampled in proportion to what
/// they bring.
#[derive(Clone, Debug)]
pub struct PlaceModel {
    options: PlaceOptions,
    lanes: LaneChoice,
}

impl PlaceModel {
    /// Places that are learnt in this way.
    ///
    /// # Errors
    /// [`GuidingError::Option`].
    pub fn new(options: PlaceOptions) -> Result<Self, GuidingError> {
        options.check()?;
        Ok(Self {
            options,
            lanes: LaneChoice::best(),
        })
    }

    /// Shares in proportion to weights, and a part that is the same for all.
    fn share(&self, blocks: &mut [PlaceBlock]) {
        let known = places(blocks).filter(Place::is_known).count();
        let total: f64 = places(blocks).map(|place| f64::from(place.weight())).sum();
        let even = match total > 0.0 {
            true => f64::from(self.options.even_share),
            false => 1.0,
        };
        let (mut sum, mut last) = (0.0, None);
        let mut ends: Vec<f32> = places(blocks)
            .enumerate()
            .map(|(k, place)| {
                if place.is_known() {
                    let share = f64::from(place.weight()) / total.max(f64::MIN_POSITIVE);
                    sum += even / known as f64 + (1.0 - even) * share;
                    last = Some(k);
                }
                sum.min(1.0) as f32
            })
            .collect();
        if let Some(last) = last {
            ends[last..].fill(1.0);
        }
        for (k, cumulative) in ends.into_iter().enumerate() {
            let known = place(blocks, k);
            set_place(blocks, k, Place { cumulative, ..known });
        }
    }

    /// Places of a region.
    fn count(&self) -> usize {
        self.options.places as usize
    }
}

impl DirectionalModel for PlaceModel {
    const ORDERED: bool = true;

    type Record = PlaceBlock;
    type Distribution<'a> = PlaceDirections<'a>;

    fn stride(&self) -> usize {
        blocks_of(self.count())
    }

    fn reset(&self, blocks: &mut [PlaceBlock]) {
        blocks.fill(PlaceBlock::default());
    }

    fn learn(&self, blocks: &mut [PlaceBlock], samples: &[TrainingSample], region: &Bounds) {
        let far = FAR * (region.max - region.min).max_element();
        let mut batches = vec![Batch::default(); self.count()];
        for sample in samples {
            let (position, distance) = (sample.position(), sample.distance().min(far));
            let from = position + sample.direction() * distance;
            let number = nearest(self.lanes, blocks, from).or_else(|| {
                let (least, weight) = lightest(blocks, self.count(), |k| batches[k].weight());
                (weight < f64::from(sample.weight())).then(|| {
                    set_place(blocks, least, Place::found(from, distance, &self.options));
                    batches[least] = Batch::default();
                    least
                })
            });
            if let Some(number) = number {
                batches[number].add(f64::from(sample.weight()), from, f64::from(distance));
            }
        }
        for (number, batch) in batches.iter().enumerate() {
            let mut known = place(blocks, number);
            if known.is_known() {
                known.update(batch, &self.options);
                set_place(blocks, number, known);
            }
        }
        self.share(blocks);
    }

    fn exchange(&self, blocks: &mut [PlaceBlock], middle: impl Fn(u32) -> Option<Vec3>) {
        if self.options.exchanges {
            exchange(self.lanes, blocks, [self.stride(), self.count()], middle);
            blocks
                .chunks_mut(self.stride())
                .for_each(|blocks| self.share(blocks));
        }
    }

    fn directions<'a>(&'a self, blocks: &'a [PlaceBlock], position: Vec3) -> PlaceDirections<'a> {
        PlaceDirections::new(blocks, position, self.lanes)
    }

    fn is_sound(&self, blocks: &[PlaceBlock]) -> bool {
        places(blocks).all(|place| place.is_sound())
    }
}
