//! Unidirectional path tracing with emitter sampling.

mod batch;
pub(crate) mod next_event;
mod numbers;
mod purpose;
pub(crate) mod reuse;
pub(crate) mod selected;
mod shade;
mod start;
mod suffix;
pub(crate) mod walk;

use crate::camera_ray::PixelRay;
use crate::path::next_event::{Bounce, SampleCounts, Shadow, emission_sample, met_emission};
use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
use lightshed_lanes::LaneChoice;
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Ray, Rgb, Scene, SurfacePoint};
use numbers::VertexNumbers;

pub(crate) use suffix::trace_suffixes;

/// Estimates the light transport equation by paths from the camera.
///
/// A path `x₀ x₁ … x_k` contributes `f(x̄) = T(x₀…x_k) L_e(x_k → x_{k−1})`. Its last vertex is found in two ways: by
/// sampling an emitter, or by sampling the BSDF and meeting one. Both are weighted by the power heuristic, of
/// densities in the solid-angle measure at `x_{k−1}` (Veach 1997 §9.2.4, eq. 9.10). An emitter that only one technique
/// can find has weight 1 with it.
///
/// The estimate is unbiased for paths of up to `max_depth` edges: 1 shows emitters only, 2 adds direct light, and so on.
/// Longer paths than `roulette_depth` edges survive with probability `min(max(T η²), 0.95)`.
///
/// Paths are traced in batches, all at the same depth, so that rays can be in flight together; each has random numbers of
/// its own, and its result does not depend on the others.
pub struct PathTracer<'a> {
    scene: &'a Scene,
    max_depth: u32,
    roulette_depth: u32,
    lanes: LaneChoice,
}

/// Probability at which roulette keeps even the brightest path, so that paths between mirrors end.
const SURVIVAL_CAP: f32 = 0.95;

/// A path on its way, but for its ray and its random numbers.
#[derive(Clone)]
struct PathState {
    throughput: Rgb,
    /// Product of the squared relative indices of refraction: roulette judges the throughput without the radiance
    /// scaling that refraction undoes on the way out.
    eta_squared: f32,
    /// How the current ray left its surface; `None` from the camera.
    bounce: Option<Bounce>,
}

/// What follows from a vertex.
struct Next {
    shadow: Option<Shadow>,
    ray: Option<Ray>,
}

impl PathState {
    /// At the camera.
    const START: Self = Self {
        throughput: Rgb::ONE,
        eta_squared: 1.0,
        bounce: None,
    };

    /// What the path contributes by what its ray has met: `point`, or the environment.
    #[inline(always)]
    fn emission(&self, scene: &Scene, ray: &Ray, point: Option<&SurfacePoint>) -> Rgb {
        self.throughput * met_emission(scene, ray, point, self.bounce)
    }
}

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
            lanes: LaneChoice::best(),
        }
    }

    /// Radiance that arrives along `ray`, from one path. The vertex at the end of edge `d` uses words `8 d` to `8 d + 7`
    /// of `rng`, wherever that stands.
    pub fn radiance(&self, ray: Ray, rng: CounterRng) -> Rgb {
        let (mut path, mut ray, mut rng) = (PathState::START, ray, rng);
        let mut radiance = Rgb::ZERO;
        for depth in 1..=self.max_depth {
            let hit = self.scene.accelerator().intersect(&ray);
            let point = hit.map(|hit| self.scene.surface(&ray, &hit));
            radiance += path.emission(self.scene, &ray, point.as_ref());
            let Some(point) = point.filter(|_| depth < self.max_depth) else {
                break;
            };
            let numbers = VertexNumbers::draw(&mut rng, depth);
            let next = self.advance(&mut path, &ray, &point, depth, &numbers);
            if let Some(shadow) = next.shadow
                && !self.scene.occluded(&shadow.ray)
            {
                radiance += shadow.radiance;
            }
            match next.ray {
                Some(next) => ray = next,
                None => break,
            }
        }
        radiance
    }

    /// At the end of a path's ray, its edge number `depth`: samples an emitter and the next direction.
    #[inline(always)]
    fn advance(
        &self,
        path: &mut PathState,
        ray: &Ray,
        point: &SurfacePoint,
        depth: u32,
        numbers: &VertexNumbers,
    ) -> Next {
        let scene = self.scene;
        let bsdf = scene.bsdf(point);
        let wo = point.shading.to_local(-ray.direction);
        let u_emitter = (numbers.u_emitter, numbers.u_on_emitter);
        let shadow = emission_sample(scene, point, &bsdf, wo, SampleCounts::ONE_EACH, u_emitter).map(
            |Shadow { ray, radiance }| Shadow {
                ray,
                radiance: path.throughput * radiance,
            },
        );
        let Some(sample) = bsdf.sample(wo, numbers.u_lobe, Vec2::from(numbers.u_direction)) else {
            return Next { shadow, ray: None };
        };
        path.throughput *= sample.weight;
        if path.throughput == Rgb::ZERO {
            return Next { shadow, ray: None };
        }
        path.eta_squared *= sample.eta * sample.eta;
        if depth >= self.roulette_depth {
            let survival = (path.throughput.max_element() * path.eta_squared).min(SURVIVAL_CAP);
            if numbers.u_roulette >= survival {
                return Next { shadow, ray: None };
            }
            path.throughput /= survival;
        }
        path.bounce = Some(Bounce {
            from: point.position,
            pdf: sample.pdf,
            is_delta: sample.is_delta,
            counts: SampleCounts::ONE_EACH,
        });
        Next {
            shadow,
            ray: Some(point.spawn(point.shading.to_world(sample.wi))),
        }
    }
}

