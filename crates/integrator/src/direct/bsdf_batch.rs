//! Rays of BSDF samples that wait for a full batch.

use crate::emitter_sampler::EmitterSampler;
use crate::path::transport::{Bounce, met_emission};
use crate::ray_batch::{NOWHERE, see_emitters};
use lightshed_film::MAX_BATCH;
use lightshed_sampling::power_heuristic;
use lightshed_scene::{Ray, Rgb, Scene};

/// Rays in directions sampled by BSDFs, with their owners, traced in batches of the best size.
pub(super) struct BsdfBatch<K> {
    rays: [Ray; MAX_BATCH],
    samples: [Option<BsdfSampled<K>>; MAX_BATCH],
    count: usize,
}

/// A ray's direction, sampled by a BSDF.
pub(super) struct BsdfSampled<K> {
    /// For which of the values.
    pub owner: usize,
    /// `f |cos θ| / p` of the direction.
    pub weight: Rgb,
    pub bounce: Bounce<K>,
}

impl<K> BsdfBatch<K> {
    pub fn new() -> Self {
        Self {
            rays: [NOWHERE; MAX_BATCH],
            samples: [const { None }; MAX_BATCH],
            count: 0,
        }
    }

    /// One more ray; false if no further one fits.
    #[inline(always)]
    pub fn push(&mut self, ray: Ray, sampled: BsdfSampled<K>) -> bool {
        self.rays[self.count] = ray;
        self.samples[self.count] = Some(sampled);
        self.count += 1;
        self.count < MAX_BATCH
    }

    /// Traces them, and adds `w f |cos θ| L_e / p` to the values of their owners, in the order of
    /// arrival. `samples` are the numbers of samples of the emitters and of the BSDF at each point.
    #[inline(never)]
    pub fn flush<S>(&mut self, scene: &Scene, sampler: &S, samples: [u32; 2], values: &mut [Rgb])
    where
        S: EmitterSampler<Site = K>,
    {
        let count = std::mem::take(&mut self.count);
        let (traced, mut hits, mut hidden) = (self.rays, [None; MAX_BATCH], [false; MAX_BATCH]);
        see_emitters(
            scene,
            &mut self.rays[..count],
            &mut hits[..count],
            &mut hidden[..count],
        );
        let [emitter_samples, bsdf_samples] = samples.map(|samples| samples as f32);
        for (((ray, hit), hidden), sampled) in traced.iter().zip(hits).zip(hidden).zip(&self.samples[..count])
        {
            let Some(sampled) = sampled.as_ref().filter(|_| !hidden) else {
                continue;
            };
            let point = hit.map(|hit| scene.surface(ray, &hit));
            let emitted = met_emission(scene, ray, point.as_ref());
            if emitted == Rgb::ZERO {
                continue;
            }
            let bounce = &sampled.bounce;
            let weight = if bounce.is_delta {
                1.0
            } else {
                let other = bounce.emitter_pdf(sampler, ray, point.as_ref());
                power_heuristic(bounce.pdf * bsdf_samples, other * emitter_samples)
            };
            values[sampled.owner] += sampled.weight * emitted * weight;
        }
    }
}
