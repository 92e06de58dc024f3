//! Path tracing with emitters chosen for the point that they light.

use crate::light_selection::LightSelection;
use crate::path::camera_ray;
use lightshed_film::PixelEstimator;
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{CounterRng, Density, SolidAngle, power_heuristic};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Ray, Rgb, Scene, SurfacePoint};

/// Estimates the light transport equation as [`PathTracer`](crate::PathTracer) does, with emitters chosen by a
/// [`LightSelection`]: the same expectation, for any of them.
///
/// At each vertex one emitter is sampled, with a density that depends on the vertex, and one direction by the BSDF; the last
/// vertex of a path is weighted by the power heuristic over both (Veach 1997 §9.2.4, eq. 9.10), in the solid-angle measure. Paths
/// go one by one.
pub struct SelectedPathTracer<'a> {
    scene: &'a Scene,
    selection: LightSelection<'a>,
    max_depth: u32,
    roulette_depth: u32,
}

/// Probability at which roulette keeps even the brightest path, so that paths between mirrors end.
const SURVIVAL_CAP: f32 = 0.95;

/// How a ray left its surface.
struct Bounce {
    at: ShadingPoint,
    pdf: Density<SolidAngle>,
    is_delta: bool,
}

impl<'a> SelectedPathTracer<'a> {
    /// With the given longest path in edges (`None` is unbounded) and first edge at which roulette may end a path.
    pub fn new(
        scene: &'a Scene,
        selection: LightSelection<'a>,
        max_depth: Option<u32>,
        roulette_depth: u32,
    ) -> Self {
        Self {
            scene,
            selection,
            max_depth: max_depth.unwrap_or(u32::MAX),
            roulette_depth,
        }
    }

    /// Emitted radiance that `ray` meets, times the MIS weight of having met it by `bounce`.
    fn emission(&self, ray: &Ray, point: Option<&SurfacePoint>, bounce: Option<&Bounce>) -> Rgb {
        let emitters = self.scene.emitters();
        let emitted = match point {
            Some(point) if point.emitter == SurfacePoint::NO_EMITTER => Rgb::ZERO,
            Some(point) => emitters.radiance(point, ray.direction),
            None => emitters
                .environment()
                .map_or(Rgb::ZERO, |environment| environment.radiance(ray.direction)),
        };
        let Some(bounce) = bounce.filter(|bounce| !bounce.is_delta && emitted != Rgb::ZERO) else {
            return emitted;
        };
        let other = match point {
            Some(point) => self.selection.pdf(&bounce.at, point),
            None => self.selection.pdf_environment(ray.direction),
        };
        emitted * power_heuristic(bounce.pdf, other)
    }

    /// Radiance that arrives along `ray`, from one path.
    pub fn radiance(&self, ray: Ray, rng: &mut CounterRng) -> Rgb {
        let (mut ray, mut throughput, mut radiance) = (ray, Rgb::ONE, Rgb::ZERO);
        let (mut eta_squared, mut bounce) = (1.0, None);
        for depth in 1..=self.max_depth {
            let point = self.scene.intersect(&ray);
            radiance += throughput * self.emission(&ray, point.as_ref(), bounce.as_ref());
            let Some(point) = point.filter(|_| depth < self.max_depth) else {
                break;
            };
            let bsdf = self.scene.bsdf(&point);
            let wo = point.shading.to_local(-ray.direction);
            let at = self.selection.receiver(&point, &bsdf, wo);
            let (u_select, u) = (rng.next_u64(), rng.next_2d());
            if bsdf.has_non_delta()
                && let Some(light) = self.selection.sample(&at, u_select, u)
            {
                let scattered = bsdf.evaluate(wo, point.shading.to_local(light.direction));
                if scattered.value != Rgb::ZERO && !self.scene.occluded(&light.shadow_ray(&point)) {
                    let weight = if light.is_delta {
                        1.0
                    } else {
                        power_heuristic(light.pdf, scattered.pdf)
                    };
                    radiance += throughput * scattered.value * light.weight * weight;
                }
            }
            let (u_lobe, u, u_roulette) = (rng.next_f32(), rng.next_2d(), rng.next_f32());
            let Some(sample) = bsdf.sample(wo, u_lobe, Vec2::from(u)) else {
                break;
            };
            throughput *= sample.weight;
            eta_squared *= sample.eta * sample.eta;
            if depth >= self.roulette_depth {
                let survival = (throughput.max_element() * eta_squared).min(SURVIVAL_CAP);
                if u_roulette >= survival {
                    break;
                }
                throughput /= survival;
            }
            if throughput == Rgb::ZERO {
                break;
            }
            ray = point.spawn(point.shading.to_world(sample.wi));
            bounce = Some(Bounce {
                at,
                pdf: sample.pdf,
                is_delta: sample.is_delta,
            });
        }
        radiance
    }
}

impl PixelEstimator for SelectedPathTracer<'_> {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let mut rng = CounterRng::new(seed, y << 16 | x, sample_index);
        let ray = camera_ray(self.scene, x, y, &mut rng);
        self.radiance(ray, &mut rng)
    }
}
