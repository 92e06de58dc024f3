//! What the camera sees: the diffuse point that VPLs shine on, and everything that does not come from VPLs.

use crate::path::next_event::{Bounce, SampleCounts, met_emission, sample_emission};
use lightshed_film::RayCounts;
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Bsdf, Ray, Rgb, Scene, SurfacePoint};

/// Mirrors and panes that a camera path may meet.
const MAX_DELTA_BOUNCES: u32 = 16;

/// A point that virtual point lights shine on, as one pixel sample sees it.
#[derive(Clone, Debug)]
pub(super) struct Receiver {
    pub point: SurfacePoint,
    pub bsdf: Bsdf,
    /// Towards the viewer, in the shading frame.
    pub wo: Vec3,
    /// Share of what leaves the point that reaches the pixel.
    pub throughput: Rgb,
    /// Length of the way from the camera.
    pub distance: f32,
}

/// One sample of a pixel, but for the light of VPLs.
#[derive(Clone, Debug, Default)]
pub(super) struct CameraSample {
    /// Light from emitters: seen, by one scattering, and by any number of mirrors in between.
    pub direct: Rgb,
    /// The first point along the path that is not only a mirror, if there is one.
    pub receiver: Option<Receiver>,
}

/// Follows a camera ray through mirrors and panes to the first point that scatters in all directions.
///
/// The direct part is a path tracer's: emission with the weight of how it was found, one emitter sample at the receiver, and
/// one sample of its BSDF. That sample goes on through mirrors as well, where it alone can find the light, so caustics of area
/// lights are seen. Where a surface both mirrors and scatters, one of the two is followed, by its probability.
pub(super) fn camera_sample(
    scene: &Scene,
    ray: Ray,
    rng: &mut CounterRng,
    rays: &mut RayCounts,
) -> CameraSample {
    let mut sample = CameraSample::default();
    let (mut ray, mut throughput, mut bounce) = (ray, Rgb::ONE, None);
    let mut distance = 0.0;
    for depth in 0..=MAX_DELTA_BOUNCES {
        if depth == 0 {
            rays.camera += 1;
        } else {
            rays.path += 1;
        }
        let met = scene.intersect(&ray);
        sample.direct += throughput * met_emission(scene, &ray, met.as_ref(), bounce);
        let Some(point) = met else {
            break;
        };
        distance += point.position.distance(ray.origin);
        let bsdf = scene.bsdf(&point);
        let wo = point.shading.to_local(-ray.direction);
        let u_lobe = rng.next_f32();
        let next = bsdf.sample(wo, u_lobe, Vec2::from(rng.next_2d()));
        let is_delta = next.is_some_and(|next| next.is_delta) || !bsdf.has_non_delta();
        let receives = sample.receiver.is_none() && !is_delta;
        if receives {
            let throughput = throughput / scattering_probability(&bsdf, wo);
            if let Some(shadow) = sample_emission(scene, &point, &bsdf, wo, SampleCounts::ONE_EACH, rng) {
                rays.emitter += 1;
                if !scene.occluded(&shadow.ray) {
                    sample.direct += throughput * shadow.radiance;
                }
            }
            sample.receiver = Some(Receiver {
                point,
                bsdf,
                wo,
                throughput,
                distance,
            });
        }
        let Some(next) = next.filter(|_| receives || is_delta) else {
            break;
        };
        throughput *= next.weight;
        if throughput == Rgb::ZERO {
            break;
        }
        bounce = Some(Bounce {
            from: point.position,
            pdf: next.pdf,
            is_delta: next.is_delta,
            counts: SampleCounts::ONE_EACH,
        });
        ray = point.spawn(point.shading.to_world(next.wi));
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
