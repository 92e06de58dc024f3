//! What short and long paths vary by, pixel by pixel, and what they cost.

use super::block::{Block, MOST_PIXELS, ONE_BLOCK_OF, blocks, few_blocks};
use super::{SHORT, ShortTracer};
use crate::emitter_sampler::EmitterSampler;
use crate::path::numbers::PathWords;
use lightshed_film::{MAX_BATCH, RayCounts, RayTally, SampleId};
use lightshed_sampling::{PointSet, parallel};
use lightshed_scene::Rgb;
use std::mem;
use std::ops::Range;

/// What is known of a pixel. Variances are those of one path, summed over colours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Variance of the light of short paths with one sample of the emitters, stratified as in an
    /// image, as each half of the pilot has found it; twice the first one's before the second.
    pub short: [f32; 2],
    /// The same with as many samples of the emitters as the method's own paths have.
    pub own: [f32; 2],
    /// Variance of the light of all longer paths, in the mean over some pixels of its block.
    pub long: f32,
    /// Mean radiance by short paths, the sum of the colours.
    pub brightness: f32,
    /// That by longer paths, in the same mean as their variance.
    pub long_brightness: f32,
    /// Variance of directly visible emission that has rays of its own, of the rays of one sample,
    /// and its mean radiance.
    pub emission: f32,
    pub emission_brightness: f32,
    /// Rays of a short path with one sample of the emitters, in the mean over this pixel and some
    /// beside it.
    pub cost: f32,
    /// Whether short paths have as many samples of the emitters as the method's own, and not one.
    pub has_all: Chosen,
}

/// What each half of the pilot chooses, to be judged by the other, and what both choose together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Chosen {
    pub by_half: [bool; 2],
    pub by_both: bool,
}

impl Chosen {
    /// The same by all.
    pub fn by_all(has_all: bool) -> Self {
        Self {
            by_half: [has_all; 2],
            by_both: has_all,
        }
    }
}

impl Seen {
    /// Variance of short paths with one sample of the emitters, or with all.
    pub fn variance(&self, has_all: bool) -> [f32; 2] {
        if has_all { self.own } else { self.short }
    }

    /// What the first half has seen, with what the second one has.
    fn with_second(&self, second: &Self) -> Self {
        Self {
            short: [self.short[0], second.short[0]],
            own: [self.own[0], second.own[0]],
            brightness: (self.brightness + second.brightness) / 2.0,
            cost: (self.cost + second.cost) / 2.0,
            ..*self
        }
    }

    /// Variance of the light of the method's own short paths, in the mean over colours.
    pub fn own_variance(&self) -> f32 {
        (self.own[0] + self.own[1]) / 6.0
    }

    /// That of directly visible emission that has rays of its own.
    pub fn emission_variance(&self) -> f32 {
        self.emission / 3.0
    }
}

/// What paths cost in the mean over an image, in rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathCosts {
    /// Of a short path.
    pub short: f32,
    /// Of a path to its end.
    pub whole: f32,
}

/// Sets of short paths in a pixel, each stratified alone: those of a half of the pilot, and all.
const SETS_OF_HALF: usize = 2;
pub const SETS: usize = 2 * SETS_OF_HALF;

/// Sets of which the first path is followed to its end, those of the first half, in one pixel of so
/// many.
pub const FOLLOWED: usize = SETS_OF_HALF;
pub const FOLLOWED_PIXELS: usize = 4;

/// Blocks whose paths are followed together: such paths of a set fill a batch.
const FOLLOWED_TOGETHER: usize = MAX_BATCH * FOLLOWED_PIXELS / MOST_PIXELS;

/// Paths of a set: powers of two.
const OF_SET: [usize; 3] = [LEAST_OF_SET, 4, 8];
const LEAST_OF_SET: usize = 2;

/// The seed of the first set; the next have the next. Seeds of images are rarely these.
const SEED: u64 = 0x6c6f_6f6b_2e2e_2e00;

/// Cost of a camera ray, which is one of many alike, and of the last edge of a path, which ends at
/// emitters: in parts of another ray.
const CAMERA_RAY: f64 = 0.5;
const LAST_EDGE: f64 = 0.5;

/// What a pilot may cost, in parts of the image's work: one of the fewest paths, and one of more.
/// What few paths tell of edges is worth more than what further ones add.
const LEAST_SHARE: f32 = 0.09;
const SHARE: f32 = 0.06;

/// About the least that a short path costs, in whole ones.
const CHEAPEST: f32 = 0.25;

