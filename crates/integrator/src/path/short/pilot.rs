//! What short and long paths vary by, pixel by pixel, and what they cost.

use super::block::{Block, blocks};
use super::{SHORT, ShortTracer};
use crate::emitter_sampler::EmitterSampler;
use crate::path::numbers::PathWords;
use lightshed_film::{MAX_BATCH, RayCounts, RayTally, SampleId};
use lightshed_sampling::{PointSet, parallel};
use lightshed_scene::Rgb;

/// What is known of a pixel. Variances are those of one path, summed over colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Variance of the light of short paths, stratified as in an image, found twice.
    pub short: [f32; 2],
    /// Variance of the light of all longer paths, in the mean over some pixels of its block.
    pub long: f32,
    /// Mean radiance, the sum of the colours; that of longer paths in the same mean.
    pub brightness: f32,
    /// Rays of a short path, in the mean over this pixel and some beside it.
    pub cost: f32,
    /// Short paths that have together the variance of one of the method's own, which may have
    /// several samples of the emitters.
    pub own: f32,
    /// Whether short paths have as many samples of the emitters as the method's own, and not one.
    pub has_all: bool,
}

impl Default for Seen {
    fn default() -> Self {
        Self {
            short: [0.0; 2],
            long: 0.0,
            brightness: 0.0,
            cost: 0.0,
            own: 1.0,
            has_all: false,
        }
    }
}

impl Seen {
    /// The same with short paths that have `own` samples of the emitters, as `of_path` shows them.
    pub fn with_all(&self, of_path: &Self, own: u32) -> Self {
        Self {
            short: of_path.short,
            cost: PathCosts::ONE.beside(own).whole * self.cost,
            own: 1.0,
            has_all: true,
            ..*self
        }
    }

    /// Variance of the light of a short path, in the mean over colours.
    pub fn short_variance(&self) -> f32 {
        (self.short[0] + self.short[1]) / 6.0
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

/// Sets of short paths in a pixel, each stratified alone.
pub const SETS: usize = 4;

/// Sets of which the first path is followed to its end, in one pixel of so many.
pub const FOLLOWED: usize = 2;
pub const FOLLOWED_PIXELS: usize = 4;

/// Most paths of a set.
const MOST_OF_SET: usize = 8;

/// The seed of the first set; the next have the next. Seeds of images are rarely these.
const SEED: u64 = 0x6c6f_6f6b_2e2e_2e00;

/// Cost of a camera ray, which is one of many alike, and of the last edge of a path, which ends at
/// emitters: in parts of another ray.
const CAMERA_RAY: f64 = 0.5;
const LAST_EDGE: f64 = 0.5;

/// What a pilot may cost, in parts of the image's work.
const SHARE: f32 = 0.06;

/// About the least that a short path costs, in whole ones.
const CHEAPEST: f32 = 0.25;

/// One block of so many tells what paths cost.
const ONE_BLOCK_OF: usize = 16;

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

/// Paths of a set, a power of two, in a pilot for an image of `samples` samples by paths of at most
/// `longest` edges: as many as its share is enough for. `None` where that is too small for two.
pub fn paths_of_set(samples: u32, longest: u32, costs: PathCosts) -> Option<usize> {
    let followed = match longest {
        0 => return None,
        1..=SHORT => 0.0,
        _ => FOLLOWED as f32 / FOLLOWED_PIXELS as f32,
    };
    let known = (followed * costs.whole + (2 * SETS) as f32 * costs.short) / ONE_BLOCK_OF as f32;
    let left = SHARE * samples as f32 * costs.whole - followed * costs.whole - known;
    let paths = (left / (costs.short * SETS as f32)) as usize;
    (paths > 1).then(|| 1 << paths.min(MOST_OF_SET).ilog2())
}

/// [`paths_of_set`] in a scene, whose paths' costs are found first, in few blocks. The image's have
/// `own` samples of the emitters.
pub fn paths_of_set_in<S: EmitterSampler>(
    tracer: &ShortTracer<'_, '_, S>,
    samples: u32,
    own: u32,
) -> Option<usize> {
    let longest = tracer.transport.max_depth;
    let short = if longest > SHORT { CHEAPEST } else { 1.0 };
    // Most images of few samples need not look at all.
    let least = PathCosts {
        short,
        ..PathCosts::ONE
    };
    paths_of_set(samples, longest, least.beside(own))?;
    let blocks = blocks(image_size(tracer)).step_by(ONE_BLOCK_OF);
    let looked = parallel::map(blocks, |_, block| look_at(tracer, 2, &block));
    paths_of_set(samples, longest, costs(&looked, longest).beside(own))
}

/// What is seen in all pixels of the image, row by row, with so many paths in each set; and what
/// paths cost.
pub fn look<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize) -> (Vec<Seen>, PathCosts) {
    let size = image_size(tracer);
    let looked = parallel::map(blocks(size), |_, block| look_at(tracer, of_set, &block));
    let mut seen = vec![Seen::default(); size[0] * size[1]];
    for block in &looked {
        for (&[x, y], &of_pixel) in block.pixels.iter().zip(&block.seen) {
            seen[y as usize * size[0] + x as usize] = of_pixel;
        }
    }
    (seen, costs(&looked, tracer.transport.max_depth))
}

/// What is seen of short paths in some pixels, one after the other.
pub fn look_at_pixels<S: EmitterSampler>(
    tracer: &ShortTracer<'_, '_, S>,
    of_set: usize,
    pixels: &[[u32; 2]],
) -> Vec<Seen> {
    let some = pixels.chunks(MAX_BATCH);
    let looked = parallel::map(some, |_, pixels| {
        look_at_short(&trace_of(tracer), of_set, pixels).0
    });
    looked.into_iter().flatten().collect()
}

fn image_size<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>) -> [usize; 2] {
    let settings = tracer.transport.scene.settings();
    [settings.width, settings.height].map(|side| side as usize)
}

