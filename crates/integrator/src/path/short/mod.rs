//! Light of paths of at most two edges, by several samples where it varies.

mod allotment;
mod block;
mod pilot;
mod rank;
#[cfg(test)]
mod tests;

use super::ending::NoEnding;
use super::guide::{DirectionGuide, NoGuide};
use super::numbers::PathWords;
use super::observer::NoObserver;
use super::pixels::{Pixels, SHORT};
use super::transport::Transport;
use crate::emitter_sampler::EmitterSampler;
use crate::pixel_table::PixelTable;
use crate::visible_emission::VisibleEmission;
use allotment::{Allotment, Costs, allot, least_long, near_sums};
use lightshed_film::{MAX_BATCH, RayTally, SampleId};
use lightshed_sampling::parallel;
use lightshed_scene::Rgb;
use pilot::{Chosen, PathCosts, Seen};

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

/// One pixel of so many varies most.
const ONE_VARYING_OF: usize = 8;

/// What a pilot has seen of short paths.
#[derive(Clone)]
pub(crate) struct ShortLook {
    seen: Vec<Seen>,
    size: [usize; 2],
    /// Paths of a set, which were stratified together.
    of_set: usize,
    costs: PathCosts,
    /// Edges of the longest paths.
    longest: u32,
}

impl ShortLook {
    /// Looks at the pixels of the scene's image with so many paths in each of the pilot's sets.
    pub fn new<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize) -> Self {
        let mut look = Self::first_half(tracer, of_set);
        look.add_second_half(tracer);
        look
    }

    fn add_second_half<S: EmitterSampler>(&mut self, tracer: &ShortTracer<'_, '_, S>) {
        pilot::look_again(tracer, self.of_set, &mut self.seen);
    }

    /// Looks with half of the pilot's sets.
    fn first_half<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize) -> Self {
        let (seen, costs) = pilot::look(tracer, of_set);
        let transport = tracer.transport;
        let settings = transport.scene.settings();
        Self {
            seen,
            size: [settings.width, settings.height].map(|side| side as usize),
            of_set,
            costs,
            longest: transport.max_depth,
        }
    }

    /// With what a look at paths with `own` samples of the emitters may show: something between no
    /// gain and all of it.
    fn as_if_compared(&self, own: u32) -> Self {
        let mut look = self.clone();
        if own > 1 {
            for seen in &mut look.seen {
                seen.own = seen.short.map(|short| short / (own as f32).sqrt());
                seen.has_all = Chosen {
                    by_half: [true; 2],
                    by_both: true,
                };
            }
        }
        look
    }

    /// Looks at paths with several samples of the emitters, too, where short paths may take their
    /// place. `None` where they gain too little anywhere.
    fn compare<S: EmitterSampler>(
        &mut self,
        of_paths: &ShortTracer<'_, '_, S>,
        long: LongPaths,
    ) -> Option<()> {
        let own = of_paths.transport.emitter_samples;
        let places = self.promising(own, long)?;
        self.compare_at(places, of_paths);
        Some(())
    }

    /// The same in the pilot of another choice: where they seem to gain too little, it looks where
    /// light varies most. There one emitter sample may be as good as several, which is not known
    /// yet.
    pub fn compare_at_least_somewhere<S: EmitterSampler>(
        &mut self,
        of_paths: &ShortTracer<'_, '_, S>,
        long: LongPaths,
    ) {
        let own = of_paths.transport.emitter_samples;
        let places = self.promising(own, long);
        self.compare_at(places.unwrap_or_else(|| self.most_varying()), of_paths);
    }

    /// The pixels in which short paths may take the place of paths with `own` emitter samples;
    /// `None` where they gain too little.
    fn promising(&self, own: u32, long: LongPaths) -> Option<Vec<usize>> {
        let samples = self.as_if_compared(own).allot(long, own)?.samples;
        let may_be = samples.iter().enumerate().filter(|(_, samples)| **samples > 0);
        Some(may_be.map(|(place, _)| place).collect())
    }

    /// The pixels around which short paths vary most, and most for their brightness: one of
    /// [`ONE_VARYING_OF`] each.
    fn most_varying(&self) -> Vec<usize> {
        let near = near_sums(self.size, |pixel| {
            let seen = &self.seen[pixel];
            [seen.short[0] + seen.short[1], seen.brightness]
        });
        let count = near.len() / ONE_VARYING_OF;
        let mut is_taken = vec![false; near.len()];
        for is_relative in [false, true] {
            let key = |&pixel: &usize| {
                let [variance, brightness] = near[pixel];
                let scale = if is_relative { brightness * brightness } else { 1.0 };
                if variance > 0.0 { variance / scale } else { 0.0 }
            };
            let mut pixels: Vec<usize> = (0..near.len()).collect();
            pixels.sort_by(|a, b| key(b).total_cmp(&key(a)));
            pixels[..count].iter().for_each(|&pixel| is_taken[pixel] = true);
        }
        let taken = is_taken.into_iter().enumerate().filter(|(_, is_taken)| *is_taken);
        taken.map(|(pixel, _)| pixel).collect()
    }

    fn compare_at<S: EmitterSampler>(&mut self, places: Vec<usize>, of_paths: &ShortTracer<'_, '_, S>) {
        let own = of_paths.transport.emitter_samples;
        let [width, _] = self.size;
        let pixel = |place: &usize| [place % width, place / width].map(|at| at as u32);
        let pixels: Vec<[u32; 2]> = places.iter().map(pixel).collect();
        let mut looked = vec![None; self.seen.len()];
        for (place, seen) in places
            .into_iter()
            .zip(pilot::look_at_pixels(of_paths, self.of_set, &pixels))
        {
            looked[place] = Some(seen);
        }
        self.choose_kinds(own, &looked);
    }

    /// Chooses what short paths take the place of a path with `own` samples of the emitters: those
    /// with one, or with as many, whichever have the lesser product of cost and variance in a pixel
    /// and its neighbours. `of_paths` has seen the latter. Where it has not, a path is taken to be
    /// worth as many short ones as it has samples.
    ///
    /// Each half chooses for itself: the lesser of two variances of few samples is less than either
    /// will be, so that only the other half can judge it.
    fn choose_kinds(&mut self, own: u32, of_paths: &[Option<Seen>]) {
        let sums = [0, 1].map(|half| {
            near_sums(self.size, |pixel| {
                let of_path = of_paths[pixel].map(|of_path| of_path.short[half]);
                of_path.map_or([0.0; 2], |of_path| [self.seen[pixel].short[half], of_path])
            })
        });
        let cost = PathCosts::ONE.beside(own).whole;
        let has_all = |[short, all]: [f32; 2]| all * cost < short;
        for (pixel, (seen, of_path)) in self.seen.iter_mut().zip(of_paths).enumerate() {
            let Some(of_path) = of_path else {
                seen.own = seen.short.map(|short| short / own as f32);
                seen.has_all = Chosen::default();
                continue;
            };
            let [first, second] = sums.each_ref().map(|sums| sums[pixel]);
            seen.own = of_path.short;
            seen.has_all = Chosen {
                by_half: [first, second].map(has_all),
                by_both: has_all([first[0] + second[0], first[1] + second[1]]),
            };
        }
    }

    /// Whether there are no longer paths.
    fn are_all(&self) -> bool {
        Self::are_short(self.longest)
    }

    /// The samples that pixels get beside such longer paths, which have `own` samples of the
    /// emitters; `None` where they gain too little.
    fn allot(&self, long: LongPaths, own: u32) -> Option<Allotment> {
        let costs = Costs {
            all: self.costs.beside(own).whole * long.paths as f32,
            own,
            is_replaced: self.are_all(),
        };
        allot(&self.seen, self.size, long.variance, costs)
    }

    /// The samples that pixels get in an image of `samples` paths, and the part of its work that
    /// the pilot costs. `None` where that is too much, or short paths gain too little.
    fn of_image(&self, long: LongPaths, samples: u32, own: u32) -> Option<(Allotment, f32)> {
        let costs = self.costs.beside(own);
        let of_set = pilot::paths_of_set(samples, self.longest, costs)?;
        let allotment = self.allot(long, own)?;
        let pilot = pilot::share(samples, self.longest, costs, of_set);
        Some((allotment, pilot))
    }

    /// With the kinds of short paths that take the place of paths with `own` samples of the
    /// emitters. `of_paths` is a look at those, in the same pixels.
    pub fn with_kinds(&self, own: u32, of_paths: &Self) -> Self {
        let mut look = self.clone();
        if own > 1 {
            let of_paths: Vec<_> = of_paths.seen.iter().copied().map(Some).collect();
            look.choose_kinds(own, &of_paths);
        }
        look
    }

    /// Whether an image of so many short paths with `own` samples of the emitters, and no longer
    /// ones, may have a pilot, as far as that is known without a look.
    pub fn may_be_alone_in(samples: u32, own: u32) -> bool {
        pilot::may_be_in(samples, SHORT, own)
    }

    /// Whether paths of at most `longest` edges are all short.
    pub fn are_short(longest: u32) -> bool {
        longest <= SHORT
    }

    /// What short paths do in an image of `samples` samples, or frames, in each pixel, beside paths
    /// with `own` samples of the emitters, whose kinds are chosen.
    pub fn foreseen(&self, long: LongPaths, samples: u32, own: u32) -> Foreseen {
        let of_image = self.of_image(long, samples.saturating_mul(long.paths), own);
        let allotment = of_image.as_ref().map(|(allotment, _)| allotment);
        let variances = self.seen.iter().enumerate().map(|(pixel, seen)| {
            let one = seen.own_variance();
            let left = allotment.map(|allotment| allotment.left[pixel] / 3.0);
            [one, left.unwrap_or(one)].map(|variance| variance + seen.emission_variance())
        });
        Foreseen {
            variances: variances.collect(),
            cost: of_image
                .as_ref()
                .map_or(1.0, |(allotment, pilot)| allotment.cost + pilot),
            least_long: least_long(&self.seen, self.are_all()) as f32,
            are_all: self.are_all(),
            stratified: self.of_set as u32,
        }
    }
}

