//! Running mean and variance of one pixel.

use lightshed_sampling::Rgb;

/// Count, mean and sum of squared deviations of a pixel's samples, for each of the three colour
/// channels.
///
/// For samples `x_1 … x_n` it keeps `n`, `x̄ = (1/n) Σ x_i` and `M₂ = Σ (x_i − x̄)²` by
/// Welford's update (Welford 1962, *Note on a Method for Calculating Corrected Sums of Squares and
/// Products*), which avoids the cancellation of `E[x²] − E[x]²`. Two of them merge by Chan,
/// Golub and LeVeque (1979, *Updating Formulae and a Pairwise Algorithm for Computing Sample
/// Variances*, eqs. 2.1). All in `f64`.
///
/// A sample with a NaN or infinite channel is counted in [`non_finite`](Self::non_finite) and
/// otherwise left out, because a single one would destroy its pixel for good. Their number is an
/// error report, not a statistic: a correct estimator has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelStatistics {
    count: u64,
    non_finite: u64,
    mean: [f64; 3],
    m2: [f64; 3],
}

impl PixelStatistics {
    /// Adds one sample.
    #[inline]
    pub fn add(&mut self, sample: Rgb) {
        if !sample.is_finite() {
            self.non_finite += 1;
            return;
        }
        self.count += 1;
        let reciprocal = 1.0 / self.count as f64;
        for (channel, value) in sample.to_array().into_iter().enumerate() {
            let value = f64::from(value);
            let before = value - self.mean[channel];
            self.mean[channel] += before * reciprocal;
            self.m2[channel] += before * (value - self.mean[channel]);
        }
    }

