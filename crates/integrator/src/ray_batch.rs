//! Rays that are traced together.

use lightshed_film::{MAX_BATCH, RayKind, RayTally};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Hit, Ray, Scene};

/// In unused places of a batch.
pub(crate) const NOWHERE: Ray = Ray {
    origin: Vec3::ZERO,
    direction: Vec3::Z,
    t_max: 0.0,
};

/// Traces rays for which only emission matters: `hits` are the nearest emitting surfaces,
/// `occluded` whether something else is in front of them, or of the environment. If nothing emits,
/// nothing is traced.
pub(crate) fn see_emitters(scene: &Scene, rays: &mut [Ray], hits: &mut [Option<Hit>], occluded: &mut [bool]) {
    scene.intersect_emitting_many(rays, hits);
    let everywhere = scene.emitters().environment().is_some();
    let (mut kept, mut places) = (0, [0; MAX_BATCH]);
    for place in 0..rays.len() {
        let ray = rays[place];
        // Rays that are not asked about count as hidden.
        occluded[place] = true;
        if everywhere || hits[place].is_some() {
            rays[kept] = Ray {
                t_max: hits[place].map_or(ray.t_max, |hit| hit.t),
                ..ray
            };
            places[kept] = place;
            kept += 1;
        }
    }
    let mut hidden = [false; MAX_BATCH];
    scene
        .accelerator()
        .occluded_many(&rays[..kept], &mut hidden[..kept]);
    for (&place, hidden) in places[..kept].iter().zip(hidden) {
        occluded[place] = hidden;
    }
}

/// Passes on the contributions of the unoccluded segments; at most [`MAX_BATCH`] with their owners.
pub(crate) fn add_unhidden<T: Copy>(
    scene: &Scene,
    tally: &RayTally,
    segments: &[(usize, Ray, T)],
    mut add: impl FnMut(usize, T),
) {
    let (mut rays, mut hidden) = ([NOWHERE; MAX_BATCH], [false; MAX_BATCH]);
    let count = segments.len().min(MAX_BATCH);
    for (ray, (_, segment, _)) in rays.iter_mut().zip(segments) {
        *ray = *segment;
    }
    tally.add(RayKind::Emitter, count);
    scene
        .accelerator()
        .occluded_many(&rays[..count], &mut hidden[..count]);
    for ((owner, _, brought), hidden) in segments.iter().zip(hidden) {
        if !hidden {
            add(*owner, *brought);
        }
    }
}