/// What is seen in a block, pixel by pixel, and rays of the paths that were followed.
struct Looked {
    pixels: Vec<[u32; 2]>,
    seen: Vec<Seen>,
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

fn trace_of<S: EmitterSampler>(
    tracer: &ShortTracer<'_, '_, S>,
) -> impl Fn(u32, usize, &[SampleId], &RayTally) -> [Rgb; MAX_BATCH] {
    |longest, set, ids, tally| {
        let words = PathWords {
            points: PointSet::Sobol,
            seed: SEED + set as u64,
        };
        tracer.up_to(longest, words, ids, Some(tally))
    }
}

fn look_at<S: EmitterSampler>(tracer: &ShortTracer<'_, '_, S>, of_set: usize, block: &Block) -> Looked {
    let trace = trace_of(tracer);
    let pixels = block.pixels();
    let (seen, firsts) = look_at_short(&trace, of_set, &pixels);
    let looked = Looked {
        pixels,
        seen,
        followed: 0.0,
        paths_followed: 0,
    };
    match tracer.transport.max_depth > SHORT {
        true => follow(&trace, &firsts, looked),
        false => looked,
    }
}

/// What short paths show of pixels, and what the first one of each set finds.
fn look_at_short(trace: &Trace<'_>, of_set: usize, pixels: &[[u32; 2]]) -> (Vec<Seen>, Vec<[Rgb; SETS]>) {
    let (mut seen, mut firsts) = (Vec::new(), Vec::new());
    // The paths of a set fill a batch.
    for pixels in pixels.chunks(MAX_BATCH / of_set) {
        let of_pixel = |&[x, y]: &[u32; 2]| (0..of_set as u32).map(move |index| SampleId { x, y, index });
        let ids: Vec<SampleId> = pixels.iter().flat_map(of_pixel).collect();
        let mut tally = RayTally::default();
        let mut means = vec![[Rgb::ZERO; SETS]; pixels.len()];
        let first = firsts.len();
        firsts.resize(first + pixels.len(), [Rgb::ZERO; SETS]);
        for set in 0..SETS {
            let found = trace(SHORT, set, &ids, &tally);
            for (pixel, found) in found[..ids.len()].chunks(of_set).enumerate() {
                means[pixel][set] = found.iter().sum::<Rgb>() / of_set as f32;
                firsts[first + pixel][set] = found[0];
            }
        }
        let cost = cost(tally.take(), LAST_EDGE) / (SETS * ids.len()) as f64;
        seen.extend(means.iter().map(|means| {
            let variance = |set: usize| variance(means[set], means[set + 1]) * of_set as f32;
            Seen {
                short: [0, 2].map(|set| sound(variance(set))),
                brightness: sound(means.iter().sum::<Rgb>().element_sum() / SETS as f32),
                cost: cost as f32,
                ..Seen::default()
            }
        }));
    }
    (seen, firsts)
}

/// Adds what longer paths show. It follows some first paths of the sets to their ends, by the same
/// numbers.
fn follow(trace: &Trace<'_>, firsts: &[[Rgb; SETS]], looked: Looked) -> Looked {
    let mut tally = RayTally::default();
    let of_first = |&[x, y]: &[u32; 2]| SampleId { x, y, index: 0 };
    let followed = looked.pixels.iter().step_by(FOLLOWED_PIXELS);
    let ids: Vec<SampleId> = followed.map(of_first).collect();
    let mut longs = vec![[Rgb::ZERO; FOLLOWED]; ids.len()];
    for set in 0..FOLLOWED {
        let whole = trace(u32::MAX, set, &ids, &tally);
        let short = firsts.iter().step_by(FOLLOWED_PIXELS);
        for ((long, short), whole) in longs.iter_mut().zip(short).zip(&whole) {
            long[set] = *whole - short[set];
        }
    }
    let mean = |of: &dyn Fn(&[Rgb; FOLLOWED]) -> f32| {
        longs.iter().map(|long| sound(of(long))).sum::<f32>() / longs.len() as f32
    };
    let long = mean(&|long| variance(long[0], long[1]));
    let brightness = mean(&|long| long.iter().sum::<Rgb>().element_sum() / FOLLOWED as f32);
    let add = |seen: Seen| Seen {
        long,
        brightness: sound(seen.brightness + brightness),
        ..seen
    };
    Looked {
        seen: looked.seen.into_iter().map(add).collect(),
        followed: cost(tally.take(), 1.0),
        paths_followed: FOLLOWED * ids.len(),
        pixels: looked.pixels,
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
