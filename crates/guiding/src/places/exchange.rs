//! Regions try what others have found.

use super::place::{Place, nearest};
use glam::Vec3;

/// A place that a region has just found, and how bright it would be one unit away.
struct News {
    place: Place,
    brightness: f32,
}

/// Gives each region the places that any other has found since the last exchange, unless it knows
/// them. They take empty slots, or those of places with less weight. `middles` are those of the
/// regions, `None` where there is none.
///
/// The weight of a place falls with the squared distance, relative to all that a region has: a
/// guess, which the next update corrects. A place that is not visible from a region finds nothing
/// there and fades.
pub(super) fn exchange(places: &mut [Place], stride: usize, middles: &[Option<Vec3>]) {
    let mut news = Vec::new();
    for (own, middle) in places.chunks_mut(stride).zip(middles) {
        let total = total_weight(own);
        for place in own.iter_mut().filter(|place| place.is_new > 0) {
            place.is_new = 0;
            if let (Some(middle), true) = (middle, total > 0.0) {
                let squared = (place.mean() - *middle).length_squared();
                news.push(News {
                    place: *place,
                    brightness: (place.weight() / total).min(MOST) * squared,
                });
            }
        }
    }
    for (own, middle) in places.chunks_mut(stride).zip(middles) {
        let Some(middle) = middle else { continue };
        let total = total_weight(own);
        for News { place, brightness } in &news {
            if nearest(own, place.mean()).is_some() {
                continue;
            }
            let squared = (place.mean() - *middle).length_squared();
            let weight = total * (brightness / squared).min(MOST);
            let least = own.iter_mut().min_by(|a, b| a.weight().total_cmp(&b.weight()));
            if let Some(slot) = least.filter(|slot| slot.weight() < weight) {
                *slot = place.tried(weight);
            }
        }
    }
}

/// Largest share that a place gets before it was tried.
const MOST: f32 = 0.05;

fn total_weight(places: &[Place]) -> f32 {
    places.iter().map(Place::weight).sum()
}
