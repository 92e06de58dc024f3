//! How well reuse is doing: variance of `Σw`, correlation between neighbours and frames,
//! impoverishment.

use crate::reuse::Extent;

/// Mean and variance of a stream, by Welford's update: no cancellation, whatever the mean.
///
/// Fed with [`MergeReport::weight_sum`](crate::MergeReport::weight_sum) over pixels or frames it
/// measures `Var[Σw]`, which is the variance of the estimate where `p̂ ∝ f` (Lin 2022 eq. 6.32)
/// and bounds it elsewhere (eq. 6.29).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    squared_deviation: f64,
}

impl Moments {
    /// No values yet.
    pub const fn new() -> Self {
        Self {
            count: 0,
            mean: 0.0,
            squared_deviation: 0.0,
        }
    }

    /// Adds a value. Values that are not finite are left out.
    #[inline]
    pub fn push(&mut self, value: f64) {
        if value.is_finite() {
            self.count += 1;
            let delta = value - self.mean;
            self.mean += delta / self.count as f64;
            self.squared_deviation += delta * (value - self.mean);
        }
    }

    /// Adds the values of another stream (Chan et al. 1979).
    pub fn merge(&mut self, other: &Self) {
        if other.count > 0 {
            let count = (self.count + other.count) as f64;
            let delta = other.mean - self.mean;
            let share = other.count as f64 / count;
            self.mean += delta * share;
            self.squared_deviation += other.squared_deviation + delta * delta * share * self.count as f64;
            self.count += other.count;
        }
    }

    /// How many values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean; 0 without values.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased variance; 0 with fewer than two values.
    pub fn variance(&self) -> f64 {
        if self.count > 1 {
            self.squared_deviation / (self.count - 1) as f64
        } else {
            0.0
        }
    }

    /// Variance over squared mean; 0 where the mean vanishes.
    pub fn relative_variance(&self) -> f64 {
        let square = self.mean * self.mean;
        if square > 0.0 {
            self.variance() / square
        } else {
            0.0
        }
    }
}

impl Extend<f64> for Moments {
    fn extend<I: IntoIterator<Item = f64>>(&mut self, values: I) {
        values.into_iter().for_each(|value| self.push(value));
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut moments = Self::new();
        moments.extend(values);
        moments
    }
}

/// Pearson's correlation of pairs, in [-1, 1]: of one frame's pixels with the next frame's, say. 0
/// where either side is constant or there are fewer than two pairs. Subtract expectations first
/// where they differ between pixels, or their pattern counts as correlation.
pub fn correlation(pairs: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let (mut count, mut mean_a, mut mean_b) = (0.0, 0.0, 0.0);
    let (mut square_a, mut square_b, mut product) = (0.0, 0.0, 0.0);
    for (a, b) in pairs.into_iter().filter(|(a, b)| a.is_finite() && b.is_finite()) {
        count += 1.0;
        let (delta_a, delta_b) = (a - mean_a, b - mean_b);
        mean_a += delta_a / count;
        mean_b += delta_b / count;
        square_a += delta_a * (a - mean_a);
        square_b += delta_b * (b - mean_b);
        product += delta_a * (b - mean_b);
    }
    let scale = square_a.sqrt() * square_b.sqrt();
    if scale > 0.0 {
        (product / scale).clamp(-1.0, 1.0)
    } else {
        0.0
    }
}

/// Correlation of a series with itself `lag` steps later (one pixel over frames); 0 where it is
/// constant or too short.
pub fn series_autocorrelation(values: &[f64], lag: usize) -> f64 {
    correlation(values.iter().copied().zip(values.iter().copied().skip(lag)))
}

/// Correlation of a grid's values with those `offset` columns and rows away: the blotches that
/// reuse leaves. 0 where `values` does not match the grid.
pub fn neighbour_correlation(extent: Extent, values: &[f64], offset: [i64; 2]) -> f64 {
    if values.len() != extent.len() {
        return 0.0;
    }
    correlation(values.iter().enumerate().filter_map(|(index, &value)| {
        let [x, y] = extent.place(index);
        extent
            .index(x + offset[0], y + offset[1])
            .map(|other| (value, values[other]))
    }))
}

