//! The subset: stratified along the curve, by clamped diagonals mixed with uniform weights.

use super::clamp::{WeightHistogram, stratum_beside_uniform};
use lightshed_sampling::parallel::for_each_chunk;

const CHUNK: usize = Sampling::CHUNK;

/// How a subset is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Share of the primitives that it is to have, in `(0, 1]`.
    pub fraction: f64,
    /// Share of uniform weights, in `[0, 1)`.
    pub uniform: f64,
    /// Where in its stratum each point lies, in `[0, 1)`.
    pub offset: f64,
}

impl Sampling {
    /// Primitives that a thread takes at once. Sums begin anew with each chunk, so that they do not
    /// depend on the threads.
    pub const CHUNK: usize = 1 << 13;

    /// The number of strata for so many primitives, at least 1: the subset has no more primitives.
    pub fn strata(&self, count: usize) -> f64 {
        (count as f64 * self.fraction)
            .ceil()
            .clamp(1.0, count.max(1) as f64)
    }
}

/// Of `count` primitives along a curve, the places of those in the subset, ascending.
///
/// Primitive `i` has the probability `pᵢ = u / N + (1 − u) min(wᵢ, c) / Σ min(w, c)` of each
/// of `M` strata of `[0, 1)` (Dittebrandt 2025, eq. 8.3), with `w` the square root of
/// `squared_weight`; a stratum has one point, all of them at the same place in it. Primitives with
/// `pᵢ ≥ 1 / M` are always in.
pub fn sample(count: usize, squared_weight: impl Fn(usize) -> f32 + Sync, sampling: &Sampling) -> Vec<u32> {
    let chunks = count.div_ceil(CHUNK);
    let range = |chunk: usize| chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
    let mut histograms = vec![WeightHistogram::default(); chunks];
    for_each_chunk(&mut histograms, 1, |chunk, histogram| {
        for i in range(chunk) {
            histogram[0].add_squared(squared_weight(i));
        }
    });
    let mut histogram = WeightHistogram::default();
    histograms.iter().for_each(|other| histogram.merge(other));

    let strata = sampling.strata(count);
    let clamp = histogram.clamp(stratum_beside_uniform(1.0 / strata, sampling.uniform, count));
    let clamped = |i: usize| f64::from(squared_weight(i).sqrt()).min(clamp);
    let mut sums = vec![0.0; chunks];
    for_each_chunk(&mut sums, 1, |chunk, sum| {
        for i in range(chunk) {
            sum[0] += clamped(i);
        }
    });
    let total: f64 = sums.iter().sum();
    // Without any weight all is uniform.
    let (uniform, by_weight) = if total > 0.0 && total.is_finite() {
        (sampling.uniform, (1.0 - sampling.uniform) * strata / total)
    } else {
        (1.0, 0.0)
    };
    let uniform = uniform * strata / count.max(1) as f64;
    // Sums of all chunks before each.
    let mut before = 0.0;
    for sum in &mut sums {
        before += core::mem::replace(sum, before);
    }
    // The place that all weights before an item come to, and how many points lie before it.
    let place = |i: usize, sum: f64| i as f64 * uniform + sum * by_weight - sampling.offset;
    let points_before = |i: usize, sum: f64| place(i, sum).ceil() as i64;
    let mut chosen: Vec<Vec<u32>> = vec![Vec::new(); chunks];
    for_each_chunk(&mut chosen, 1, |chunk, chosen| {
        let range = range(chunk);
        let mut sum = sums[chunk];
        let mut points = points_before(range.start, sum);
        // The next chunk begins where this one ends.
        let last_points = match sums.get(chunk + 1) {
            Some(&sum) => points_before(range.end, sum),
            None => strata as i64,
        };
        for i in range.clone() {
            sum += clamped(i);
            let is_last = i + 1 == range.end;
            // Points are whole, so that few places have to be rounded up.
            if !is_last && place(i + 1, sum) <= points as f64 {
                continue;
            }
            let next = if is_last {
                last_points
            } else {
                points_before(i + 1, sum)
            };
            if next > points {
                chosen[0].push(i as u32);
            }
            points = next.max(points);
        }
    });
    chosen.concat()
}
