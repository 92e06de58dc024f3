//! Paths that pixels hold as samples for a guide.

use crate::SceneWorld;
use crate::emitter_sampler::EmitterSampler;
use crate::guided::{NOTHING, SceneField, Together};
use lightshed_guiding::GuidingSample;
use lightshed_resampling::ContributionWeight;
use lightshed_sampling::{CounterRng, Density, PrimarySample, luminance};
use lightshed_shift::{PathDomain, PathSample, WorldGeometry, WorldScattering, held_directions};

/// A field that learns from paths after resampling.
///
/// A reservoir's path `x` with the contribution `F` and the weight `W` estimates the integral of
/// its pixel by `F W`. At a vertex that it reaches with the throughput `T` it estimates what leaves
/// the vertex, `w = Y(F / T) W`: the weight of its direction there. The density that belongs to
/// that is `p / W`, where `p` is the density with which the lobes of the vertex sample the
/// direction. With both, `Σ w² p / W` estimates a second moment `∫ f² / p dω` as samples of a path
/// do.
pub(crate) struct Pupil<'f, 'a, S> {
    pub field: &'f SceneField,
    /// The world whose directions are those of the BSDF.
    pub unguided: &'f SceneWorld<'a, S>,
    /// What chooses the pixels that tell.
    pub numbers: (u64, u32),
    /// Pixels are kept whose random word is not above this.
    pub threshold: u32,
}

/// The word that decides whether a pixel tells; nothing else uses it.
const KEEP_WORD: u32 = u32::MAX;

impl<'a, S: EmitterSampler> Pupil<'_, 'a, S> {
    /// Hears of the path that a pixel holds.
    pub fn hear(
        &self,
        pixel: usize,
        domain: &PathDomain<'a, SceneWorld<'a, S>>,
        (path, weight): (&PathSample, ContributionWeight<PrimarySample>),
    ) {
        let (seed, frame) = self.numbers;
        if self.threshold != u32::MAX && CounterRng::at(seed, pixel as u32, frame, KEEP_WORD) > self.threshold
        {
            return;
        }
        let mut samples = Together::new(NOTHING, |samples: &[GuidingSample]| self.field.record(samples));
        held_directions(path, domain, |found| {
            let (world, vertex) = (self.unguided, found.vertex);
            samples.push(GuidingSample {
                position: world.position(vertex),
                direction: found.wi,
                distance: found.distance,
                weight: luminance(found.scattered) * weight.value(),
                pdf: Density::new(found.total_pdf.value() / weight.value()),
                scattering_pdf: world.evaluate(vertex, found.wo, found.wi).pdf,
            });
        });
        samples.finish();
    }
}
