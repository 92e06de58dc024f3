//! Direct light only.

use crate::path::camera_ray;
use crate::path::next_event::{Bounce, SampleCounts, met_emission, sample_emission};
use lightshed_film::PixelEstimator;
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Ray, Rgb, Scene};
use std::fmt;

/// Estimates emission and light that is scattered once: all paths of one or two edges.
///
/// The point that a camera ray meets contributes `L_e + ∫ f(ω_o, ω) L_e(ω) |cos θ| dω`, in the solid-angle measure. The
/// integral is estimated by `n` samples of the emitters and `m` of the BSDF, combined with the power heuristic for these
/// numbers (Veach 1997 §9.2.4, eq. 9.10). Its expectation is that of [`PathTracer`](crate::PathTracer) at a longest path
/// of two edges, for any `n, m ≥ 1`: more samples at the point spend less on camera rays.
///
/// With `n = 0` emitters that the BSDF cannot meet (points, spots, directions) are not seen, with `m = 0` delta lobes scatter
/// nothing; everything else is still unbiased.
///
/// ```
/// use lightshed_integrator::DirectLight;
/// use lightshed_film::PixelEstimator;
/// use lightshed_scene::{Scene, builtin};
///
/// let scene = Scene::new(&builtin::furnace())?;
/// let estimator = DirectLight::with_samples(&scene, 2, 1)?;
/// let sample = estimator.sample(0, 0, 0, 7);
/// assert_eq!(sample, lightshed_scene::Rgb::ONE);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct DirectLight<'a> {
    scene: &'a Scene,
    emitter_samples: u32,
    bsdf_samples: u32,
}

/// Most samples of emitters, and of the BSDF, at one point.
pub const MAX_DIRECT_SAMPLES: u32 = 1 << 16;

/// Why numbers of samples are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DirectLightError {
    /// Neither emitters nor the BSDF would be sampled.
    NoSamples,
    /// One of the numbers exceeds [`MAX_DIRECT_SAMPLES`].
    TooManySamples(u32),
}

impl fmt::Display for DirectLightError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSamples => write!(f, "neither emitters nor the BSDF are to be sampled"),
            Self::TooManySamples(count) => {
                write!(f, "{count} samples at a point are more than {MAX_DIRECT_SAMPLES}")
            }
        }
    }
}

impl std::error::Error for DirectLightError {}

impl<'a> DirectLight<'a> {
    /// One sample of the emitters and one of the BSDF.
    pub fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            emitter_samples: 1,
            bsdf_samples: 1,
        }
    }

    /// The given numbers of samples at the point that a camera ray meets.
    ///
    /// # Errors
    ///
    /// Both numbers are zero, or one exceeds [`MAX_DIRECT_SAMPLES`].
    pub fn with_samples(
        scene: &'a Scene,
        emitter_samples: u32,
        bsdf_samples: u32,
    ) -> Result<Self, DirectLightError> {
        let most = emitter_samples.max(bsdf_samples);
        match most {
            0 => Err(DirectLightError::NoSamples),
            _ if most > MAX_DIRECT_SAMPLES => Err(DirectLightError::TooManySamples(most)),
            _ => Ok(Self {
                scene,
                emitter_samples,
                bsdf_samples,
            }),
        }
    }

    /// Radiance that arrives along `ray`: emitted where it meets something, or scattered there once.
    #[inline]
    pub fn radiance(&self, ray: Ray, rng: &mut CounterRng) -> Rgb {
        let scene = self.scene;
        let point = scene.intersect(&ray);
        let emitted = met_emission(scene, &ray, point.as_ref(), None);
        let Some(point) = point else {
            return emitted;
        };
        let bsdf = scene.bsdf(&point);
        let wo = point.shading.to_local(-ray.direction);
        let counts = SampleCounts {
            emitter: self.emitter_samples as f32,
            bsdf: self.bsdf_samples as f32,
        };
        let mut from_emitters = Rgb::ZERO;
        for _ in 0..self.emitter_samples {
            if let Some(shadow) = sample_emission(scene, &point, &bsdf, wo, counts, rng)
                && !scene.occluded(&shadow.ray)
            {
                from_emitters += shadow.radiance;
            }
        }
        let mut from_bsdf = Rgb::ZERO;
        for _ in 0..self.bsdf_samples {
            let u_lobe = rng.next_f32();
            let Some(sample) = bsdf.sample(wo, u_lobe, Vec2::from(rng.next_2d())) else {
                continue;
            };
            let bounce = Bounce {
                from: point.position,
                pdf: sample.pdf,
                is_delta: sample.is_delta,
                counts,
            };
            let ray = point.spawn(point.shading.to_world(sample.wi));
            let met = scene.intersect(&ray);
            from_bsdf += sample.weight * met_emission(scene, &ray, met.as_ref(), Some(bounce));
        }
        // A technique without samples has a sum of zero.
        emitted + from_emitters / counts.emitter.max(1.0) + from_bsdf / counts.bsdf.max(1.0)
    }
}

impl PixelEstimator for DirectLight<'_> {
    #[inline]
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let mut rng = CounterRng::new(seed, y << 16 | x, sample_index);
        let ray = camera_ray(self.scene, x, y, &mut rng);
        self.radiance(ray, &mut rng)
    }
}
