//! Moments of the radiance that one vertex scatters.

use glam::DVec3;
use lightshed_sampling::Rgb;

/// Moments of `n` independent samples `Y_1 … Y_n` of one vertex `y`, channel by channel.
///
/// With the mean `m` and the unbiased sample variance `s²`, the second moment and the U-statistic
/// over all pairs of samples are
///
/// - `(1/n) Σ Y_i² = m² + s² (n − 1)/n`, an estimate of `E[Y² | y]`,
/// - `(1/(n(n−1))) Σ_{i≠j} Y_i Y_j = m² − s²/n`, an estimate of `E[Y | y]²` (§7.3.4),
///
/// both unbiased. The record stores `m` and `s²`, computed in two passes over the samples: the
/// difference of the two moments is `s²` itself and nothing cancels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VertexMoments {
    /// `n`.
    pub count: u32,
    /// `m`.
    pub mean: DVec3,
    /// `s²`; 0 of a single sample.
    pub variance: DVec3,
}

impl VertexMoments {
    /// Number of samples. One sample gives no variance; two or more do.
    pub fn of(samples: impl Iterator<Item = Rgb> + Clone) -> Self {
        let (mut count, mut sum) = (0u32, DVec3::ZERO);
        for sample in samples.clone() {
            sum += sample.as_dvec3();
            count += 1;
        }
        let mean = sum / f64::from(count.max(1));
        // The residual's own mean is rounding (Chan, Golub and LeVeque 1983, eq. 1.7).
        let (mut squares, mut rest) = (DVec3::ZERO, DVec3::ZERO);
        for sample in samples {
            let deviation = sample.as_dvec3() - mean;
            squares += deviation * deviation;
            rest += deviation;
        }
        squares -= rest * rest / f64::from(count.max(1));
        Self {
            count,
            mean,
            variance: squares.max(DVec3::ZERO) / f64::from(count.saturating_sub(1).max(1)),
        }
    }

    /// The mean of the squares, an unbiased estimate of `E[Y² | y]`.
    pub fn second(&self) -> DVec3 {
        let n = f64::from(self.count.max(1));
        self.mean * self.mean + self.variance * ((n - 1.0) / n)
    }

    /// The U-statistic over all pairs, an unbiased estimate of `E[Y | y]²`; may be negative.
    pub fn square_of_mean(&self) -> DVec3 {
        self.mean * self.mean - self.variance / f64::from(self.count.max(1))
    }
}
