//! What a pilot has seen of short paths, and what follows for an image.

use super::allotment::{Allotment, Costs, allot, least_long, near_sums};
use super::pilot::{self, Chosen, PathCosts, Seen};
use super::{LongPaths, SHORT, ShortTracer};
use crate::emitter_sampler::EmitterSampler;

/// One pixel of so many varies most.
const ONE_VARYING_OF: usize = 8;

/// What a pilot has seen of short paths.
#[derive(Clone)]
pub(crate) struct ShortLook {
    pub(super) seen: Vec<Seen>,
    pub(super) size: [usize; 2],
    /// Paths of a set, which were stratified together.
    pub(super) of_set: usize,
    pub(super) costs: PathCosts,
    /// Edges of the longest paths.
    pub(super) longest: u32,
}

impl ShortLook {
    /// Looks at the pixels of the scene's image with so many paths in each of the pilot's sets.
    pub fn new<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize) -> Self {
        let mut look = Self::first_half(tracer, of_set);
        look.add_second_half(tracer);
        look
    }

    pub(super) fn add_second_half<S: EmitterSampler>(&mut self, tracer: &ShortTracer<'_, '_, S>) {
        pilot::look_again(tracer, self.of_set, &mut self.seen);
    }

    /// Looks with half of the pilot's sets.
    pub(super) fn first_half<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize) -> Self {
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
    pub(super) fn as_if_compared(&self, own: u32) -> Self {
        let mut look = self.clone();
        if own > 1 {
            for seen in &mut look.seen {
                seen.own = seen.short.map(|short| short / (own as f32).sqrt());
                seen.has_all = Chosen::by_all(true);
            }
        }
        look
    }

    /// Looks at paths with several samples of the emitters, too, where short paths may take their
    /// place. `None` where they gain too little anywhere.
    pub(super) fn compare<S: EmitterSampler>(
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
    pub(super) fn most_varying(&self) -> Vec<usize> {
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
    pub(super) fn choose_kinds(&mut self, own: u32, of_paths: &[Option<Seen>]) {
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
    pub(super) fn allot(&self, long: LongPaths, own: u32) -> Option<Allotment> {
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
    /// not seen. It is the same where paths are shared: with less, a pilot promises too much of
    /// objects under a sky.
    pub least_long: f32,
    /// Whether there are no longer paths.
    pub are_all: bool,
    /// Samples that were stratified together.
    pub stratified: u32,
}
