//! Suffixes of paths, behind their reconnection vertices: the path tracer's batches, told what they find path by path.

use super::batch::{Paths, follow};
use super::purpose::Purpose;
use super::{PathState, PathTracer};
use crate::path::next_event::{Bounce, SampleCounts, emitted_radiance};
use lightshed_film::MAX_BATCH;
use lightshed_lanes::Lanes;
use lightshed_sampling::PathSeed;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Ray, Rgb, Scene, SurfacePoint};
use lightshed_shift::{Suffix, SuffixLight, SuffixLimits};

/// Traces suffixes as [`WorldLighting::trace_suffixes`](lightshed_shift::WorldLighting::trace_suffixes) asks for; returns how many rays went on
/// and how many to emitters.
pub(crate) fn trace_suffixes(
    scene: &Scene,
    suffixes: &[Suffix<Ray, Vec3>],
    limits: SuffixLimits,
    visit: &mut dyn FnMut(usize, SuffixLight),
) -> [usize; 2] {
    if suffixes.is_empty() || limits.first > limits.max_length {
        return [0; 2];
    }
    let tracer = PathTracer::with_depths(scene, Some(limits.max_length), limits.roulette_from);
    let mut paths = Paths::NONE;
    let mut rays = [0; 2];
    for (chunk, suffixes) in suffixes.chunks(MAX_BATCH).enumerate() {
        for (index, suffix) in suffixes.iter().enumerate() {
            let state = PathState {
                throughput: Rgb::ONE,
                // Roulette judges by the product of this and the throughput.
                eta_squared: suffix.importance,
                bounce: Some(Bounce {
                    from: suffix.site,
                    pdf: suffix.total_pdf,
                    is_delta: false,
                    counts: SampleCounts::ONE_EACH,
                }),
            };
            paths.set(index, &state, &suffix.ray);
            for (name, word) in paths.name.iter_mut().zip(suffix.seed.words()) {
                name.set_word(index, word);
            }
            paths.owner.set_word(index, index as u32);
        }
        let mut found = Found {
            begin: chunk * MAX_BATCH,
            first: limits.first,
            visit: &mut *visit,
            rays: &mut rays,
        };
        follow(&tracer, &mut paths, suffixes.len(), limits.first, &mut found);
    }
    rays
}

/// Light behind reconnection vertices.
struct Found<'a> {
    /// Number of the batch's first suffix.
    begin: usize,
    /// Number of the edges that lead away from the reconnection vertices.
    first: u32,
    visit: &'a mut dyn FnMut(usize, SuffixLight),
    rays: &'a mut [usize; 2],
}

impl Purpose for Found<'_> {
    #[inline(always)]
    fn words<L: Lanes>(&self, seeds: [L::Words; 2], block: u32) -> [L::Words; 4] {
        PathSeed::block_lanes::<L>(seeds, block)
    }

    fn arrive(
        &mut self,
        scene: &Scene,
        place: usize,
        depth: u32,
        path: &PathState,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) {
        let light = if depth == self.first {
            let Some(bounce) = path.bounce else { return };
            let Some((radiance, emitter_pdf)) = emitted_radiance(scene, ray, point, bounce.from) else {
                return;
            };
            SuffixLight::Met {
                radiance,
                emitter_pdf,
            }
        } else {
            let radiance = path.emission(scene, ray, point);
            if radiance == Rgb::ZERO {
                return;
            }
            SuffixLight::Scattered {
                length: depth,
                is_sampled_emitter: false,
                radiance,
            }
        };
        (self.visit)(self.begin + place, light);
    }

    fn connect(&mut self, place: usize, length: u32, radiance: Rgb) {
        let light = SuffixLight::Scattered {
            length,
            is_sampled_emitter: true,
            radiance,
        };
        (self.visit)(self.begin + place, light);
    }

    fn count(&mut self, path: usize, emitter: usize) {
        self.rays[0] += path;
        self.rays[1] += emitter;
    }
}