/// What a further sample of the emitters costs, in short paths: four cost 2.7 to 3.0 paths of two
/// edges in four scenes, eight 4.5 to 5.3.
const FURTHER_SAMPLE: f32 = 0.58;

impl PathCosts {
    /// Short paths alone, as the unit.
    pub const ONE: Self = Self {
        short: 1.0,
        whole: 1.0,
    };

    /// Of the same short paths, beside whole ones with `samples` samples of the emitters.
    pub fn beside(self, samples: u32) -> Self {
        let whole = self.whole + FURTHER_SAMPLE * (samples - 1) as f32 * self.short;
        Self { whole, ..self }
    }
}

/// What a pilot with so many paths in each set costs, after a look at few blocks, in parts of the
/// work of an image of `samples` samples by paths of at most `longest` edges.
pub fn share(samples: u32, longest: u32, costs: PathCosts, of_set: usize) -> f32 {
    let followed = match longest {
        0..=SHORT => 0.0,
        _ => FOLLOWED as f32 / FOLLOWED_PIXELS as f32,
    };
    let of_sets = |sets: usize, of_set: usize| followed * costs.whole + (sets * of_set) as f32 * costs.short;
    let few = of_sets(SETS_OF_HALF, LEAST_OF_SET) / ONE_BLOCK_OF as f32;
    (of_sets(SETS, of_set) + few) / (samples as f32 * costs.whole)
}

/// Paths of a set in a pilot for such an image, as many as its share is enough for. `None` where
/// that is too small for the fewest.
pub fn paths_of_set(samples: u32, longest: u32, costs: PathCosts) -> Option<usize> {
    let fits = |&of_set: &usize| {
        let most = if of_set == LEAST_OF_SET {
            LEAST_SHARE
        } else {
            SHARE
        };
        share(samples, longest, costs, of_set) <= most
    };
    OF_SET.into_iter().rev().find(fits).filter(|_| longest > 0)
}

/// Whether an image of so many paths, with `own` samples of the emitters, may have a pilot: most
/// images of few samples need not look at all.
pub fn may_be_in(samples: u32, longest: u32, own: u32) -> bool {
    let least = PathCosts {
        short: if longest > SHORT { CHEAPEST } else { 1.0 },
        ..PathCosts::ONE
    };
    paths_of_set(samples, longest, least.beside(own)).is_some()
}

/// [`paths_of_set`] in a scene, whose paths' costs are found first, in few blocks. The image's have
/// `own` samples of the emitters.
pub fn paths_of_set_in<S: EmitterSampler>(
    tracer: &ShortTracer<'_, '_, S>,
    samples: u32,
    own: u32,
) -> Option<usize> {
    let longest = tracer.transport.max_depth;
    if !may_be_in(samples, longest, own) {
        return None;
    }
    let blocks = few_blocks(image_size(tracer));
    let looked = look_at_all(tracer, LEAST_OF_SET, blocks);
    paths_of_set(samples, longest, costs(&looked, longest).beside(own))
}

/// What the first half of a pilot sees in all pixels of the image, row by row, with so many paths
/// in each set; and what paths cost.
pub fn look<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize) -> (Vec<Seen>, PathCosts) {
    let size = image_size(tracer);
    let looked = look_at_all(tracer, of_set, blocks(size));
    let mut seen = vec![Seen::default(); size[0] * size[1]];
    for block in &looked {
        for (&[x, y], &of_pixel) in block.pixels.iter().zip(&block.seen) {
            seen[y as usize * size[0] + x as usize] = of_pixel;
        }
    }
    (seen, costs(&looked, tracer.transport.max_depth))
}

/// Adds what the second half sees.
pub fn look_again<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize, seen: &mut [Seen]) {
    let [width, height] = image_size(tracer);
    let looked = parallel::map(blocks([width, height]), |_, block| {
        let pixels = block.pixels();
        let second = look_at_short(&trace_of(tracer), Half::Second, of_set, &pixels).0;
        (pixels, second)
    });
    for (pixels, second) in &looked {
        for ([x, y], second) in pixels.iter().zip(second) {
            let of_pixel = &mut seen[*y as usize * width + *x as usize];
            *of_pixel = of_pixel.with_second(second);
        }
    }
}

/// What both halves see of short paths in some pixels, one after the other.
pub fn look_at_pixels<S: EmitterSampler>(
    tracer: &ShortTracer<'_, '_, S>,
    of_set: usize,
    pixels: &[[u32; 2]],
) -> Vec<Seen> {
    let some = pixels.chunks(MAX_BATCH);
    let looked = parallel::map(some, |_, pixels| {
        let half = |half: Half| look_at_short(&trace_of(tracer), half, of_set, pixels).0;
        let both = half(Half::First).into_iter().zip(half(Half::Second));
        both.map(|(first, second)| first.with_second(&second))
            .collect::<Vec<_>>()
    });
    looked.into_iter().flatten().collect()
}

