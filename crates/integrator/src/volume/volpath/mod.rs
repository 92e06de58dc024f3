//! Path tracing through participating media by null collisions.

mod flight;
mod shadow;
#[cfg(test)]
mod tests;

pub use flight::VolumeTracking;
use flight::{Channels, fly};
pub(crate) use shadow::{Crossing, end_of};

use crate::PathTracer;
use crate::path::camera_ray;
use crate::path::next_event::{Bounce, SampleCounts, emission_sample, met_emission};
use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
use lightshed_sampling::{CounterRng, Density, power_heuristic};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::volume::PhaseFunction;
use lightshed_scene::{Hit, Material, Medium, Ray, Rgb, Scene, SurfacePoint};

/// Estimates the radiative transfer equation by paths from the camera.
///
/// A path `x₀ x₁ … x_k` through surfaces and media contributes the product of what
/// [`PathTracer`](crate::PathTracer) has at surfaces, of `σ_s(x) p(ω → ω′)` at collisions, and of the transmittances
/// `T(x ↔ y) = e^{−∫σ_t}` of its edges, times what its last vertex emits towards the one before: a surface `L_e`, a medium
/// `σ_a L_e` (Lin 2022 eqs. 5.10–5.12).
///
/// - *Free flights* by delta tracking: collisions have the density `σ_t T`, which cancels against the integrand and leaves the
///   albedo. A flight that meets no collision reaches the surface behind.
/// - *Light from emitters* is found in two ways, by sampling an emitter and by the direction that a phase function or BSDF samples,
///   weighted by the power heuristic of their densities in the solid-angle measure. The transmittance up to the sampled emitter is
///   estimated by ratio tracking, without bias.
/// - *Extinction that differs by channel* is sampled at the rate of a channel chosen uniformly for each path; the channels' densities
///   are weighted by the balance heuristic over the whole path (spectral MIS: Wilkie et al. 2014, Miller et al. 2019).
/// - Light passes shapes of [`Material::Null`] unchanged; they are no vertices, and do not count as edges.
///
/// Unbiased for paths of up to `max_depth` edges: 1 shows emitters, 2 adds light that is scattered once. Longer paths than
/// `roulette_depth` edges survive with probability `min(max(T η²), 0.95)`. In a scene without media and without [`Material::Null`] its
/// samples are those of [`PathTracer`], which is the faster one there.
pub struct VolumePathTracer<'a> {
    scene: &'a Scene,
    max_depth: u32,
    roulette_depth: u32,
    /// The medium around the camera.
    camera_medium: Option<u32>,
    /// Whether some medium has extinction that differs by channel.
    spectral: bool,
    tracking: VolumeTracking,
    /// What samples scenes without anything to pass through.
    plain: Option<PathTracer<'a>>,
}

/// Probability at which roulette keeps even the brightest path.
const SURVIVAL_CAP: f32 = 0.95;

/// Surfaces that a path may cross without scattering, in all: more than any scene has, but an end.
pub(crate) const MOST_CROSSINGS: u32 = 1 << 16;

/// Whether light passes a primitive, and nothing but that is to be known of it.
#[inline(always)]
fn is_passed(scene: &Scene, primitive: u32) -> bool {
    matches!(
        scene.materials()[scene.primitive_material(primitive) as usize],
        Material::Null
    ) && scene.primitive_emitter(primitive) == SurfacePoint::NO_EMITTER
}

/// A path on its way.
struct State {
    ray: Ray,
    /// Which the ray is in.
    medium: Option<u32>,
    /// Product of albedos, BSDF weights and roulette; collisions cancel.
    throughput: Rgb,
    channels: Channels,
    eta_squared: f32,
    /// How the ray left its vertex; `None` from the camera.
    bounce: Option<Bounce>,
    /// Number of the edge that the ray is part of.
    depth: u32,
    radiance: Rgb,
}

impl<'a> VolumePathTracer<'a> {
    /// A path tracer with the lengths that the scene's settings ask for.
    pub fn new(scene: &'a Scene) -> Self {
        let settings = scene.settings();
        Self::with_depths(scene, settings.max_depth, settings.roulette_depth)
    }

