//! Camera paths: the diffuse point that VPLs light, and all light that does not come from VPLs.

use crate::emitter_sampler::EmitterSampler;
use crate::path::scattering::{SurfaceVertex, Vertex};
use crate::path::transport::{Bounce, PathState, Transport, VertexStream};
use lightshed_film::RayCounts;
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Bsdf, Ray, Rgb};

/// Greatest number of mirrors and panes on a camera path.
const MAX_DELTA_BOUNCES: u32 = 16;

/// A point that virtual point lights light, as one pixel sample sees it.
#[derive(Clone)]
pub(super) struct Receiver {
    pub vertex: SurfaceVertex,
    /// Share of what leaves the point that reaches the pixel.
    pub throughput: Rgb,
    /// Length of the path from the camera.
    pub distance: f32,
}

/// One sample of a pixel, without the light of VPLs.
#[derive(Clone, Default)]
pub(super) struct CameraSample {
    /// Light from emitters: seen directly, by one scattering, and through any number of mirrors in
    /// between.
    pub direct: Rgb,
    /// The first point along the path that is not only a mirror, if there is one.
    pub receiver: Option<Receiver>,
}

/// Follows a camera ray through mirrors and panes to the first point that scatters in all
/// directions.
///
/// The direct part is that of a path tracer: emission with its MIS weight, one emitter sample at
/// the receiver, and one sample of its BSDF. That sample continues through mirrors as well, where
/// it alone can find the light, so caustics of area lights are rendered. If a surface both mirrors
/// and scatters, one of the two is followed, by its probability.
pub(super) fn camera_sample<S: EmitterSampler>(
    transport: &Transport<'_, S>,
    ray: Ray,
    rng: &mut CounterRng,
    rays: &mut RayCounts,
) -> CameraSample {
    let scene = transport.scene;
    let mut sample = CameraSample::default();
    let (mut ray, mut path) = (ray, PathState::START);
    let mut distance = 0.0;
    for depth in 0..=MAX_DELTA_BOUNCES {
        if depth == 0 {
            rays.camera += 1;
        } else {
            rays.path += 1;
        }
        let met = scene.intersect(&ray);
        sample.direct += path.throughput * path.met(scene, &transport.sampler, &ray, met.as_ref());
        let Some(point) = met else {
            break;
        };
        distance += point.position.distance(ray.origin);
        let vertex = SurfaceVertex::new(scene, &ray, point);
        let (at, site) = (transport.scattering(&vertex), transport.site(&vertex));
        let u_lobe = rng.lobe();
        let next = at.sample(u_lobe, rng.direction());
        let is_delta = next.is_some_and(|next| next.is_delta) || !vertex.has_non_delta();
        let receives = sample.receiver.is_none() && !is_delta;
        if receives {
            let throughput = path.throughput / scattering_probability(&vertex.bsdf, vertex.wo);
            if let Some(light) = transport.emitter_light(&at, &site, 1, rng.emitter()) {
                rays.emitter += 1;
                if !scene.occluded(&light.ray) {
                    sample.direct += throughput * SurfaceVertex::weighted(&light);
                }
            }
            sample.receiver = Some(Receiver {
                vertex: vertex.clone(),
                throughput,
                distance,
            });
        }
        let Some(next) = next.filter(|_| receives || is_delta) else {
            break;
        };
        path.throughput *= next.weight;
        if path.throughput == Rgb::ZERO {
            break;
        }
        path.bounce = Some(Bounce {
            from: point.position,
            site,
            pdf: next.pdf,
            is_delta: next.is_delta,
        });
        ray = point.spawn(next.direction);
    }
    sample
}

/// Probability that sampling the BSDF from `wo` chooses a lobe that is not a mirror.
fn scattering_probability(bsdf: &Bsdf, wo: Vec3) -> f32 {
    let lobes = bsdf.lobe_count();
    if lobes == 1 {
        return 1.0;
    }
    let deltas: f32 = (0..lobes)
        .filter(|&lobe| bsdf.is_delta(lobe))
        .map(|lobe| bsdf.lobe_probability(lobe, wo))
        .sum();
    (1.0 - deltas).max(f32::EPSILON)
}