fn image_size<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>) -> [usize; 2] {
    let settings = tracer.transport.scene.settings();
    [settings.width, settings.height].map(|side| side as usize)
}

/// A half of the pilot.
#[derive(Clone, Copy)]
enum Half {
    First,
    Second,
}

/// What the first half sees in blocks, one after the other and pixel by pixel.
#[derive(Default)]
struct Looked {
    pixels: Vec<[u32; 2]>,
    seen: Vec<Seen>,
    /// Where the pixels of each block end.
    ends: Vec<usize>,
    /// Rays of the paths that were followed, and their number.
    followed: f64,
    paths_followed: usize,
}

fn costs(looked: &[Looked], longest: u32) -> PathCosts {
    let (mut short, mut pixels, mut whole, mut paths) = (0.0, 0, 0.0, 0);
    for block in looked {
        short += block.seen.iter().map(|seen| f64::from(seen.cost)).sum::<f64>();
        pixels += block.seen.len();
        whole += block.followed;
        paths += block.paths_followed;
    }
    let short = (short / pixels.max(1) as f64) as f32;
    let whole = (whole / paths.max(1) as f64) as f32;
    PathCosts {
        short,
        whole: if longest > SHORT { whole } else { short },
    }
}

fn cost(rays: RayCounts, path: f64) -> f64 {
    CAMERA_RAY * rays.camera as f64 + path * rays.path as f64 + rays.emitter as f64
}

/// What traces paths up to some edges, of a set, and counts their rays.
type Trace<'t> = dyn Fn(u32, usize, &[SampleId], &RayTally) -> [Rgb; MAX_BATCH] + 't;

/// The numbers of a set.
fn words_of(set: usize) -> PathWords {
    PathWords {
        points: PointSet::Sobol,
        seed: SEED + set as u64,
    }
}

fn trace_of<S: EmitterSampler>(
    tracer: &ShortTracer<'_, '_, S>,
) -> impl Fn(u32, usize, &[SampleId], &RayTally) -> [Rgb; MAX_BATCH] {
    |longest, set, ids, tally| tracer.up_to(longest, words_of(set), ids, Some(tally))
}

/// Adds what the first half's samples in some pixels show of directly visible emission.
fn look_at_emission<S: EmitterSampler>(
    tracer: &ShortTracer<'_, '_, S>,
    of_set: usize,
    pixels: &[[u32; 2]],
    seen: &mut [Seen],
) {
    let Some(visible) = tracer.visible else {
        return;
    };
    let together = MAX_BATCH / of_set;
    for (pixels, seen) in pixels.chunks(together).zip(seen.chunks_mut(together)) {
        let ids = ids_of_set(pixels, of_set);
        if visible.taken(&ids) == 0 {
            continue;
        }
        let means = [0, 1].map(|set| tracer.emission(words_of(set), &ids));
        for (place, seen) in seen.iter_mut().enumerate() {
            let samples = place * of_set..(place + 1) * of_set;
            let [one, other] = means
                .each_ref()
                .map(|found| found[samples.clone()].iter().sum::<Rgb>() / of_set as f32);
            seen.emission = sound(variance(one, other) * of_set as f32);
            seen.emission_brightness = sound((one + other).element_sum() / 2.0);
        }
    }
}

/// The samples of a set in some pixels, pixel by pixel.
fn ids_of_set(pixels: &[[u32; 2]], of_set: usize) -> Vec<SampleId> {
    let of_pixel = |&[x, y]: &[u32; 2]| (0..of_set as u32).map(move |index| SampleId { x, y, index });
    pixels.iter().flat_map(of_pixel).collect()
}

/// What the first half sees in some blocks, at most [`FOLLOWED_TOGETHER`].
fn look_at<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize, blocks: &[Block]) -> Looked {
    let trace = trace_of(tracer);
    let mut looked = Looked::default();
    let mut firsts = Vec::new();
    for block in blocks {
        let pixels = block.pixels();
        let (mut seen, of_block) = look_at_short(&trace, Half::First, of_set, &pixels);
        look_at_emission(tracer, of_set, &pixels, &mut seen);
        looked.ends.push(firsts.len() + pixels.len());
        looked.pixels.extend(pixels);
        looked.seen.extend(seen);
        firsts.extend(of_block);
    }
    if tracer.transport.max_depth > SHORT {
        looked.follow(&trace, &firsts);
    }
    looked
}

