//! Regions try what others have found.

use super::block::{PlaceBlock, lightest, nearest, place, set_place, total_weight};
use super::place::Place;
use glam::Vec3;
use lightshed_lanes::LaneChoice;

/// A place that a region has just found, and how bright it would be one unit away.
struct News {
    place: Place,
    brightness: f32,
}

/// Gives each region the places that any other has found since the last exchange, unless it knows
/// them. They take empty slots, or those of places with less weight. `middle` has those of the
/// regions, `None` where there is none.
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
    let mut news = Vec::new();
    for (own, region) in blocks.chunks_mut(stride).zip(0..) {
        let total = total_weight(own);
        for number in 0..count {
            let found = place(own, number);
            if found.is_new == 0 {
                continue;
            }
            set_place(own, number, Place { is_new: 0, ..found });
            if total > 0.0
                && let Some(middle) = middle(region)
            {
                let squared = (found.mean() - middle).length_squared();
                news.push(News {
                    place: found,
                    brightness: (found.weight() / total).min(MOST) * squared,
                });
            }
        }
    }
    for (own, region) in blocks.chunks_mut(stride).zip(0..) {
        let Some(middle) = middle(region) else { continue };
        let total = total_weight(own);
        for News { place, brightness } in &news {
            if nearest(lanes, own, place.mean()).is_some() {
                continue;
            }
            let squared = (place.mean() - middle).length_squared();
            let weight = total * (brightness / squared).min(MOST);
            let (slot, least) = lightest(own, count, |_| 0.0);
            if least < f64::from(weight) {
                set_place(own, slot, place.tried(weight));
            }
        }
    }
}

/// Largest share that a place gets before it was tried.
const MOST: f32 = 0.05;
