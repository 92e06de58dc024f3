//! Statistics of some rows of pixels in columns of one number each, so that a row of a shard is
//! merged by loops over plain arrays.

use super::layout::Row;
use crate::PixelStatistics;

/// The statistics of `rows · width` pixels, row by row.
pub struct Columns {
    width: usize,
    /// The count of all pixels of a row, if they have the same count and no sample was left out.
    uniform: Vec<Option<u64>>,
    count: Vec<u64>,
    non_finite: Vec<u64>,
    mean: [Vec<f64>; 3],
    m2: [Vec<f64>; 3],
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
        }
    }

    /// The pixel in column `x` of row `y`; `None` if no samples can have its statistics.
    pub fn pixel(&self, x: usize, y: usize) -> Option<PixelStatistics> {
        let at = y * self.width + x;
        let of = |columns: &[Vec<f64>; 3]| std::array::from_fn(|channel| columns[channel][at]);
        let count = self.uniform[y].unwrap_or(self.count[at]);
        PixelStatistics::from_parts(count, self.non_finite[at], of(&self.mean), of(&self.m2))
    }

    /// Adds row `y` of a shard of `samples` samples, with the bits of [`PixelStatistics::merge`].
    /// False if a pixel's statistics are not those of so many samples.
    pub fn merge(&mut self, y: usize, row: &Row<'_>, samples: u64) -> bool {
        match self.uniform[y] {
            Some(before) if row.has_all(samples) => {
                self.uniform[y] = Some(before + samples);
                self.merge_uniform(y, row, before as f64, samples as f64)
            }
            before => {
                if let Some(before) = before {
                    self.count[y * self.width..][..self.width].fill(before);
                    self.uniform[y] = None;
                }
                self.merge_each(y, row, samples)
            }
        }
    }

    /// All pixels have `n_a` samples before and `n_b` in the shard.
    fn merge_uniform(&mut self, y: usize, row: &Row<'_>, n_a: f64, n_b: f64) -> bool {
        let n = n_a + n_b;
        let (share_a, share_b, between) = (n_a / n, n_b / n, n_a * (n_b / n));
        let mut unsound = 0;
        for channel in 0..3 {
            let means = &mut self.mean[channel][y * self.width..][..self.width];
            let m2s = &mut self.m2[channel][y * self.width..][..self.width];
            let [mean_high, mean_low] = row.mean(channel);
            let [m2_high, m2_low] = row.deviations(channel);
            let of_shard = mean_high.iter().zip(mean_low).zip(m2_high.iter().zip(m2_low));
            for ((mean, m2), ((a, b), (c, d))) in means.iter_mut().zip(m2s).zip(of_shard) {
                let [a, b, c, d] = [a, b, c, d].map(|bytes| u32::from_le_bytes(*bytes));
                let (mean_b, m2_b) = (real(a, b), real(c, d));
                let delta = mean_b - *mean;
                *mean = *mean * share_a + mean_b * share_b;
                *m2 += m2_b + delta * delta * between;
                unsound |=
                    u32::from(a & EXPONENT == EXPONENT) | u32::from(c & EXPONENT == EXPONENT) | c >> 31;
            }
        }
        unsound == 0
    }

    fn merge_each(&mut self, y: usize, row: &Row<'_>, samples: u64) -> bool {
        let mut sound = true;
        for x in 0..self.width {
            let at = y * self.width + x;
            let (Some(mut sum), Some(pixel)) = (self.pixel(x, y), row.pixel(x, samples)) else {
                sound = false;
                continue;
            };
            sum.merge(&pixel);
            (self.count[at], self.non_finite[at]) = (sum.count(), sum.non_finite());
            for channel in 0..3 {
                self.mean[channel][at] = sum.mean()[channel];
                self.m2[channel][at] = sum.squared_deviations()[channel];
            }
        }
        sound
    }
}

/// The bits of an exponent that no finite number has, in the higher half.
const EXPONENT: u32 = 0x7ff0_0000;

#[inline(always)]
fn real(high: u32, low: u32) -> f64 {
    f64::from_bits(u64::from(high) << 32 | u64::from(low))
}