impl PixelEstimator for PathTracer<'_> {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let mut rng = CounterRng::new(seed, y << 16 | x, sample_index);
        let ray = camera_ray(self.scene, x, y, &mut rng);
        self.radiance(ray, rng)
    }

    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        for (ids, values) in ids.chunks(MAX_BATCH).zip(values.chunks_mut(MAX_BATCH)) {
            batch::trace(self, ids, seed, values);
        }
    }
}

/// A ray through a uniformly chosen point of the pixel's square, and of the lens where there is one.
#[inline(always)]
pub(crate) fn camera_ray(scene: &Scene, x: u32, y: u32, rng: &mut CounterRng) -> Ray {
    PixelRay::draw(scene.camera(), Vec2::new(x as f32, y as f32), rng).ray
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_scene::glam::{Affine2, Vec3};
    use lightshed_scene::{
        Checkerboard, ColorTexture, EmitterDescription, Geometry, Material, SceneDescription,
        ShapeDescription, SphereGeometry, builtin,
    };

    /// The Cornell box with spheres, one of which emits, a mirror, a ball with interpolated normals and a texture, and
    /// emitters of other kinds.
    fn mixed() -> SceneDescription {
        let mut scene = builtin::cornell();
        scene.materials[0] = Material::TwoSided {
            front: Box::new(Material::Diffuse {
                reflectance: ColorTexture::Checkerboard(Checkerboard {
                    color0: Rgb::new(0.2, 0.5, 0.7),
                    color1: Rgb::new(0.9, 0.1, 0.4),
                    to_uv: Affine2::from_scale(Vec2::new(5.0, 3.0)),
                }),
            }),
            back: None,
        };
        scene.materials.push(Material::Mirror {
            reflectance: Rgb::splat(0.9).into(),
        });
        let (center, radius) = (Vec3::new(-0.3, -0.4, 0.5), 0.35);
        let mut ball = builtin::icosphere(center, radius, 2);
        ball.normals = ball.positions.iter().map(|p| p - center).collect();
        let sphere = |x| {
            Geometry::Sphere(SphereGeometry {
                center: Vec3::new(x, 0.5, 0.2),
                radius: 0.2,
                flip_normals: false,
            })
        };
        let shapes = [
            (Geometry::Mesh(ball), 1, None),
            (sphere(0.5), 1, Some(Rgb::splat(2.0))),
            (sphere(-0.5), 3, None),
        ];
        for (geometry, material, emission) in shapes {
            scene.shapes.push(ShapeDescription {
                name: "one more".to_owned(),
                geometry,
                material,
                emission,
            });
        }
        scene.emitters = vec![
            EmitterDescription::Point {
                position: Vec3::new(0.2, 0.1, 0.9),
                intensity: Rgb::splat(0.5),
            },
            EmitterDescription::Constant {
                radiance: Rgb::splat(0.2),
            },
        ];
        scene
    }

    /// Paths in company against paths alone, bit for bit, on all kinds of lanes, in batches of every size up to the full
    /// one.
    #[test]
    fn a_path_does_not_depend_on_its_batch() {
        let builtin = builtin::NAMES.map(|name| (name, builtin::by_name(name).unwrap()));
        // Not those with media, whose boundaries take up edges here.
        let without_media = builtin.into_iter().filter(|(_, scene)| scene.media.is_empty());
        for (name, mut description) in without_media.chain([("mixed", mixed())]) {
            (description.settings.width, description.settings.height) = (16, 16);
            let scene = Scene::new(&description).unwrap();
            let ids: Vec<SampleId> = (0..1024)
                .map(|i| SampleId {
                    x: i % 16,
                    y: i / 16 % 16,
                    index: 3 * i,
                })
                .collect();
            // Short paths, whose last edges often meet emitters, and long ones, with roulette from the third edge so that
            // those of a batch end at different times.
            for max_depth in [1, 2, 3, 7] {
                let tracer = PathTracer::with_depths(&scene, Some(max_depth), 3);
                let alone: Vec<Rgb> = ids
                    .iter()
                    .map(|id| tracer.sample(id.x, id.y, id.index, 5))
                    .collect();
                // The lamp behind the door is not seen by short paths.
                let lit = alone.iter().any(|&value| value != Rgb::ZERO);
                assert!(lit || (name == "doorway" && max_depth <= 3), "{name} is black");
                let on_arrays = PathTracer {
                    lanes: LaneChoice::ARRAY,
                    ..PathTracer::with_depths(&scene, Some(max_depth), 3)
                };
                let batches = [1, 7, 9, MAX_BATCH, 256].map(|size| (size, &tracer));
                for (size, tracer) in batches.into_iter().chain([(MAX_BATCH, &on_arrays)]) {
                    let mut together = vec![Rgb::NAN; ids.len()];
                    for (ids, values) in ids.chunks(size).zip(together.chunks_mut(size)) {
                        tracer.sample_many(ids, 5, values);
                    }
                    assert_eq!(
                        alone, together,
                        "{name} to depth {max_depth} in batches of {size}, {:?}",
                        tracer.lanes
                    );
                }
            }
        }
    }

    #[test]
    fn a_longest_path_of_no_edges_is_black() {
        let scene = Scene::new(&builtin::furnace()).unwrap();
        let tracer = PathTracer::with_depths(&scene, Some(0), 1);
        let mut values = [Rgb::ONE; 3];
        tracer.sample_many(&[SampleId::default(); 3], 0, &mut values);
        assert_eq!(values, [Rgb::ZERO; 3]);
        assert_eq!(tracer.sample(0, 0, 0, 0), Rgb::ZERO);
    }
}
