//! Regions try what others have found.

use super::block::{PlaceBlock, known_near, lightest, nearest, place, set_place, total_weight};
use super::place::{NEAR, Place};
use glam::Vec3;
use lightshed_lanes::{LANES, LaneChoice};

/// A place that some regions have found, as all together know it.
#[derive(Clone, Copy)]
struct Found {
    place: Place,
    /// How bright it would be one unit away, relative to all that a region has: the mean over its
    /// samples.
    brightness: f64,
    samples: f64,
}

/// Gives each region the places that any other has found, unless it knows them. They take empty
/// slots, or those of places with less weight. `middle` has those of the regions, `None` where
/// there is none.
///
/// Places of several regions that lie within three standard deviations of that with most samples
/// are one. A region knows a place if one of its own lies as near to it, however wide its own is:
/// what seems to be one place from afar are several.
///
/// The weight of a place falls with the squared distance, relative to all that a region has: a
/// guess, which the next update corrects. A place that is not visible from a region finds nothing
/// there and fades.
pub(super) fn exchange(
    lanes: LaneChoice,
    blocks: &mut [PlaceBlock],
    [stride, count]: [usize; 2],
    middle: impl Fn(u32) -> Option<Vec3>,
) {
    let found = all_found(lanes, blocks, [stride, count], &middle);
    for (own, region) in blocks.chunks_mut(stride).zip(0..) {
        let Some(middle) = middle(region) else { continue };
        let total = total_weight(own);
        for Found {
            place, brightness, ..
        } in &found
        {
            if known_near(lanes, own, place.mean(), NEAR * place.spread) {
                continue;
            }
            let squared = (place.mean() - middle).length_squared();
            let weight = total * (*brightness as f32 / squared).min(MOST);
            let (slot, least) = lightest(own, count, |_| 0.0);
            if least < f64::from(weight) {
                set_place(own, slot, place.tried(weight));
            }
        }
    }
}

/// What regions have found themselves, each place once: those with most samples first.
fn all_found(
    lanes: LaneChoice,
    blocks: &[PlaceBlock],
    [stride, count]: [usize; 2],
    middle: impl Fn(u32) -> Option<Vec3>,
) -> Vec<Found> {
    let mut candidates = Vec::new();
    for (own, region) in blocks.chunks(stride).zip(0..) {
        let total = total_weight(own);
        let Some(middle) = middle(region).filter(|_| total > 0.0) else {
            continue;
        };
        for place in (0..count).map(|number| place(own, number)) {
            if place.is_known() && place.count > 0.0 {
                let squared = f64::from((place.mean() - middle).length_squared());
                candidates.push(Found {
                    place,
                    brightness: f64::from(place.weight() / total) * squared,
                    samples: f64::from(place.count),
                });
            }
        }
    }
    let key = |found: &Found| (found.place.count, found.place.spread, found.place.mean);
    candidates.sort_by(|a, b| {
        let ((count, spread, mean), (of_count, of_spread, of_mean)) = (key(a), key(b));
        let by_mean = || mean.map(f32::to_bits).cmp(&of_mean.map(f32::to_bits));
        of_count
            .total_cmp(&count)
            .then_with(|| spread.total_cmp(&of_spread))
            .then_with(by_mean)
    });
    let mut all: Vec<Found> = Vec::new();
    let mut middles = Vec::<PlaceBlock>::new();
    for candidate in candidates {
        match nearest(lanes, &middles, candidate.place.mean()) {
            Some(number) => {
                let known = &mut all[number];
                let samples = known.samples + candidate.samples;
                let share = candidate.samples / samples;
                known.brightness += share * (candidate.brightness - known.brightness);
                known.samples = samples;
            }
            None if all.len() < MOST_FOUND => {
                if all.len().is_multiple_of(LANES) {
                    middles.push(PlaceBlock::default());
                }
                set_place(&mut middles, all.len(), candidate.place);
                all.push(candidate);
            }
            None => {}
        }
    }
    all
}

/// Largest share that a place gets before it was tried.
const MOST: f32 = 0.05;
/// Most places that regions exchange: those with most samples.
const MOST_FOUND: usize = 1024;
