//! Direct light only.

use super::bsdf_batch::{BsdfBatch, BsdfSampled};
use super::shadow_batch::ShadowBatch;
use crate::emitter_sampler::EmitterSampler;
use crate::path::scattering::{SurfaceVertex, Vertex};
use crate::path::transport::{Bounce, met_emission};
use crate::ray_batch::NOWHERE;
use crate::visible_emission::VisibleEmission;
use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
use lightshed_sampling::{CounterRng, PointSet, PointStream, power_heuristic};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{EmitterSample, EmittersByPower, Ray, Rgb, Scene};
use std::fmt;
use std::sync::Arc;

/// The samples of [`DirectLight`] at the point that a camera ray hits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectLightOptions {
    /// Samples of the emitters, n.
    pub emitter_samples: u32,
    /// Samples of the BSDF, m.
    pub bsdf_samples: u32,
    /// Whether diffuse surfaces get BSDF samples, too. There BSDF samples find the same emitters as
    /// emitter samples, but less often, unless an emitter is near and sampled by its area, or as
    /// wide as the sky.
    pub bsdf_samples_where_diffuse: bool,
    /// Parts of a pixel along each side, k: a sample of the pixel is the mean over `k²` camera
    /// rays, one in each part, and the `k² n` emitter samples of all of them are stratified
    /// together. At most [`MAX_CAMERA_STRATA`].
    pub camera_strata: u32,
}

impl DirectLightOptions {
    /// This number of samples of the emitters and of the BSDF, everywhere.
    pub const fn samples(emitter_samples: u32, bsdf_samples: u32) -> Self {
        Self {
            emitter_samples,
            bsdf_samples,
            bsdf_samples_where_diffuse: true,
            camera_strata: 1,
        }
    }
}

impl Default for DirectLightOptions {
    /// One sample of the emitters and one of the BSDF everywhere.
    fn default() -> Self {
        Self::samples(1, 1)
    }
}

/// Most samples of emitters, and of the BSDF, at one point.
pub const MAX_DIRECT_SAMPLES: u32 = 1 << 16;

/// Most parts of a pixel along each side: their camera rays make one batch.
pub const MAX_CAMERA_STRATA: u32 = 8;
const _: () = assert!((MAX_CAMERA_STRATA * MAX_CAMERA_STRATA) as usize <= MAX_BATCH);

/// Why options are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DirectLightError {
    /// Neither emitters nor the BSDF would be sampled.
    NoSamples,
    /// One of the numbers exceeds [`MAX_DIRECT_SAMPLES`].
    TooManySamples(u32),
    /// The parts of a pixel along each side are not 1 to [`MAX_CAMERA_STRATA`].
    CameraStrata(u32),
}

impl fmt::Display for DirectLightError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSamples => write!(f, "neither emitters nor the BSDF are to be sampled"),
            Self::TooManySamples(count) => {
                write!(f, "{count} samples at a point are more than {MAX_DIRECT_SAMPLES}")
            }
            Self::CameraStrata(parts) => {
                write!(
                    f,
                    "a pixel has 1 to {MAX_CAMERA_STRATA} parts along each side, not {parts}"
                )
            }
        }
    }
}

impl std::error::Error for DirectLightError {}

/// Estimates emission and light that is scattered once: all paths of one or two edges.
///
/// The point that a camera ray hits contributes `L_e + ∫ f(ω_o, ω) L_e(ω) |cos θ| dω`, in
/// the solid-angle measure. The integral is estimated by `n` samples of the emitters and `m` of the
/// BSDF, combined with the power heuristic for these numbers (Veach 1997 §9.2.4, eq. 9.10). Its
/// expectation is that of [`PathTracer`](crate::PathTracer) at a longest path of two edges, for any
/// `n, m ≥ 1` and any [`EmitterSampler`]. With more samples at the point, fewer camera rays are
/// needed.
///
/// The i-th emitter sample uses a number from the i-th of `n` equal parts of the unit interval.
/// Light trees keep the order of lights, so no two samples select the same region of lights unless
/// it is that bright.
///
/// With `n = 0`, emitters that the BSDF cannot hit (points, spots, directions) contribute nothing.
/// With `m = 0`, delta lobes scatter nothing. Everything else is still unbiased.
///
/// ```
/// use lightshed_film::PixelEstimator;
/// use lightshed_integrator::{DirectLight, DirectLightOptions};
/// use lightshed_scene::{Scene, builtin};
///
/// let scene = Scene::new(&builtin::furnace())?;
/// let options = DirectLightOptions::samples(2, 1);
/// let estimator = DirectLight::new(&scene, scene.emitters_by_power(), options)?;
/// let sample = estimator.sample(0, 0, 0, 7);
/// assert_eq!(sample, lightshed_scene::Rgb::ONE);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct DirectLight<'a, S = EmittersByPower<'a>> {
    scene: &'a Scene,
    sampler: S,
    options: DirectLightOptions,
    points: PointSet,
    /// The estimator of directly visible emission, if that is not the camera's own rays.
    visible: Option<Arc<VisibleEmission>>,
}

