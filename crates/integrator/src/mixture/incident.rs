//! What a direction brings.

use crate::emitter_sampler::EmitterSampler;
use crate::path::PathTracer;
use crate::path::transport::{SURVIVAL_CAP, met_emission};
use lightshed_guiding::ApparentDistance;
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Hit, Ray, Rgb, Scene, SurfacePoint};

/// Radiance that arrives along a ray, and its origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incident {
    /// Emitted by the first surface that the ray hits; emitter sampling may find it, too.
    pub met: Rgb,
    /// Everything else: through smooth surfaces, or scattered.
    pub rest: Rgb,
    /// The apparent distance of its origin.
    pub distance: f32,
}

/// Traces rays that leave the points that the camera sees.
pub(super) struct Follower<'a, S> {
    pub scene: &'a Scene,
    pub sampler: &'a S,
    /// Longest path from the camera, in edges.
    pub max_depth: u32,
    /// Distance that stands for infinity.
    pub far: f32,
}

impl<S: EmitterSampler> Follower<'_, S> {
    /// Radiance along `ray`, the second edge of a path, which hit `point`. It continues through
    /// smooth surfaces up to a surface that scatters; from there on paths are those of path
    /// tracing. Also returns the number of further rays, without those behind scattering surfaces.
    pub fn follow(
        &self,
        ray: Ray,
        hit: Option<(Hit, SurfacePoint)>,
        rng: &mut CounterRng,
    ) -> (Incident, usize) {
        let (scene, mut ray) = (self.scene, ray);
        let mut incident = Incident {
            met: met_emission(scene, &ray, hit.as_ref().map(|(_, point)| point)),
            rest: Rgb::ZERO,
            distance: 0.0,
        };
        let (mut apparent, mut length) = (ApparentDistance::new(), self.far);
        let (mut throughput, mut eta_squared) = (Rgb::ONE, 1.0);
        let (mut hit, mut further) = (hit, 0);
        for edges in 2.. {
            length = hit.as_ref().map_or(self.far, |(hit, _)| hit.t.min(self.far));
            let Some((_, point)) = hit.filter(|_| edges < self.max_depth) else {
                break;
            };
            let bsdf = scene.bsdf(&point);
            if bsdf.has_non_delta() {
                let path = self
                    .suffix(edges)
                    .scattered(ray, point, PathSeed::draw(rng).stream());
                incident.rest += throughput * path;
                break;
            }
            let wo = point.shading.to_local(-ray.direction);
            let u_lobe = rng.next_f32();
            let Some(sample) = bsdf.sample(wo, u_lobe, Vec2::from(rng.next_2d())) else {
                break;
            };
            throughput *= sample.weight;
            eta_squared *= sample.eta * sample.eta;
            if edges >= scene.settings().roulette_depth {
                let survival = (throughput.max_element() * eta_squared).min(SURVIVAL_CAP);
                if rng.next_f32() >= survival {
                    break;
                }
                throughput /= survival;
            }
            if throughput == Rgb::ZERO {
                break;
            }
            apparent.pass(length, sample.eta, wo.z, sample.wi.z);
            ray = point.spawn(point.shading.to_world(sample.wi));
            hit = scene.accelerator().intersect(&ray).map(|hit| {
                let point = scene.surface(&ray, &hit);
                (hit, point)
            });
            further += 1;
            incident.rest += throughput * met_emission(scene, &ray, hit.as_ref().map(|(_, point)| point));
        }
        incident.distance = apparent.end(length).min(self.far);
        (incident, further)
    }

    /// Paths that have `edges` edges when they reach a surface.
    fn suffix(&self, edges: u32) -> PathTracer<'_, &S> {
        let before = edges - 1;
        // A path tracer counts the edge that leads to the surface.
        let longest = self.max_depth.saturating_sub(before);
        let unbounded = self.max_depth == u32::MAX;
        let roulette = self.scene.settings().roulette_depth.saturating_sub(before);
        PathTracer::new(self.scene, self.sampler).with_depths((!unbounded).then_some(longest), roulette)
    }
}
