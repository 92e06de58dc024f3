//! Direct light with emitters chosen for the point that they light.

use crate::direct::plain::{DirectLightError, MAX_DIRECT_SAMPLES};
use crate::direct::shadow_batch::ShadowBatch;
use crate::light_selection::{ChosenLight, LightSelection};
use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{CounterRng, power_heuristic};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Bsdf, Ray, Rgb, Scene, SurfacePoint};

/// Estimates emission and light that is scattered once, as [`DirectLight`](crate::DirectLight) does, with emitters chosen by a
/// [`LightSelection`].
///
/// At the point that a camera ray meets, `L = ∫ f(ω_o, ω) L_e(ω) |cos θ| dω` (solid-angle measure) is estimated by `n` samples of
/// the emitters, the i-th of which chooses with a number from the i-th of `n` equal parts of the unit interval: since light
/// trees keep the order of lights, no two ask the same region for light unless it is that bright. Where the surface has other
/// lobes than diffuse ones, `m` samples of the BSDF join them by the power heuristic (Veach 1997 §9.2.4, eq. 9.10); on diffuse
/// surfaces they would find what the emitters' samples find, and more rarely.
///
/// Unbiased for any `n ≥ 1` and `m`, but for what only delta lobes scatter if `m = 0`.
///
/// With [`with_camera_strata`](Self::with_camera_strata) one sample of a pixel is the mean over `k²` camera rays, one in each of
/// `k × k` parts of the pixel, and the `k² n` emitter samples of all of them are stratified together.
pub struct SelectedDirectLight<'a> {
    scene: &'a Scene,
    selection: LightSelection<'a>,
    emitter_samples: u32,
    bsdf_samples: u32,
    /// Parts of a pixel along each side, k.
    camera_strata: u32,
    /// `2⁶⁴ / (k² n)`.
    stratum: u64,
}

/// Most parts of a pixel along each side: their camera rays make one batch.
const MAX_CAMERA_STRATA: u32 = 8;
const _: () = assert!((MAX_CAMERA_STRATA * MAX_CAMERA_STRATA) as usize <= MAX_BATCH);

/// Choices that are made together.
const COMPANY: usize = 16;

/// A dimension of the random numbers that no ray of a sample comes to.
const SHIFT_DIMENSION: u32 = u32::MAX;

/// A surface point that is being lit.
struct Lit {
    point: SurfacePoint,
    bsdf: Bsdf,
    wo: Vec3,
    at: ShadingPoint,
    /// Samples of the BSDF that it gets.
    bsdf_samples: f32,
}

impl<'a> SelectedDirectLight<'a> {
    /// `n` samples of the emitters and, where the surface is not diffuse, `m` of the BSDF, at the point that a camera ray
    /// meets.
    ///
    /// # Errors
    ///
    /// No samples of emitters, or more than [`MAX_DIRECT_SAMPLES`] of either.
    pub fn new(
        scene: &'a Scene,
        selection: LightSelection<'a>,
        emitter_samples: u32,
        bsdf_samples: u32,
    ) -> Result<Self, DirectLightError> {
        let most = emitter_samples.max(bsdf_samples);
        match emitter_samples {
            0 => Err(DirectLightError::NoSamples),
            _ if most > MAX_DIRECT_SAMPLES => Err(DirectLightError::TooManySamples(most)),
            _ => Ok(Self {
                scene,
                selection,
                emitter_samples,
                bsdf_samples,
                camera_strata: 1,
                stratum: u64::MAX / u64::from(emitter_samples),
            }),
        }
    }

    /// The same with `k × k` camera rays in every sample of a pixel; `k` is brought into 1…8.
    #[must_use]
    pub fn with_camera_strata(mut self, k: u32) -> Self {
        self.camera_strata = k.clamp(1, MAX_CAMERA_STRATA);
        self.stratum = u64::MAX / (u64::from(self.emitter_samples) * u64::from(self.rays_per_sample()));
        self
    }

