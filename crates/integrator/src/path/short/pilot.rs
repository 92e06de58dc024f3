//! What short and long paths vary by, pixel by pixel, and what they cost.

use super::{SHORT, paths_up_to};
use crate::emitter_sampler::EmitterSampler;
use crate::path::numbers::PathWords;
use crate::path::transport::Transport;
use crate::visible_emission::VisibleEmission;
use lightshed_film::{MAX_BATCH, RayCounts, RayTally, SampleId};
use lightshed_sampling::{PointSet, parallel};
use lightshed_scene::Rgb;

/// What is known of a pixel. Variances are those of one path, summed over colours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Variance of the light of short paths, stratified as in an image, found twice.
    pub short: [f32; 2],
    /// Variance of the light of all longer paths.
    pub long: f32,
    /// Mean radiance, the sum of the colours.
    pub brightness: f32,
    /// Rays of a short path, in the mean over this pixel and some beside it.
    pub cost: f32,
}

impl Seen {
    /// Variance of the light of a short path, in the mean over colours.
    pub fn short_variance(&self) -> f32 {
        (self.short[0] + self.short[1]) / 6.0
    }
}

/// Sets of short paths in a pixel, each stratified alone. The first paths of some are followed to
/// their ends.
pub const SETS: usize = 4;
pub const FOLLOWED: usize = 2;

/// Most paths of a set.
const MOST_OF_SET: usize = 8;

/// Pixels that are looked at together: the paths of a set fill a batch.
const TOGETHER: usize = MAX_BATCH / MOST_OF_SET;

/// The seed of the first set; the next have the next. Seeds of images are rarely these.
const SEED: u64 = 0x6c6f_6f6b_2e2e_2e00;

/// Cost of a camera ray, which is one of many alike, and of the last edge of a path, which ends at
/// emitters: in parts of another ray.
const CAMERA_RAY: f64 = 0.5;
const LAST_EDGE: f64 = 0.5;

/// What a pilot may cost, in parts of the image's work.
const SHARE: f32 = 0.05;

/// About what a short path costs in rooms, in whole ones, and at most but for objects under a sky.
const SHORT_PATH: [f32; 2] = [0.3, 0.5];

/// Paths of a set, a power of two, in a pilot for an image of `samples` samples by paths of at most
/// `longest` edges: as many as its share is enough for, or two. `None` where it is too small for
/// two of usual cost.
pub fn paths_of_set(samples: u32, longest: u32) -> Option<usize> {
    let (whole, short) = match longest {
        0 => return None,
        1..=SHORT => (0.0, [1.0; 2]),
        _ => (FOLLOWED as f32, SHORT_PATH),
    };
    let left = (SHARE * samples as f32 - whole).max(0.0);
    let [most, certain] = short.map(|cost| (left / (cost * SETS as f32)) as usize);
    (most > 1).then(|| 1 << certain.clamp(2, MOST_OF_SET).ilog2())
}

/// What is seen in all pixels of the image, row by row, with so many paths in each set; and the
/// cost of a whole path, in rays.
pub fn look<S: EmitterSampler>(
    transport: &Transport<'_, S>,
    visible: Option<&VisibleEmission>,
    of_set: usize,
) -> (Vec<Seen>, f32) {
    let settings = transport.scene.settings();
    let mut seen = vec![Seen::default(); (settings.width * settings.height) as usize];
    let mut followed = RayTally::default();
    parallel::for_each_chunk(&mut seen, TOGETHER, |start, seen| {
        look_at((transport, visible), of_set, start, seen, &followed);
    });
    let pixels = seen.len().max(1) as f64;
    let all = match transport.max_depth > SHORT {
        true => cost(followed.take(), 1.0) / (pixels * FOLLOWED as f64),
        false => seen.iter().map(|seen| f64::from(seen.cost)).sum::<f64>() / pixels,
    };
    (seen, all as f32)
}

fn cost(rays: RayCounts, path: f64) -> f64 {
    CAMERA_RAY * rays.camera as f64 + path * rays.path as f64 + rays.emitter as f64
}

/// Looks at the pixels from `start` on, at most [`TOGETHER`].
fn look_at<S: EmitterSampler>(
    (transport, visible): (&Transport<'_, S>, Option<&VisibleEmission>),
    of_set: usize,
    start: usize,
    seen: &mut [Seen],
    followed: &RayTally,
) {
    let mut tally = RayTally::default();
    let width = transport.scene.settings().width as usize;
    let id = |pixel: usize, index: usize| SampleId {
        x: ((start + pixel) % width) as u32,
        y: ((start + pixel) / width) as u32,
        index: index as u32,
    };
    let ids: [SampleId; MAX_BATCH] = std::array::from_fn(|i| id(i / of_set, i % of_set));
    let firsts: [SampleId; TOGETHER] = std::array::from_fn(|pixel| id(pixel, 0));
    let mut means = [[Rgb::ZERO; SETS]; TOGETHER];
    let mut longs = [[Rgb::ZERO; FOLLOWED]; TOGETHER];
    for set in 0..SETS {
        let words = PathWords {
            points: PointSet::Sobol,
            seed: SEED + set as u64,
        };
        let trace = |longest: u32, ids: &[SampleId], tally: &RayTally| {
            let longest = longest.min(transport.max_depth);
            paths_up_to(longest, transport, visible, words, ids, Some(tally))
        };
        let found = trace(SHORT, &ids[..seen.len() * of_set], &tally);
        for (means, found) in means.iter_mut().zip(found.chunks(of_set)) {
            means[set] = found.iter().sum::<Rgb>() / of_set as f32;
        }
        if set < FOLLOWED && transport.max_depth > SHORT {
            // The same numbers, so these are the same paths, to their ends.
            let whole = trace(u32::MAX, &firsts[..seen.len()], followed);
            for (pixel, longs) in longs.iter_mut().enumerate() {
                longs[set] = whole[pixel] - found[pixel * of_set];
            }
        }
    }
    let cost = cost(tally.take(), LAST_EDGE) / (seen.len() * SETS * of_set).max(1) as f64;
    for ((seen, means), longs) in seen.iter_mut().zip(&means).zip(&longs) {
        let variance = |one: Rgb, other: Rgb| (one - other).length_squared() / 2.0;
        let [short, long] = [&means[..], longs].map(|values| values.iter().sum::<Rgb>().element_sum());
        *seen = Seen {
            short: [0, 2].map(|set| sound(variance(means[set], means[set + 1]) * of_set as f32)),
            long: sound(variance(longs[0], longs[1])),
            brightness: sound(short / SETS as f32 + long / FOLLOWED as f32),
            cost: cost as f32,
        };
    }
}

/// A number that may be summed.
fn sound(value: f32) -> f32 {
    if value > 0.0 { value.min(1e30) } else { 0.0 }
}