    /// Adds all samples of `other`; the result is that of adding them one by one, up to rounding.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        if other.count > 0 {
            let (n_a, n_b, n) = (self.count as f64, other.count as f64, count as f64);
            for channel in 0..3 {
                let (mean_a, mean_b) = (self.mean[channel], other.mean[channel]);
                let delta = mean_b - mean_a;
                // The weighted mean in its symmetric form: neither operand is favoured, so the
                // order does not matter.
                self.mean[channel] = mean_a * (n_a / n) + mean_b * (n_b / n);
                self.m2[channel] += other.m2[channel] + delta * delta * (n_a * (n_b / n));
            }
        }
        self.count = count;
        self.non_finite += other.non_finite;
    }

    /// Statistics from their parts; `None` if no samples can have them.
    #[inline]
    pub(crate) fn from_parts(count: u64, non_finite: u64, mean: [f64; 3], m2: [f64; 3]) -> Option<Self> {
        let sound = (0..3).all(|channel| {
            let possible =
                mean[channel].is_finite() && m2[channel].is_sign_positive() && m2[channel].is_finite();
            let none = mean[channel] == 0.0 && m2[channel] == 0.0;
            possible && (count > 0 || none)
        });
        sound.then_some(Self {
            count,
            non_finite,
            mean,
            m2,
        })
    }

    /// Sum of squared deviations from the mean, `M₂`.
    #[inline]
    pub(crate) fn squared_deviations(&self) -> [f64; 3] {
        self.m2
    }

    /// Number of finite samples.
    #[inline]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Number of samples left out because a channel was NaN or infinite.
    #[inline]
    pub fn non_finite(&self) -> u64 {
        self.non_finite
    }

    /// Mean of the finite samples; zero without any.
    #[inline]
    pub fn mean(&self) -> [f64; 3] {
        self.mean
    }

    /// Unbiased variance of one sample, `M₂ / (n − 1)`; `None` below two samples.
    #[inline]
    pub fn variance(&self) -> Option<[f64; 3]> {
        let degrees = self.count.checked_sub(1).filter(|&degrees| degrees > 0)? as f64;
        Some(self.m2.map(|m2| m2 / degrees))
    }

    /// Unbiased variance of the mean, `M₂ / (n (n − 1))`, for independent samples; `None` below
    /// two samples.
    #[inline]
    pub fn variance_of_mean(&self) -> Option<[f64; 3]> {
        let count = self.count as f64;
        Some(self.variance()?.map(|variance| variance / count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and variance of a sample in two passes: the oracle.
    fn two_pass(samples: &[Rgb]) -> ([f64; 3], [f64; 3]) {
        let n = samples.len() as f64;
        let at = |c: usize| samples.iter().map(move |s| f64::from(s[c]));
        let mean: [f64; 3] = std::array::from_fn(|c| at(c).sum::<f64>() / n);
        let variance = std::array::from_fn(|c| at(c).map(|x| (x - mean[c]).powi(2)).sum::<f64>() / (n - 1.0));
        (mean, variance)
    }

    /// A fixed sequence with a large offset: deviations of order one around `offset`.
    fn sequence(offset: f32, n: u32) -> Vec<Rgb> {
        let wobble = |i: u32, k: u32| {
            (i.wrapping_mul(2_654_435_761).wrapping_mul(2 * k + 1) >> 8) as f32 / 2f32.powi(24)
        };
        (0..n)
            .map(|i| Rgb::new(offset + wobble(i, 1), offset - wobble(i, 2), wobble(i, 3)))
            .collect()
    }

    fn collect(samples: &[Rgb]) -> PixelStatistics {
        let mut statistics = PixelStatistics::default();
        for &sample in samples {
            statistics.add(sample);
        }
        statistics
    }

    fn assert_close(found: [f64; 3], expected: [f64; 3], relative: f64) {
        for c in 0..3 {
            let error = (found[c] - expected[c]).abs();
            assert!(
                error <= relative * expected[c].abs(),
                "{found:?} against {expected:?}"
            );
        }
    }

    #[test]
    fn matches_two_passes_even_with_a_large_offset() {
        for offset in [0.0, 1e3, 1e5] {
            let samples = sequence(offset, 10_000);
            let (mean, variance) = two_pass(&samples);
            let statistics = collect(&samples);
            assert_close(statistics.mean(), mean, 1e-13);
            assert_close(statistics.variance().unwrap(), variance, 1e-9);
            // The planted fault: the textbook difference of moments in f32 is useless at these
            // offsets.
            if offset >= 1e5 {
                let n = samples.len() as f32;
                let (first, second) = samples
                    .iter()
                    .fold((0.0, 0.0), |(a, b), s| (a + s.x, b + s.x * s.x));
                let cancelled = f64::from(second / n - (first / n) * (first / n));
                assert!(
                    (cancelled - variance[0]).abs() > 0.5 * variance[0],
                    "{cancelled} is no fault"
                );
            }
        }
    }

    #[test]
    fn merging_is_the_same_in_any_order_and_grouping() {
        let samples = sequence(1e4, 999);
        let whole = collect(&samples);
        let parts: Vec<_> = samples.chunks(70).map(collect).collect();
        let fold = |order: &mut dyn Iterator<Item = &PixelStatistics>| {
            order.fold(PixelStatistics::default(), |mut sum, part| {
                sum.merge(part);
                sum
            })
        };
        let forwards = fold(&mut parts.iter());
        let backwards = fold(&mut parts.iter().rev());
        let mut halves = fold(&mut parts[..7].iter());
        halves.merge(&fold(&mut parts[7..].iter()));
        for merged in [forwards, backwards, halves] {
            assert_eq!(merged.count(), 999);
            assert_close(merged.mean(), whole.mean(), 1e-13);
            assert_close(merged.variance().unwrap(), whole.variance().unwrap(), 1e-9);
        }
        // Swapping two operands changes no bit.
        let (mut ab, mut ba) = (parts[0], parts[14]);
        ab.merge(&parts[14]);
        ba.merge(&parts[0]);
        assert_eq!(ab.mean(), ba.mean());
        // The planted fault: adding the sums of squares without the term between the means.
        let within: f64 = parts.iter().map(|part| part.m2[0]).sum();
        assert!((within / 998.0 - whole.variance().unwrap()[0]).abs() > 1e-4 * whole.variance().unwrap()[0]);
    }

    #[test]
    fn non_finite_samples_are_counted_and_never_summed() {
        let mut statistics = collect(&[Rgb::ONE, Rgb::splat(3.0)]);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            statistics.add(Rgb::new(1.0, bad, 1.0));
        }
        assert_eq!((statistics.count(), statistics.non_finite()), (2, 3));
        assert_eq!(statistics.mean(), [2.0; 3]);
        assert_eq!(statistics.variance(), Some([2.0; 3]));
        assert_eq!(statistics.variance_of_mean(), Some([1.0; 3]));
        let mut other = PixelStatistics::default();
        other.merge(&statistics);
        assert_eq!(other, statistics);
    }

    #[test]
    fn too_few_samples_have_no_variance_and_extremes_stay_finite() {
        let mut statistics = PixelStatistics::default();
        assert_eq!((statistics.mean(), statistics.variance()), ([0.0; 3], None));
        statistics.add(Rgb::splat(f32::MAX));
        assert_eq!(statistics.variance_of_mean(), None);
        statistics.add(Rgb::splat(f32::MIN));
        assert!(statistics.mean()[0].abs() < 1e25);
        assert!(statistics.variance().unwrap()[0].is_finite());
    }
}
