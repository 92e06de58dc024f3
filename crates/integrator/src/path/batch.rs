//! Paths in batches.

use super::connect::connect;
use super::guide::DirectionGuide;
use super::paths::{Paths, Shadows};
use super::purpose::Purpose;
use super::transport::Transport;
use crate::emitter_sampler::EmitterSampler;
use lightshed_film::MAX_BATCH;
use lightshed_scene::{HitBatch, RayBatch};

/// Traces the first `alive` of `paths` to their ends, all at the same depth. Their rays are edges
/// number `depth`; if paths are not allowed that many, nothing is traced.
pub(crate) fn follow<S: EmitterSampler, G: DirectionGuide>(
    transport: &Transport<'_, S, G>,
    paths: &mut Paths<S::Site>,
    alive: usize,
    depth: u32,
    purpose: &mut impl Purpose,
) {
    follow_known(transport, (paths, alive), depth, None, purpose);
}

/// The same for `paths` and their number, where what their current rays hit may be `known`.
pub(crate) fn follow_known<S: EmitterSampler, G: DirectionGuide>(
    transport: &Transport<'_, S, G>,
    paths: (&mut Paths<S::Site>, usize),
    depth: u32,
    known: Option<&HitBatch>,
    purpose: &mut impl Purpose,
) {
    follow_up_to(transport, transport.max_depth, paths, depth, known, purpose);
}

/// The same for paths of at most `longest` edges.
pub(super) fn follow_up_to<S: EmitterSampler, G: DirectionGuide>(
    transport: &Transport<'_, S, G>,
    longest: u32,
    (paths, mut alive): (&mut Paths<S::Site>, usize),
    mut depth: u32,
    mut known: Option<&HitBatch>,
    purpose: &mut impl Purpose,
) {
    if depth > longest {
        return;
    }
    let scene = transport.scene;
    let mut other = Paths::new();
    let (mut paths, mut next) = (paths, &mut other);
    let mut hits = HitBatch::NONE;
    let mut shadows = Shadows::NONE;
    while alive > 0 {
        if depth == longest {
            end(transport, paths, alive, depth, purpose);
            break;
        }
        match known.take() {
            Some(known) => hits.clone_from(known),
            None => scene.accelerator().intersect_batch(&paths.rays, alive, &mut hits),
        }
        scene.prefetch_hits(&hits, alive);
        purpose.hit(scene, depth, (&*paths, alive), &hits);
        let arrived = alive;
        alive = super::shade::shade(
            transport,
            depth,
            (&*paths, alive),
            &hits,
            &mut *next,
            &mut shadows,
            purpose,
        );
        purpose.count(arrived, shadows.count);
        connect(scene, &mut shadows, depth + 1, purpose);
        purpose.sample_further(transport, depth, (&*paths, arrived), &hits);
        depth += 1;
        std::mem::swap(&mut paths, &mut next);
    }
}

/// The last edge of each path: only emission counts, so it is traced against emitters, and further
/// only if there is light to be blocked.
#[inline(never)]
fn end<S: EmitterSampler, G: DirectionGuide>(
    transport: &Transport<'_, S, G>,
    paths: &Paths<S::Site>,
    alive: usize,
    depth: u32,
    purpose: &mut impl Purpose,
) {
    let scene = transport.scene;
    let mut hits = HitBatch::NONE;
    scene.intersect_emitting_batch(&paths.rays, alive, &mut hits);
    let everywhere = scene.emitters().environment().is_some();
    // Rays that still matter, up to the length that matters, and their origins.
    let mut rays = RayBatch::NOWHERE;
    let mut places = [0u8; MAX_BATCH];
    let mut count = 0;
    for index in 0..alive {
        let hit = hits.get(index);
        if everywhere || hit.is_some() {
            let mut ray = paths.rays.get(index);
            ray.t_max = hit.map_or(ray.t_max, |hit| hit.t);
            rays.set(count, &ray);
            places[count % MAX_BATCH] = index as u8;
            count += 1;
        }
    }
    purpose.count(alive, 0);
    let occluded = scene.accelerator().occluded_batch(&rays, count);
    for (number, &place) in places.iter().enumerate().take(count) {
        if occluded >> number & 1 == 0 {
            let index = place as usize;
            let ray = rays.get(number);
            let point = hits.get(index).map(|hit| scene.surface(&ray, &hit));
            let (owner, path) = (paths.owner.get_word(index) as usize, paths.get(index, depth));
            purpose.arrive(transport, owner, depth, &path, &ray, point.as_ref());
        }
    }
}
