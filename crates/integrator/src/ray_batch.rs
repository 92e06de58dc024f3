//! Rays that are traced together.

use lightshed_film::MAX_BATCH;
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