/// What the first half sees in blocks of an image.
fn look_at_all<S: EmitterSampler>(
    tracer: &ShortTracer<'_, '_, S>,
    of_set: usize,
    blocks: impl Iterator<Item = Block>,
) -> Vec<Looked> {
    let blocks: Vec<Block> = blocks.collect();
    let together = blocks.chunks(FOLLOWED_TOGETHER);
    parallel::map(together, |_, blocks| look_at(tracer, of_set, blocks))
}

/// What short paths of a half show of pixels, and what the first one of each set finds.
fn look_at_short(
    trace: &Trace<'_>,
    half: Half,
    of_set: usize,
    pixels: &[[u32; 2]],
) -> (Vec<Seen>, Vec<[Rgb; SETS_OF_HALF]>) {
    let (mut seen, mut firsts) = (Vec::new(), Vec::new());
    // The paths of a set fill a batch.
    for pixels in pixels.chunks(MAX_BATCH / of_set) {
        let ids = ids_of_set(pixels, of_set);
        let mut tally = RayTally::default();
        let mut means = vec![[Rgb::ZERO; SETS_OF_HALF]; pixels.len()];
        let first = firsts.len();
        firsts.resize(first + pixels.len(), [Rgb::ZERO; SETS_OF_HALF]);
        for place in 0..SETS_OF_HALF {
            let set = half as usize * SETS_OF_HALF + place;
            let found = trace(SHORT, set, &ids, &tally);
            for (pixel, found) in found[..ids.len()].chunks(of_set).enumerate() {
                means[pixel][place] = found.iter().sum::<Rgb>() / of_set as f32;
                firsts[first + pixel][place] = found[0];
            }
        }
        let cost = cost(tally.take(), LAST_EDGE) / (SETS_OF_HALF * ids.len()) as f64;
        seen.extend(means.iter().map(|&[one, other]| {
            let short = [sound(variance(one, other) * of_set as f32); 2];
            Seen {
                short,
                own: short,
                brightness: sound((one + other).element_sum() / SETS_OF_HALF as f32),
                cost: cost as f32,
                ..Seen::default()
            }
        }));
    }
    (seen, firsts)
}

impl Looked {
    /// Adds what longer paths show. It follows some first paths of the sets to their ends, by the
    /// same numbers.
    fn follow(&mut self, trace: &Trace<'_>, firsts: &[[Rgb; FOLLOWED]]) {
        let blocks = self
            .ends
            .iter()
            .scan(0, |start, &end| Some(mem::replace(start, end)..end));
        let blocks: Vec<Range<usize>> = blocks.collect();
        let followed = blocks
            .iter()
            .cloned()
            .flat_map(|block| block.step_by(FOLLOWED_PIXELS));
        let followed: Vec<usize> = followed.collect();
        let of_first = |&pixel: &usize| {
            let ([x, y], index) = (self.pixels[pixel], 0);
            SampleId { x, y, index }
        };
        let ids: Vec<SampleId> = followed.iter().map(of_first).collect();
        let mut longs = vec![[Rgb::ZERO; FOLLOWED]; ids.len()];
        let mut tally = RayTally::default();
        for set in 0..FOLLOWED {
            let whole = trace(u32::MAX, set, &ids, &tally);
            for ((long, &pixel), whole) in longs.iter_mut().zip(&followed).zip(&whole) {
                long[set] = *whole - firsts[pixel][set];
            }
        }
        (self.followed, self.paths_followed) = (cost(tally.take(), 1.0), FOLLOWED * ids.len());
        let mut longs = longs.as_slice();
        for block in blocks {
            let (of_block, rest) = longs.split_at(block.len().div_ceil(FOLLOWED_PIXELS));
            longs = rest;
            let mean = |of: &dyn Fn(&[Rgb; FOLLOWED]) -> f32| {
                of_block.iter().map(|long| sound(of(long))).sum::<f32>() / of_block.len() as f32
            };
            let long = mean(&|long| variance(long[0], long[1]));
            let brightness = mean(&|long| long.iter().sum::<Rgb>().element_sum() / FOLLOWED as f32);
            for seen in &mut self.seen[block] {
                (seen.long, seen.long_brightness) = (long, brightness);
            }
        }
    }
}

/// The variance of a value, by two: summed over colours.
fn variance(one: Rgb, other: Rgb) -> f32 {
    (one - other).length_squared() / 2.0
}

/// A number that may be summed.
fn sound(value: f32) -> f32 {
    if value > 0.0 { value.min(1e30) } else { 0.0 }
}
