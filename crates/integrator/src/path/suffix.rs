//! Suffixes of paths, behind their reconnection vertices: the path tracer's batches report their
//! results path by path.

use super::batch::follow;
use super::guide::DirectionGuide;
use super::paths::Paths;
use super::purpose::Purpose;
use super::transport::{Bounce, PathState, Transport, met_emission};
use crate::emitter_sampler::EmitterSampler;
use lightshed_film::MAX_BATCH;
use lightshed_lanes::Lanes;
use lightshed_sampling::PathSeed;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Ray, Rgb, SurfacePoint};
use lightshed_shift::{Suffix, SuffixLight, SuffixLimits};

/// Traces suffixes as
/// [`WorldLighting::trace_suffixes`](lightshed_shift::WorldLighting::trace_suffixes) requires;
/// returns how many rays continued and how many went to emitters.
pub(crate) fn trace_suffixes<S: EmitterSampler, G: DirectionGuide>(
    transport: Transport<'_, S, G>,
    suffixes: &[Suffix<Ray, (Vec3, S::Site)>],
    limits: SuffixLimits,
    visit: &mut dyn FnMut(usize, SuffixLight),
) -> [usize; 2] {
    if suffixes.is_empty() || limits.first > limits.max_length {
        return [0; 2];
    }
    let transport = Transport {
        max_depth: limits.max_length,
        roulette_depth: limits.roulette_from,
        ..transport
    };
    let mut paths = Paths::new();
    let mut rays = [0; 2];
    for (chunk, suffixes) in suffixes.chunks(MAX_BATCH).enumerate() {
        for (index, suffix) in suffixes.iter().enumerate() {
            let state = PathState {
                throughput: Rgb::ONE,
                // Roulette judges by the product of this and the throughput.
                eta_squared: suffix.importance,
                bounce: Some(Bounce {
                    from: suffix.site.0,
                    site: suffix.site.1,
                    pdf: suffix.total_pdf,
                    is_delta: false,
                }),
            };
            paths.begin(index, &state, &suffix.ray, suffix.seed.words(), index);
        }
        let mut found = Found {
            begin: chunk * MAX_BATCH,
            first: limits.first,
            visit: &mut *visit,
            rays: &mut rays,
        };
        follow(&transport, &mut paths, suffixes.len(), limits.first, &mut found);
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

    fn arrive<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        transport: &Transport<'_, S, G>,
        place: usize,
        depth: u32,
        path: &PathState<S::Site>,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) {
        let light = if depth == self.first {
            let radiance = met_emission(transport.scene, ray, point);
            let Some(bounce) = path.bounce.filter(|_| radiance != Rgb::ZERO) else {
                return;
            };
            SuffixLight::Met {
                radiance,
                emitter_pdf: match point {
                    Some(point) => transport.sampler.endpoint_pdf(bounce.from, &bounce.site, point),
                    None => bounce.emitter_pdf(&transport.sampler, ray, None),
                },
            }
        } else {
            let radiance = path.throughput * path.met(transport.scene, &transport.sampler, ray, point);
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