/// What short paths do in an image.
pub(crate) struct Foreseen {
    /// Variance of the light of short paths in each pixel, in the mean over colours: of one path,
    /// and with the samples that the pixel gets. That of directly visible emission is in both.
    pub variances: Vec<[f32; 2]>,
    /// What a sample of the method costs with them and with its part of the pilot, in parts of what
    /// it costs without.
    pub cost: f32,
    /// The least variance of longer paths, in parts of that of short ones: rare bright paths are
    /// not seen.
    pub least_long: f32,
    /// Whether there are no longer paths.
    pub are_all: bool,
    /// Samples that were stratified together.
    pub stratified: u32,
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

/// What traces short paths.
pub(crate) struct ShortTracer<'t, 'a, S, G = NoGuide> {
    pub transport: &'t Transport<'a, S, G>,
    /// What sees emission directly in place of paths.
    pub visible: Option<&'t VisibleEmission>,
    /// Whether paths have one sample of the emitters, whatever the transport has.
    pub samples_once: bool,
}

impl<S: EmitterSampler, G: DirectionGuide> ShortTracer<'_, '_, S, G> {
    /// What paths of at most `longest` edges find, if the transport has such, but for directly
    /// visible emission that has rays of its own.
    fn up_to(
        &self,
        longest: u32,
        words: PathWords,
        ids: &[SampleId],
        tally: Option<&RayTally>,
    ) -> [Rgb; MAX_BATCH] {
        let transport = self.transport;
        let taken = self.visible.map_or(0, |visible| visible.taken(ids));
        let pixels = Pixels::new(words, &NoObserver, &NoEnding, ids);
        let pixels = pixels.without_visible(taken).counted_by(tally);
        let pixels = pixels.with_one_emitter_sample(self.samples_once);
        pixels.trace(
            transport,
            transport.scene.camera(),
            longest.min(transport.max_depth),
        )
    }

    /// What rays of their own find of directly visible emission that paths leave out.
    fn emission(&self, words: PathWords, ids: &[SampleId]) -> [Rgb; MAX_BATCH] {
        let mut found = [Rgb::ZERO; MAX_BATCH];
        if let Some(visible) = self.visible {
            let scene = self.transport.scene;
            visible.add(scene, scene.camera(), (words.points, words.seed), ids, &mut found);
        }
        found
    }
}