/// Sets the numbers of rays for visible emission apart from those of all other rays.
const VISIBLE_STREAM: u64 = 1 << 63;

/// Number of selections that are made together.
const TOGETHER: usize = 16;

/// A dimension of the random numbers that no ray of a sample reaches.
const SHIFT_DIMENSION: u32 = u32::MAX;

/// A surface point to be lit.
#[derive(Clone, Copy)]
struct Lit<'v, K> {
    vertex: &'v SurfaceVertex,
    site: K,
    /// Number of its BSDF samples.
    bsdf_samples: u32,
}

impl<'a, S: EmitterSampler> DirectLight<'a, S> {
    /// With emitters chosen by `sampler`.
    ///
    /// # Errors
    ///
    /// See [`DirectLightError`].
    pub fn new(scene: &'a Scene, sampler: S, options: DirectLightOptions) -> Result<Self, DirectLightError> {
        let most = options.emitter_samples.max(options.bsdf_samples);
        match most {
            0 => Err(DirectLightError::NoSamples),
            _ if most > MAX_DIRECT_SAMPLES => Err(DirectLightError::TooManySamples(most)),
            _ if !(1..=MAX_CAMERA_STRATA).contains(&options.camera_strata) => {
                Err(DirectLightError::CameraStrata(options.camera_strata))
            }
            _ => Ok(Self {
                scene,
                sampler,
                options,
                points: PointSet::Independent,
                visible: None,
            }),
        }
    }

    /// With samples whose numbers are those of `points`; the default is independent ones.
    #[must_use]
    pub fn with_points(mut self, points: PointSet) -> Self {
        self.points = points;
        self
    }

    /// With several camera rays a sample where emitting surfaces may be visible, as
    /// [`PathTracer::with_visible_emission`](crate::PathTracer::with_visible_emission) has them.
    #[must_use]
    pub fn with_visible_emission(mut self) -> Self {
        // As many edges as there are rays to emitters, and that of the camera.
        let edges = self
            .options
            .emitter_samples
            .saturating_add(self.options.bsdf_samples);
        let visible = VisibleEmission::new(self.scene, self.scene.camera(), true, edges);
        self.visible = visible.map(Arc::new);
        self
    }

    fn rays_per_sample(&self) -> u32 {
        self.options.camera_strata * self.options.camera_strata
    }

    /// Ray number `part` of a sample, through that part of the pixel.
    #[inline(always)]
    fn camera_ray(&self, id: SampleId, part: u32, rng: &mut PointStream) -> Ray {
        let camera = self.scene.camera();
        let k = self.options.camera_strata;
        let [dx, dy] = rng.next_2d();
        let u_lens = if camera.has_lens() {
            rng.next_2d()
        } else {
            [0.5; 2]
        };
        let within = Vec2::new((part % k) as f32 + dx, (part / k) as f32 + dy) / k as f32;
        camera.ray(Vec2::new(id.x as f32, id.y as f32) + within, u_lens)
    }

    /// The number of samples that need up to [`MAX_BATCH`] camera rays.
    fn trace_batch(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        let (scene, each) = (self.scene, self.rays_per_sample() as usize);
        let count = ids.len().min(values.len()) * each;
        let mut rngs: [PointStream; MAX_BATCH] = std::array::from_fn(|place| {
            let id = ids.get(place / each).copied().unwrap_or_default();
            let number = id.index.wrapping_mul(each as u32) + (place % each) as u32;
            PointStream::new(self.points, seed, id.y << 16 | id.x, number)
        });
        let (mut rays, mut hits) = ([NOWHERE; MAX_BATCH], [None; MAX_BATCH]);
        for (place, (ray, rng)) in rays.iter_mut().zip(&mut rngs).enumerate().take(count) {
            *ray = self.camera_ray(ids[place / each], (place % each) as u32, rng);
        }
        let accelerator = scene.accelerator();
        accelerator.intersect_many(&rays[..count], &mut hits[..count]);
        for hit in hits[..count].iter().flatten() {
            scene.prefetch_primitive(hit.primitive);
        }
        let (mut waiting, mut bounced) = (ShadowBatch::new(), None);
        let numbers = [self.options.emitter_samples, self.options.bsdf_samples];
        let (mut emitted, mut from_emitters) = ([Rgb::ZERO; MAX_BATCH], [Rgb::ZERO; MAX_BATCH]);
        let mut from_bsdf = [Rgb::ZERO; MAX_BATCH];
        let taken = self.visible.as_ref().map_or(0, |visible| visible.taken(ids));
        for place in 0..count {
            let (ray, rng) = (&rays[place], &mut rngs[place]);
            let point = hits[place].map(|hit| scene.surface(ray, &hit));
            if point.is_none() || taken >> (place / each) & 1 == 0 {
                emitted[place] = met_emission(scene, ray, point.as_ref());
            }
            let Some(point) = point else { continue };
            let vertex = SurfaceVertex::new(scene, ray, point);
            let unwanted = vertex.bsdf.is_diffuse() && !self.options.bsdf_samples_where_diffuse;
            let at = Lit {
                site: self
                    .sampler
                    .site(|| vertex.shading_point(self.sampler.uses_gloss())),
                bsdf_samples: if unwanted { 0 } else { self.options.bsdf_samples },
                vertex: &vertex,
            };
            let id = ids[place / each];
            let shift = match each {
                1 => 0,
                _ => CounterRng::at(seed, id.y << 16 | id.x, id.index, SHIFT_DIMENSION),
            };
            self.sample_emitters(&at, (place % each) as u32, shift, rng, |ray, radiance| {
                waiting.push(scene, ray, place / each, radiance, &mut from_emitters);
            });
            for _ in 0..at.bsdf_samples {
                let batch = bounced.get_or_insert_with(BsdfBatch::new);
                if !self.sample_bsdf(&at, place, rng, batch) {
                    batch.flush(scene, &self.sampler, numbers, &mut from_bsdf);
                }
            }
        }
        waiting.flush(scene, &mut from_emitters);
        if let Some(mut batch) = bounced {
            batch.flush(scene, &self.sampler, numbers, &mut from_bsdf);
        }
        // A technique without samples has a sum of zero.
        let [emitter_samples, bsdf_samples] = numbers.map(|number| number.max(1) as f32);
        values.fill(Rgb::ZERO);
        for place in 0..count {
            let value = &mut values[place / each];
            *value += emitted[place];
            *value += from_bsdf[place] / bsdf_samples;
        }
        for (value, scattered) in values.iter_mut().zip(from_emitters) {
            *value = (*value + scattered / emitter_samples) / each as f32;
        }
        if let Some(visible) = &self.visible {
            let names = (self.points, seed ^ VISIBLE_STREAM);
            visible.add(scene, scene.camera(), names, ids, values);
        }
    }

