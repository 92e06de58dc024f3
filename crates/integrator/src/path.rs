//! Unidirectional path tracing with emitter sampling.

use crate::PixelEstimator;
use crate::next_event::{Bounce, SampleCounts, met_emission, sampled_emission};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Ray, Rgb, Scene};

/// Estimates the light transport equation by paths from the camera.
///
/// A path `x₀ x₁ … x_k` contributes `f(x̄) = T(x₀…x_k) L_e(x_k → x_{k−1})`. Its last vertex is found in two ways: by
/// sampling an emitter, or by sampling the BSDF and meeting one. Both are weighted by the power heuristic, of
/// densities in the solid-angle measure at `x_{k−1}` (Veach 1997 §9.2.4, eq. 9.10). An emitter that only one technique
/// can find has weight 1 with it.
///
/// The estimate is unbiased for paths of up to `max_depth` edges: 1 shows emitters only, 2 adds direct light, and so on.
/// Longer paths than `roulette_depth` edges survive with probability `min(max(T η²), 0.95)`.
pub struct PathTracer<'a> {
    scene: &'a Scene,
    max_depth: u32,
    roulette_depth: u32,
}

/// Probability at which roulette keeps even the brightest path, so that paths between mirrors end.
const SURVIVAL_CAP: f32 = 0.95;

impl<'a> PathTracer<'a> {
    /// A path tracer with the lengths that the scene's settings ask for.
    pub fn new(scene: &'a Scene) -> Self {
        let settings = scene.settings();
        Self::with_depths(scene, settings.max_depth, settings.roulette_depth)
    }

    /// A path tracer with the given longest path in edges (`None` is unbounded) and first edge at which roulette may end
    /// a path.
    pub fn with_depths(scene: &'a Scene, max_depth: Option<u32>, roulette_depth: u32) -> Self {
        Self {
            scene,
            max_depth: max_depth.unwrap_or(u32::MAX),
            roulette_depth,
        }
    }

    /// Radiance that arrives along `ray`, from one path.
    #[inline]
    pub fn radiance(&self, mut ray: Ray, rng: &mut CounterRng) -> Rgb {
        let scene = self.scene;
        let mut radiance = Rgb::ZERO;
        let mut throughput = Rgb::ONE;
        // Product of the squared relative indices of refraction: roulette judges the throughput without the radiance
        // scaling that refraction undoes on the way out.
        let mut eta_squared = 1.0;
        // How the current ray was sampled, for the weight of an emitter that it meets.
        let mut bounce: Option<Bounce> = None;
        for depth in 1..=self.max_depth {
            let point = scene.intersect(&ray);
            radiance += throughput * met_emission(scene, &ray, point.as_ref(), bounce);
            let Some(point) = point else {
                break;
            };
            if depth == self.max_depth {
                break;
            }
            let bsdf = scene.bsdf(&point);
            let wo = point.shading.to_local(-ray.direction);
            radiance += throughput * sampled_emission(scene, &point, &bsdf, wo, SampleCounts::ONE_EACH, rng);
            let u_lobe = rng.next_f32();
            let Some(sample) = bsdf.sample(wo, u_lobe, Vec2::from(rng.next_2d())) else {
                break;
            };
            throughput *= sample.weight;
            if throughput == Rgb::ZERO {
                break;
            }
            eta_squared *= sample.eta * sample.eta;
            if depth >= self.roulette_depth {
                let survival = (throughput.max_element() * eta_squared).min(SURVIVAL_CAP);
                if rng.next_f32() >= survival {
                    break;
                }
                throughput /= survival;
            }
            bounce = Some(Bounce {
                from: point.position,
                pdf: sample.pdf,
                is_delta: sample.is_delta,
                counts: SampleCounts::ONE_EACH,
            });
            ray = point.spawn(point.shading.to_world(sample.wi));
        }
        radiance
    }
}

impl PixelEstimator for PathTracer<'_> {
    #[inline]
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let mut rng = CounterRng::new(seed, y << 16 | x, sample_index);
        let ray = camera_ray(self.scene, x, y, &mut rng);
        self.radiance(ray, &mut rng)
    }
}

/// A ray through a uniformly chosen point of the pixel's square, and of the lens where there is one.
#[inline(always)]
pub(crate) fn camera_ray(scene: &Scene, x: u32, y: u32, rng: &mut CounterRng) -> Ray {
    let camera = scene.camera();
    let [dx, dy] = rng.next_2d();
    let u_lens = if camera.has_lens() {
        rng.next_2d()
    } else {
        [0.5; 2]
    };
    camera.ray(Vec2::new(x as f32 + dx, y as f32 + dy), u_lens)
}