    fn rays_per_sample(&self) -> u32 {
        self.camera_strata * self.camera_strata
    }

    /// Ray number `part` of a sample, through that part of the pixel.
    #[inline(always)]
    fn camera_ray(&self, id: SampleId, part: u32, rng: &mut CounterRng) -> Ray {
        let camera = self.scene.camera();
        let k = self.camera_strata;
        let [dx, dy] = rng.next_2d();
        let u_lens = if camera.has_lens() {
            rng.next_2d()
        } else {
            [0.5; 2]
        };
        let within = Vec2::new((part % k) as f32 + dx, (part / k) as f32 + dy) / k as f32;
        camera.ray(Vec2::new(id.x as f32, id.y as f32) + within, u_lens)
    }

    /// As many samples as make up to [`MAX_BATCH`] camera rays.
    fn trace_batch(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        let each = self.rays_per_sample() as usize;
        let count = ids.len().min(values.len()) * each;
        let mut rngs: [CounterRng; MAX_BATCH] = std::array::from_fn(|place| {
            let id = ids.get(place / each).copied().unwrap_or_default();
            let number = id.index.wrapping_mul(each as u32) + (place % each) as u32;
            CounterRng::new(seed, id.y << 16 | id.x, number)
        });
        let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, 0.0); MAX_BATCH];
        for (place, (ray, rng)) in rays.iter_mut().zip(&mut rngs).enumerate().take(count) {
            *ray = self.camera_ray(ids[place / each], (place % each) as u32, rng);
        }
        let mut hits = [None; MAX_BATCH];
        let accelerator = self.scene.accelerator();
        accelerator.intersect_many(&rays[..count], &mut hits[..count]);
        for hit in hits[..count].iter().flatten() {
            self.scene.prefetch_primitive(hit.primitive);
        }
        let mut waiting = ShadowBatch::new();
        // What is scattered, apart from what is emitted.
        let mut scattered = [Rgb::ZERO; MAX_BATCH];
        values.fill(Rgb::ZERO);
        for place in 0..count {
            let (ray, rng) = (&rays[place], &mut rngs[place]);
            let point = hits[place].map(|hit| self.scene.surface(ray, &hit));
            let value = &mut values[place / each];
            *value += seen_emission(self.scene, ray, point.as_ref());
            let Some(point) = point else { continue };
            let bsdf = self.scene.bsdf(&point);
            let wo = point.shading.to_local(-ray.direction);
            let lit = Lit {
                at: self.selection.receiver(&point, &bsdf, wo),
                bsdf_samples: if bsdf.is_diffuse() {
                    0.0
                } else {
                    self.bsdf_samples as f32
                },
                point,
                bsdf,
                wo,
            };
            let id = ids[place / each];
            let shift = CounterRng::at(seed, id.y << 16 | id.x, id.index, SHIFT_DIMENSION);
            let part = (place % each) as u32;
            self.sample_emitters(&lit, part, shift, rng, |ray, radiance| {
                waiting.push(self.scene, ray, place / each, radiance, &mut scattered);
            });
            if lit.bsdf_samples > 0.0 {
                *value += self.sample_bsdf(&lit, rng);
            }
        }
        waiting.flush(self.scene, &mut scattered);
        let emitter_samples = self.emitter_samples as f32;
        for (value, scattered) in values.iter_mut().zip(scattered) {
            *value = (*value + scattered / emitter_samples) / each as f32;
        }
    }

    /// Hands over the shadow rays of all samples of emitters, with what they bring if they are free, times `n`.
    #[inline(always)]
    fn sample_emitters(
        &self,
        lit: &Lit,
        part: u32,
        shift: u32,
        rng: &mut CounterRng,
        mut cast: impl FnMut(Ray, Rgb),
    ) {
        let rays = self.rays_per_sample();
        // Which of the strata of each round is this ray's: a random rotation, so that each is as likely.
        let turned = if rays > 1 { (part + shift % rays) % rays } else { 0 };
        if !lit.bsdf.has_non_delta() {
            return;
        }
        let (mut u, mut chosen) = ([0; COMPANY], [None::<ChosenLight>; COMPANY]);
        let mut done = 0;
        while done < self.emitter_samples {
            let count = (self.emitter_samples - done).min(COMPANY as u32);
            for (i, u) in (done..).zip(&mut u[..count as usize]) {
                let within = (u128::from(rng.next_u32()) * u128::from(self.stratum)) >> 32;
                *u = self.stratum * (u64::from(i) * u64::from(rays) + u64::from(turned)) + within as u64;
            }
            let (u, chosen) = (&u[..count as usize], &mut chosen[..count as usize]);
            self.selection.choose_many(&lit.at, u, chosen);
            for chosen in chosen.iter().flatten() {
                if let Some((ray, radiance)) = self.towards(lit, *chosen, rng.next_2d()) {
                    cast(ray, radiance);
                }
            }
            done += count;
        }
    }

    /// The shadow ray towards a chosen emitter, with `w f |cos θ| L_e / p`.
    #[inline(always)]
    fn towards(&self, lit: &Lit, chosen: ChosenLight, u: [f32; 2]) -> Option<(Ray, Rgb)> {
        let light = self.selection.direction(lit.point.position, chosen, u)?;
        let scattered = lit
            .bsdf
            .evaluate(lit.wo, lit.point.shading.to_local(light.direction));
        if scattered.value == Rgb::ZERO {
            return None;
        }
        let weight = if light.is_delta || lit.bsdf_samples == 0.0 {
            1.0
        } else {
            power_heuristic(
                light.pdf * self.emitter_samples as f32,
                scattered.pdf * lit.bsdf_samples,
            )
        };
        Some((
            light.shadow_ray(&lit.point),
            scattered.value * light.weight * weight,
        ))
    }

    /// The mean of the samples of the BSDF.
    #[inline(never)]
    fn sample_bsdf(&self, lit: &Lit, rng: &mut CounterRng) -> Rgb {
        let mut sum = Rgb::ZERO;
        for _ in 0..self.bsdf_samples {
            let u_lobe = rng.next_f32();
            let Some(sample) = lit.bsdf.sample(lit.wo, u_lobe, Vec2::from(rng.next_2d())) else {
                continue;
            };
            let ray = lit.point.spawn(lit.point.shading.to_world(sample.wi));
            let met = self.scene.intersect(&ray);
            let emitted = seen_emission(self.scene, &ray, met.as_ref());
            if emitted == Rgb::ZERO {
                continue;
            }
            let weight = if sample.is_delta {
                1.0
            } else {
                let other = match &met {
                    Some(met) => self.selection.pdf(&lit.at, met),
                    None => self.selection.pdf_environment(ray.direction),
                };
                power_heuristic(sample.pdf * lit.bsdf_samples, other * self.emitter_samples as f32)
            };
            sum += sample.weight * emitted * weight;
        }
        sum / lit.bsdf_samples
    }
}

/// What a ray sees of emitters themselves.
pub(crate) fn seen_emission(scene: &Scene, ray: &Ray, point: Option<&SurfacePoint>) -> Rgb {
    let emitters = scene.emitters();
    match point {
        Some(point) if point.emitter == SurfacePoint::NO_EMITTER => Rgb::ZERO,
        Some(point) => emitters.radiance(point, ray.direction),
        None => emitters
            .environment()
            .map_or(Rgb::ZERO, |environment| environment.radiance(ray.direction)),
    }
}

impl PixelEstimator for SelectedDirectLight<'_> {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let id = SampleId {
            x,
            y,
            index: sample_index,
        };
        let mut value = [Rgb::ZERO];
        self.trace_batch(&[id], seed, &mut value);
        value[0]
    }

    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        let together = MAX_BATCH / self.rays_per_sample() as usize;
        for (ids, values) in ids.chunks(together).zip(values.chunks_mut(together)) {
            self.trace_batch(ids, seed, values);
        }
    }
}