/// How many different samples there are among those that a frame's pixels hold.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DistinctSamples {
    /// Samples, duplicates among them.
    pub samples: usize,
    /// Different ones.
    pub distinct: usize,
    /// `n² / Σ_x n_x²` where sample `x` is held `n_x` times and `n = Σ n_x`: as many different
    /// samples, each held equally often, would meet as often when two holders are compared.
    pub effective: f64,
}

impl DistinctSamples {
    /// Counts samples by a key that tells their origins apart (a path seed, a light and its random
    /// numbers). Sorts `keys`.
    pub fn count<K: Ord>(keys: &mut [K]) -> Self {
        keys.sort_unstable();
        let mut counted = Self {
            samples: keys.len(),
            ..Self::default()
        };
        let mut squares = 0.0;
        for same in keys.chunk_by(|a, b| a == b) {
            counted.distinct += 1;
            squares += (same.len() as f64).powi(2);
        }
        if counted.distinct > 0 {
            counted.effective = (keys.len() as f64).powi(2) / squares;
        }
        counted
    }
}

/// The share of samples that some other sample duplicates, `1 − distinct/total`, by a key as in
/// [`DistinctSamples::count`]. 0 without samples. Near 1 the grid is impoverished: many pixels show
/// one sample. Sorts `keys`.
pub fn duplicate_rate<K: Ord>(keys: &mut [K]) -> f64 {
    match DistinctSamples::count(keys) {
        DistinctSamples { samples: 0, .. } => 0.0,
        counted => 1.0 - counted.distinct as f64 / counted.samples as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_do_not_cancel_and_merge() {
        let values: Vec<f64> = (0..1000).map(|i| 1e9 + f64::from(i % 10)).collect();
        let all: Moments = values.iter().copied().collect();
        assert!((all.variance() - 8.25 * 1000.0 / 999.0).abs() < 1e-6);
        let mut halves: Moments = values[..300].iter().copied().collect();
        halves.merge(&values[300..].iter().copied().collect());
        assert!((halves.variance() - all.variance()).abs() < 1e-6 && halves.count() == 1000);
        halves.merge(&Moments::new());
        assert_eq!(halves.count(), 1000);
        // The textbook difference of squares, as a planted fault: it loses all digits here.
        let square = values.iter().map(|v| v * v).sum::<f64>() / 1000.0;
        let mean = values.iter().sum::<f64>() / 1000.0;
        assert!((square - mean * mean - 8.25).abs() > 1.0);
    }

    #[test]
    fn correlations_of_known_series() {
        let wave: Vec<f64> = (0..400)
            .map(|i| (f64::from(i) * core::f64::consts::TAU / 20.0).sin())
            .collect();
        assert!((series_autocorrelation(&wave, 20) - 1.0).abs() < 1e-12);
        assert!((series_autocorrelation(&wave, 10) + 1.0).abs() < 1e-12);
        assert!(series_autocorrelation(&wave, 5).abs() < 0.01);
        assert_eq!(series_autocorrelation(&[3.0; 9], 1), 0.0);
        let extent = Extent {
            width: 20,
            height: 20,
        };
        assert!((neighbour_correlation(extent, &wave, [0, 1]) - 1.0).abs() < 1e-12);
        assert!(neighbour_correlation(extent, &wave, [5, 0]) < 0.5);
    }

    #[test]
    fn duplicates() {
        assert_eq!(duplicate_rate(&mut [4, 1, 4, 4]), 0.5);
        assert_eq!(duplicate_rate(&mut [4, 1, 3, 2]), 0.0);
        assert_eq!(duplicate_rate::<u32>(&mut []), 0.0);
        let counted = DistinctSamples::count(&mut [7, 3, 7, 7]);
        assert_eq!(
            (counted.samples, counted.distinct, counted.effective),
            (4, 2, 1.6)
        );
        assert_eq!(DistinctSamples::count::<u32>(&mut []), DistinctSamples::default());
    }
}