    /// A path tracer with the given longest path in edges (`None` is unbounded) and first edge at which roulette may end a path.
    pub fn with_depths(scene: &'a Scene, max_depth: Option<u32>, roulette_depth: u32) -> Self {
        let is_null = |material: &Material| matches!(material, Material::Null);
        let opaque = scene.media().is_empty() && !scene.materials().iter().any(is_null);
        Self {
            scene,
            max_depth: max_depth.unwrap_or(u32::MAX),
            roulette_depth,
            camera_medium: scene.camera_medium(scene.camera()),
            spectral: !scene.media().iter().all(Medium::is_grey),
            tracking: VolumeTracking::Delta,
            plain: opaque.then(|| PathTracer::with_depths(scene, max_depth, roulette_depth)),
        }
    }

    /// With other flights and transmittances.
    #[must_use]
    pub fn with_tracking(self, tracking: VolumeTracking) -> Self {
        Self { tracking, ..self }
    }

    /// Radiance that arrives along `ray`, which starts in the medium of that index, from one path.
    pub fn radiance(&self, ray: Ray, medium: Option<u32>, rng: &mut CounterRng) -> Rgb {
        self.walk(ray, medium, None, rng)
    }

    /// [`radiance`](Self::radiance), where it is known what `ray` hits, or not yet.
    #[inline]
    fn walk(&self, ray: Ray, medium: Option<u32>, known: Option<Option<Hit>>, rng: &mut CounterRng) -> Rgb {
        let hero = if self.spectral { rng.next_u32() } else { 0 };
        let mut path = State {
            ray,
            medium,
            throughput: Rgb::ONE,
            channels: Channels::new(hero),
            eta_squared: 1.0,
            bounce: None,
            depth: 1,
            radiance: Rgb::ZERO,
        };
        let settled = |hit: Hit| self.scene.settled(&ray, hit);
        let (mut known, mut crossings) = (known.map(|hit| hit.map(settled)), 0);
        while self.max_depth > 0 && crossings < MOST_CROSSINGS {
            let scene = self.scene;
            // Where no surface can come before a collision, none is looked for before.
            let mut hit = known.take();
            if hit.is_none() && !path.medium.is_some_and(|medium| scene.medium_is_clear(medium)) {
                hit = Some(scene.nearest(&path.ray));
            }
            if let Some(medium) = path.medium.map(|index| &scene.media()[index as usize]) {
                let t_max = hit.flatten().map_or(path.ray.t_max, |hit| hit.t);
                if let Some(t) = fly(medium, &path.ray, t_max, self.tracking, &mut path.channels, rng) {
                    let position = path.ray.origin + path.ray.direction * t;
                    if self.collide(&mut path, medium, position, rng).is_none() {
                        break;
                    }
                    continue;
                }
            }
            let hit = hit.unwrap_or_else(|| scene.nearest(&path.ray));
            if let Some(hit) = hit
                && is_passed(scene, hit.primitive)
            {
                crossings += 1;
                path.cross(scene, &scene.surface(&path.ray, &hit));
                continue;
            }
            let point = hit.map(|hit| scene.surface(&path.ray, &hit));
            path.radiance += path.weighted(met_emission(scene, &path.ray, point.as_ref(), path.bounce));
            let Some(point) = point else { break };
            if matches!(scene.materials()[point.material as usize], Material::Null) {
                crossings += 1;
                path.cross(scene, &point);
                continue;
            }
            if self.bounce(&mut path, &point, rng).is_none() {
                break;
            }
        }
        path.radiance
    }

    /// A collision: emission, an emitter sample and the next direction. `None` ends the path.
    #[inline]
    fn collide(&self, path: &mut State, medium: &Medium, position: Vec3, rng: &mut CounterRng) -> Option<()> {
        if medium.emission().is_some() {
            path.radiance += path.weighted(medium.emission_per_collision(position));
        }
        if path.depth >= self.max_depth {
            return None;
        }
        path.throughput *= medium.albedo();
        if path.throughput == Rgb::ZERO {
            return None;
        }
        let (phase, incoming) = (medium.phase(), path.ray.direction);
        let (u_select, u) = (rng.next_u64(), rng.next_2d());
        if let Some(light) = self.scene.emitters().sample(position, u_select, u) {
            let scattered = phase.phase_between(incoming, light.direction);
            let weight = if light.is_delta {
                1.0
            } else {
                power_heuristic(light.pdf, Density::new(scattered))
            };
            if scattered > 0.0 {
                let transmittance = self.transmittance(light.shadow_ray_from(position), path.medium, rng);
                path.radiance += path.weighted(light.weight * (scattered * weight) * transmittance);
            }
        }
        let sample = phase.sample(incoming, rng.next_2d());
        path.bounce = Some(Bounce {
            from: position,
            pdf: Density::new(sample.pdf_solid_angle),
            is_delta: false,
            counts: SampleCounts::ONE_EACH,
        });
        path.ray = Ray::new(position, sample.direction);
        self.survives(path, rng)
    }