    /// Passes on the shadow rays of all emitter samples, with their contributions if unoccluded,
    /// times `n`.
    #[inline(always)]
    fn sample_emitters(
        &self,
        lit: &Lit<S::Site>,
        part: u32,
        shift: u32,
        rng: &mut PointStream,
        mut cast: impl FnMut(Ray, Rgb),
    ) {
        if !lit.vertex.has_non_delta() {
            return;
        }
        let (samples, rays) = (self.options.emitter_samples, self.rays_per_sample());
        // `2⁶⁴ / (k² n)`.
        let stratum = u64::MAX / (u64::from(samples) * u64::from(rays)).max(1);
        // The strata of each round that belong to this ray: a random rotation, so that each is
        // equally likely.
        let turned = if rays > 1 { (part + shift % rays) % rays } else { 0 };
        let (mut u, mut done) = ([0; TOGETHER], 0);
        while done < samples {
            let count = (samples - done).min(TOGETHER as u32);
            for (i, u) in (done..).zip(&mut u[..count as usize]) {
                let within = (u128::from(rng.next_u32()) * u128::from(stratum)) >> 32;
                *u = stratum * (u64::from(i) * u64::from(rays) + u64::from(turned)) + within as u64;
            }
            let take = |light: EmitterSample| {
                if let Some((ray, radiance)) = self.towards(lit, &light) {
                    cast(ray, radiance);
                }
            };
            let from = lit.vertex.position();
            self.sampler
                .sample_many(from, &lit.site, &u[..count as usize], || rng.next_2d(), take);
            done += count;
        }
    }

    /// A direction sampled by the BSDF, for the owner `place`; false if no further one fits into
    /// the batch.
    #[inline(always)]
    fn sample_bsdf(
        &self,
        lit: &Lit<S::Site>,
        place: usize,
        rng: &mut PointStream,
        batch: &mut BsdfBatch<S::Site>,
    ) -> bool {
        let u_lobe = rng.next_f32();
        let Some(sample) = lit.vertex.sample(u_lobe, rng.next_2d()) else {
            return true;
        };
        let sampled = BsdfSampled {
            owner: place,
            weight: sample.weight,
            bounce: Bounce {
                from: lit.vertex.position(),
                site: lit.site,
                pdf: sample.pdf,
                is_delta: sample.is_delta,
            },
        };
        batch.push(lit.vertex.point.spawn(sample.direction), sampled)
    }

    /// The shadow ray towards a sampled emitter, with `w f |cos θ| L_e / p`.
    #[inline(always)]
    fn towards(&self, lit: &Lit<S::Site>, light: &EmitterSample) -> Option<(Ray, Rgb)> {
        let scattered = lit.vertex.evaluate(light.direction);
        if scattered.value == Rgb::ZERO {
            return None;
        }
        let weight = if light.is_delta || lit.bsdf_samples == 0 {
            1.0
        } else {
            power_heuristic(
                light.pdf * self.options.emitter_samples as f32,
                scattered.pdf * lit.bsdf_samples as f32,
            )
        };
        Some((
            lit.vertex.shadow_ray(light),
            scattered.value * light.weight * weight,
        ))
    }
}

impl<S: EmitterSampler> PixelEstimator for DirectLight<'_, S> {
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
