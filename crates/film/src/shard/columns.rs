//! Statistics of some rows of pixels in columns of one number each, so that a row of a shard is
//! merged by loops over plain arrays.

use super::layout::Row;
use crate::PixelStatistics;
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};

/// The statistics of `rows · width` pixels, row by row.
pub struct Columns {
    width: usize,
    /// The count of all pixels of a row, if they have the same count and no sample was left out.
    uniform: Vec<Option<u64>>,
    count: Vec<u64>,
    non_finite: Vec<u64>,
    mean: [Vec<f64>; 3],
    m2: [Vec<f64>; 3],
    lanes: LaneChoice,
}

impl Columns {
    /// No samples yet.
    pub fn new(rows: usize, width: usize) -> Self {
        let pixels = rows * width;
        Self {
            width,
            uniform: vec![Some(0); rows],
            count: vec![0; pixels],
            non_finite: vec![0; pixels],
            mean: std::array::from_fn(|_| vec![0.0; pixels]),
            m2: std::array::from_fn(|_| vec![0.0; pixels]),
            lanes: LaneChoice::best(),
        }
    }

    /// The pixel in column `x` of row `y`; `None` if no samples can have its statistics.
    #[inline]
    pub fn pixel(&self, x: usize, y: usize) -> Option<PixelStatistics> {
        let at = y * self.width + x;
        let of = |columns: &[Vec<f64>; 3]| std::array::from_fn(|channel| columns[channel][at]);
        let count = self.uniform[y].unwrap_or(self.count[at]);
        PixelStatistics::from_parts(count, self.non_finite[at], of(&self.mean), of(&self.m2))
    }

    /// Adds rows of shards, one after the other, to row `y`, with the bits of
    /// [`PixelStatistics::merge`]. `samples` are those of every pixel in each shard.
    ///
    /// Whether the values can be those of samples shows in [`Columns::pixel`] in the end: what is
    /// not finite stays so.
    pub fn merge<const K: usize>(&mut self, y: usize, rows: [&Row<'_>; K], samples: [u64; K]) {
        let all = (0..K).all(|k| rows[k].has_all(samples[k]));
        match self.uniform[y] {
            Some(before) if all => {
                self.uniform[y] = Some(before + samples.iter().sum::<u64>());
                self.merge_uniform(y, rows, before as f64, samples.map(|samples| samples as f64));
            }
            before => {
                if let Some(before) = before {
                    self.count[y * self.width..][..self.width].fill(before);
                    self.uniform[y] = None;
                }
                (0..K).for_each(|k| self.merge_each(y, rows[k], samples[k]));
            }
        }
    }

    /// All pixels have `before` samples before and `samples` in each shard.
    fn merge_uniform<const K: usize>(
        &mut self,
        y: usize,
        rows: [&Row<'_>; K],
        before: f64,
        samples: [f64; K],
    ) {
        let mut n_a = before;
        let weights = samples.map(|n_b| {
            let n = n_a + n_b;
            let weights = [n_a / n, n_b / n, n_a * (n_b / n)];
            n_a = n;
            weights
        });
        for channel in 0..3 {
            let means = &mut self.mean[channel][y * self.width..][..self.width];
            let m2s = &mut self.m2[channel][y * self.width..][..self.width];
            let of_shards = rows.map(|row| {
                let ([a, b], [c, d]) = (row.mean(channel), row.deviations(channel));
                [a, b, c, d].map(|words| &words[..self.width])
            });
            let kernel = MergeRows {
                means,
                m2s,
                of_shards,
                weights,
            };
            if self.lanes.run(kernel) {
                // A sum of squares is negative: no pixel of the row is one of samples.
                let m2s = &mut self.m2[channel][y * self.width..][..self.width];
                m2s.fill(f64::NAN);
            }
        }
    }

    fn merge_each(&mut self, y: usize, row: &Row<'_>, samples: u64) {
        for x in 0..self.width {
            let at = y * self.width + x;
            let (Some(mut sum), Some(pixel)) = (self.pixel(x, y), row.pixel(x, samples)) else {
                self.m2[0][at] = f64::NAN;
                continue;
            };
            sum.merge(&pixel);
            (self.count[at], self.non_finite[at]) = (sum.count(), sum.non_finite());
            for channel in 0..3 {
                self.mean[channel][at] = sum.mean()[channel];
                self.m2[channel][at] = sum.squared_deviations()[channel];
            }
        }
    }
}

/// One channel of a row: whatever lanes there are, the compiler makes vectors of the loop.
struct MergeRows<'a, const K: usize> {
    means: &'a mut [f64],
    m2s: &'a mut [f64],
    /// Of each shard the halves of means and of sums of squares, as many as there are pixels.
    of_shards: [[&'a [[u8; 4]]; 4]; K],
    /// `n_a / n`, `n_b / n` and `n_a n_b / n` of each shard.
    weights: [[f64; 3]; K],
}

impl<const K: usize> LaneKernel for MergeRows<'_, K> {
    /// Whether a sum of squares is negative.
    type Output = bool;

    // With iterators over the shards it takes a tenth more.
    #[expect(clippy::needless_range_loop)]
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let width = self.means.len();
        let (means, m2s) = (self.means, &mut self.m2s[..width]);
        let mut of_shards = self.of_shards;
        for words in of_shards.as_flattened_mut() {
            *words = &words[..width];
        }
        let mut signs = 0;
        for x in 0..width {
            let (mut mean, mut m2) = (means[x], m2s[x]);
            for k in 0..K {
                let [mean_high, mean_low, m2_high, m2_low] = of_shards[k];
                let [share_a, share_b, between] = self.weights[k];
                let m2_sign = u32::from_le_bytes(m2_high[x]);
                let mean_b = real(mean_high[x], mean_low[x]);
                let m2_b = real(m2_high[x], m2_low[x]);
                let delta = mean_b - mean;
                mean = mean * share_a + mean_b * share_b;
                m2 += m2_b + delta * delta * between;
                signs |= m2_sign;
            }
            means[x] = mean;
            m2s[x] = m2;
        }
        signs >> 31 != 0
    }
}

#[inline(always)]
fn real(high: [u8; 4], low: [u8; 4]) -> f64 {
    f64::from_bits(u64::from(u32::from_le_bytes(high)) << 32 | u64::from(u32::from_le_bytes(low)))
}
