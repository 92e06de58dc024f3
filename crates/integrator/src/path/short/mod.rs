//! Light of paths of at most two edges, by several samples where it varies.

mod allotment;
mod block;
mod look;
mod pilot;
mod rank;
#[cfg(test)]
mod tests;
mod tracer;

use super::guide::DirectionGuide;
use super::numbers::PathWords;
use super::pixels::SHORT;
use super::transport::Transport;
use crate::emitter_sampler::EmitterSampler;
use crate::pixel_table::PixelTable;
use crate::visible_emission::VisibleEmission;
use lightshed_film::{MAX_BATCH, RayTally, SampleId};
use lightshed_sampling::parallel;
use lightshed_scene::Rgb;
pub(crate) use look::{Foreseen, ShortLook};
pub(crate) use tracer::ShortTracer;

/// Estimates the light of paths of at most [`SHORT`] edges by several samples in the pixels where
/// that pays, in place of the one that belongs to a longer path:
///
/// > `1 / k · Σ_{i=1}^{k} (C₁ + C₂)(x̄_i)`
///
/// with the contributions `C_n` of paths of `n` edges and `k` camera rays of their own. This light
/// varies most at the edges of what is lit brightly. Few pixels have such edges, and short paths
/// are cheap; the light that comes over many edges is smooth there and dear.
///
/// Beside paths with several samples of the emitters a short path has as many, or one: at edges of
/// light more camera rays are wanted, and elsewhere more emitters.
///
/// The numbers `k` depend on the scene and its camera alone: a pilot, no sample of which is in the
/// image, measures variances and counts rays. So the estimate is unbiased whatever they are.
/// Directly visible emission that has rays of its own stays there.
pub(crate) struct ShortPaths {
    /// Those of a sample of the method; none where its paths find short paths' light themselves.
    pixels: PixelTable<Several>,
}

/// The short paths of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Several {
    samples: u16,
    /// Whether each has as many samples of the emitters as the method's own, and not one.
    has_all: bool,
}

/// What a method does beside short paths, for each of its samples in a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LongPaths {
    /// The variance of the light of longer paths, in parts of that of a path.
    pub variance: f32,
    /// About what a sample costs, in paths.
    pub paths: u32,
}

impl LongPaths {
    /// Paths.
    pub const ALONE: Self = Self {
        variance: 1.0,
        paths: 1,
    };
    /// Paths that pixels share: with 64 samples a pixel 9 to 25 times less variance in five scenes.
    /// A frame costs 1.5 to 2.3 paths a pixel.
    pub const SHARED: Self = Self {
        variance: 0.1,
        paths: 2,
    };
}

/// The seed of short paths, so that they are independent of the longer ones beside them.
const APART: u64 = 0x7368_6f72_742e_2e2e;

impl ShortPaths {
    /// For paths of `transport` from the scene's camera, beside directly visible emission by rays
    /// of its own. `None` where further samples would gain too little, or a pilot would cost too
    /// much of an image of `samples` samples.
    pub fn new<S: EmitterSampler>(
        transport: &Transport<'_, S>,
        visible: Option<&VisibleEmission>,
        long: LongPaths,
        samples: u32,
    ) -> Option<Self> {
        let tracer = ShortTracer {
            transport,
            visible,
            samples_once: true,
        };
        let (own, all) = (transport.emitter_samples, samples.saturating_mul(long.paths));
        let of_set = pilot::paths_of_set_in(&tracer, all, own)?;
        let mut look = ShortLook::first_half(&tracer, of_set);
        // Numbers that would gain too little if the half that they follow from judged them.
        look.as_if_compared(own).allot(long, own)?;
        look.add_second_half(&tracer);
        if own > 1 {
            let of_paths = ShortTracer {
                samples_once: false,
                ..tracer
            };
            look.compare(&of_paths, long)?;
        }
        let samples = look.allot(long, own)?.samples;
        let several = samples.iter().zip(&look.seen).map(|(&samples, seen)| Several {
            samples,
            has_all: seen.has_all.by_both,
        });
        let several = (0u32..).zip(several).filter(|(_, several)| several.samples > 0);
        let settings = transport.scene.settings();
        let pixels = PixelTable::new([settings.width, settings.height], several);
        (!pixels.is_empty()).then_some(Self { pixels })
    }

    /// Which of up to [`MAX_BATCH`] samples leave the light of short paths to this, bit by bit.
    #[inline(always)]
    pub fn taken(&self, ids: &[SampleId]) -> u64 {
        self.pixels.valued(ids)
    }

    /// Adds the light of short paths to the values of the samples that leave it to this. Rays are
    /// counted by `tally`.
    pub fn add<S: EmitterSampler, G: DirectionGuide>(
        &self,
        transport: &Transport<'_, S, G>,
        visible: Option<&VisibleEmission>,
        words: PathWords,
        tally: Option<&RayTally>,
        (ids, values): (&[SampleId], &mut [Rgb]),
    ) {
        let words = PathWords {
            seed: words.seed ^ APART,
            ..words
        };
        let mut batch = Batch::default();
        let mut trace = |batch: &mut Batch| {
            let tracer = ShortTracer {
                transport,
                visible,
                samples_once: !batch.has_all,
            };
            let found = tracer.up_to(SHORT, words, &batch.ids[..batch.count], tally);
            for place in 0..batch.count {
                values[batch.owners[place]] += found[place] * batch.weights[place];
            }
            batch.count = 0;
        };
        for (owner, id) in ids.iter().enumerate() {
            let Some(&Several { samples, has_all }) = self.pixels.get(self.pixels.pixel(id)) else {
                continue;
            };
            if batch.count > 0 && batch.has_all != has_all {
                trace(&mut batch);
            }
            batch.has_all = has_all;
            let samples = u32::from(samples);
            for sample in 0..samples {
                let index = id.index.wrapping_mul(samples).wrapping_add(sample);
                batch.push(SampleId { index, ..*id }, owner, 1.0 / samples as f32);
                if batch.count == MAX_BATCH {
                    trace(&mut batch);
                }
            }
        }
        if batch.count > 0 {
            trace(&mut batch);
        }
    }

    /// [`add`](Self::add) to all pixels of a frame, the samples of this index.
    pub fn add_frame<S: EmitterSampler>(
        &self,
        transport: &Transport<'_, S>,
        visible: Option<&VisibleEmission>,
        (words, frame): (PathWords, u32),
        tally: &RayTally,
        image: &mut [Rgb],
    ) {
        parallel::for_each_chunk(image, MAX_BATCH, |start, values| {
            let ids = &self.pixels.samples(start, frame)[..values.len()];
            self.add(transport, visible, words, Some(tally), (ids, values));
        });
    }
}

/// Short paths that are traced together.
struct Batch {
    ids: [SampleId; MAX_BATCH],
    /// Places of the samples that they are for, and their weights.
    owners: [usize; MAX_BATCH],
    weights: [f32; MAX_BATCH],
    count: usize,
    /// Whether all have as many samples of the emitters as the method's own paths, or all one.
    has_all: bool,
}

impl Default for Batch {
    fn default() -> Self {
        Self {
            ids: [SampleId::default(); MAX_BATCH],
            owners: [0; MAX_BATCH],
            weights: [0.0; MAX_BATCH],
            count: 0,
            has_all: false,
        }
    }
}

impl Batch {
    fn push(&mut self, id: SampleId, owner: usize, weight: f32) {
        let place = self.count % MAX_BATCH;
        self.ids[place] = id;
        (self.owners[place], self.weights[place]) = (owner, weight);
        self.count += 1;
    }
}