    /// A surface that scatters: an emitter sample and the next direction. `None` ends the path.
    fn bounce(&self, path: &mut State, point: &SurfacePoint, rng: &mut CounterRng) -> Option<()> {
        if path.depth >= self.max_depth {
            return None;
        }
        let scene = self.scene;
        let bsdf = scene.bsdf(point);
        let wo = point.shading.to_local(-path.ray.direction);
        let sides = scene.medium_sides(point.primitive);
        let towards = |direction: Vec3, same: Option<u32>| match sides {
            Some(sides) => sides.towards(direction.dot(point.geometric_normal)),
            None => same,
        };
        let numbers = (rng.next_u64(), rng.next_2d());
        if let Some(shadow) = emission_sample(scene, point, &bsdf, wo, SampleCounts::ONE_EACH, numbers) {
            let medium = towards(shadow.ray.direction, path.medium);
            let transmittance = self.transmittance(shadow.ray, medium, rng);
            path.radiance += path.weighted(shadow.radiance * transmittance);
        }
        let u_lobe = rng.next_f32();
        let sample = bsdf.sample(wo, u_lobe, Vec2::from(rng.next_2d()))?;
        path.throughput *= sample.weight;
        path.eta_squared *= sample.eta * sample.eta;
        path.bounce = Some(Bounce {
            from: point.position,
            pdf: sample.pdf,
            is_delta: sample.is_delta,
            counts: SampleCounts::ONE_EACH,
        });
        path.ray = point.spawn(point.shading.to_world(sample.wi));
        path.medium = towards(path.ray.direction, path.medium);
        self.survives(path, rng)
    }

    /// Roulette, and the step to the next edge. `None` ends the path.
    #[inline(always)]
    fn survives(&self, path: &mut State, rng: &mut CounterRng) -> Option<()> {
        let brightness = path.throughput.max_element();
        if brightness == 0.0 {
            return None;
        }
        if path.depth >= self.roulette_depth {
            let survival = (brightness * path.eta_squared).min(SURVIVAL_CAP);
            if rng.next_f32() >= survival {
                return None;
            }
            path.throughput /= survival;
        }
        path.depth += 1;
        Some(())
    }
}

impl State {
    /// What radiance at the end of the ray contributes to the pixel.
    #[inline(always)]
    fn weighted(&self, radiance: Rgb) -> Rgb {
        self.throughput * self.channels.weight() * radiance
    }

    /// Goes on behind a surface that lets all light pass.
    #[inline(always)]
    fn cross(&mut self, scene: &Scene, point: &SurfacePoint) {
        let crossing = Crossing::new(scene, point, &self.ray, self.medium, end_of(&self.ray));
        (self.ray, self.medium) = (crossing.ray, crossing.medium);
    }
}

impl PixelEstimator for VolumePathTracer<'_> {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        if let Some(plain) = &self.plain {
            return plain.sample(x, y, sample_index, seed);
        }
        let mut rng = CounterRng::new(seed, y << 16 | x, sample_index);
        let ray = camera_ray(self.scene, x, y, &mut rng);
        self.radiance(ray, self.camera_medium, &mut rng)
    }

    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        if let Some(plain) = &self.plain {
            return plain.sample_many(ids, seed, values);
        }
        let mut rngs: [CounterRng; MAX_BATCH] = std::array::from_fn(|_| CounterRng::new(seed, 0, 0));
        let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, 0.0); MAX_BATCH];
        let mut hits = [None; MAX_BATCH];
        for (ids, values) in ids.chunks(MAX_BATCH).zip(values.chunks_mut(MAX_BATCH)) {
            for ((id, ray), rng) in ids.iter().zip(&mut rays).zip(&mut rngs) {
                *rng = CounterRng::new(seed, id.y << 16 | id.x, id.index);
                *ray = camera_ray(self.scene, id.x, id.y, rng);
            }
            let count = ids.len().min(values.len());
            let (rays, hits) = (&rays[..count], &mut hits[..count]);
            self.scene.accelerator().intersect_many(rays, hits);
            for (((value, ray), hit), rng) in values.iter_mut().zip(rays).zip(hits).zip(&mut rngs) {
                *value = self.walk(*ray, self.camera_medium, Some(*hit), rng);
            }
        }
    }
}
