//! What further short paths bring a pixel, and sums over pixels where they bring the same.

use std::ops::RangeInclusive;

/// Logarithms of the least that a ray must take from the error.
pub const GAINS: std::ops::Range<i32> = -24..24;

/// Ranks from the greatest without further paths to the least with the most of them, at any gain.
const RANKS: RangeInclusive<i32> = -24..=64;
const RANK_COUNT: usize = (*RANKS.end() - *RANKS.start() + 1) as usize;

/// The greatest `r` with `variance ≥ 2^r · cost`: it tells the number of paths of a pixel at any
/// gain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rank(i32);

impl Rank {
    /// Of a pixel's variance, and the cost of one path.
    pub fn of(variance: f64, cost: f64) -> Self {
        let rank = (variance / cost).log2().floor();
        let rank = if rank.is_nan() { f64::NEG_INFINITY } else { rank };
        Self((rank as i32).clamp(*RANKS.start(), *RANKS.end()))
    }

    /// The power of two of paths of which the last still take `2^gain` for their cost, if there are
    /// more than `own` and no more than `most`; 0 where `own` are enough.
    ///
    /// The second half of `2k` paths takes `variance / 2k`, for the cost of `k`.
    pub fn samples(self, gain: i32, (own, most): (u32, u32)) -> u32 {
        let left = self.0 - gain - 1;
        let doublings = if left < 0 { 0 } else { left as u32 / 2 + 1 };
        let samples = 1 << doublings.min(most.next_power_of_two().ilog2());
        if samples > own { samples } else { 0 }
    }
}

/// What a pixel adds to the error and to the cost of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Part {
    /// Error by one short path, and by a path of the method's own.
    pub short: f64,
    pub own: f64,
    /// Rays of a short path, and of a path of the method's own.
    pub cost: f64,
    pub own_cost: f64,
}

/// Sums of parts by rank, of pixels whose paths have the same bounds on their number.
pub struct Sums([Part; RANK_COUNT]);

impl Default for Sums {
    fn default() -> Self {
        Self([Part::default(); RANK_COUNT])
    }
}

impl Sums {
    /// Adds a pixel.
    pub fn add(&mut self, rank: Rank, part: Part) {
        let sum = &mut self.0[(rank.0 - RANKS.start()) as usize];
        sum.short += part.short;
        sum.own += part.own;
        sum.cost += part.cost;
        sum.own_cost += part.own_cost;
    }

    /// Error that is left at a gain, rays of short paths, and rays of those of the method's own
    /// paths that they may replace.
    pub fn at(&self, gain: i32, bounds: (u32, u32)) -> [f64; 3] {
        let mut all = [0.0; 3];
        for (rank, sum) in RANKS.zip(&self.0) {
            let of_rank = match Rank(rank).samples(gain, bounds) {
                0 => [sum.own, 0.0, 0.0],
                samples => {
                    let samples = f64::from(samples);
                    [sum.short / samples, samples * sum.cost, sum.own_cost]
                }
            };
            all.iter_mut()
                .zip(of_rank)
                .for_each(|(all, of_rank)| *all += of_rank);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of paths, one doubling after the other.
    fn slowly(variance: f64, cost: f64, gain: i32, (own, most): (u32, u32)) -> u32 {
        let gain = cost * 2f64.powi(gain);
        let mut samples = 1;
        while samples < most && variance >= gain * f64::from(2 * samples * samples) {
            samples *= 2;
        }
        if samples > own { samples } else { 0 }
    }

    /// Ranks tell the numbers that follow one by one, and sums what they do pixel by pixel.
    /// Planted faults: one doubling more; ranks of one range for gains of another; a pixel's own
    /// error by short paths.
    #[test]
    fn ranks_tell_numbers() {
        let values = (0..400u32).map(|i| {
            let scatter = f64::from(i.wrapping_mul(2654435761) >> 12) / f64::from(1 << 20);
            (2f64.powf(60.0 * scatter - 30.0), 0.3 + f64::from(i % 7))
        });
        let edges = [
            (0.0, 1.0),
            (1e200, 1e-3),
            (8.0, 1.0),
            (7.999_999, 1.0),
            (1e-300, 2.0),
        ];
        let pixels: Vec<(f64, f64)> = values.chain(edges).collect();
        for bounds in [(1, 64), (4, 256), (3, 192), (100, 4096)] {
            let mut sums = Sums::default();
            for &(variance, cost) in &pixels {
                let part = Part {
                    short: 1.0 + cost,
                    own: 0.25 * (1.0 + cost),
                    cost,
                    own_cost: 3.0 * cost,
                };
                sums.add(Rank::of(variance, cost), part);
            }
            for gain in GAINS {
                let mut expected = [0.0; 3];
                for &(variance, cost) in &pixels {
                    let samples = slowly(variance, cost, gain, bounds);
                    assert_eq!(
                        Rank::of(variance, cost).samples(gain, bounds),
                        samples,
                        "{variance} {cost} {gain}"
                    );
                    let error = (1.0 + cost) / if samples > 0 { f64::from(samples) } else { 4.0 };
                    let own_cost = if samples > 0 { 3.0 * cost } else { 0.0 };
                    for (sum, value) in expected
                        .iter_mut()
                        .zip([error, f64::from(samples) * cost, own_cost])
                    {
                        *sum += value;
                    }
                }
                for (found, expected) in sums.at(gain, bounds).into_iter().zip(expected) {
                    assert!(
                        (found - expected).abs() <= 1e-9 * expected,
                        "{gain} {bounds:?}: {found} {expected}"
                    );
                }
            }
        }
        // Nothing is brought by nothing, whatever it costs.
        assert_eq!(Rank::of(0.0, 0.0).samples(-24, (1, 64)), 0);
    }
}
