//! Weights of primitives, clamped so that no primitive covers more than a stratum.

/// Bins of the histogram, and the bin of weights from 1 on (Dittebrandt 2025 §8.3.1.3).
const BINS: usize = 128;
const OFFSET: i32 = 64;

/// How many weights lie in each bin `[√2ⁱ, √2ⁱ⁺¹)`.
///
/// Weights are given squared: the bin of a weight is then the binary exponent of its square, and no
/// logarithm is needed.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightHistogram {
    counts: [u32; BINS],
}

impl Default for WeightHistogram {
    fn default() -> Self {
        Self { counts: [0; BINS] }
    }
}

impl WeightHistogram {
    /// Counts the weight whose square this is: finite and not negative. Zero and what is subnormal
    /// are in bin 0.
    #[inline(always)]
    pub fn add_squared(&mut self, squared: f32) {
        let exponent = (squared.to_bits() >> 23) as i32 - 127;
        let bin = (exponent + OFFSET).clamp(0, BINS as i32 - 1);
        self.counts[bin as usize] += 1;
    }

    /// Adds the counts of another histogram.
    pub fn merge(&mut self, other: &Self) {
        for (own, other) in self.counts.iter_mut().zip(&other.counts) {
            *own += other;
        }
    }

    /// Where each bin ends: the weights by which [`WeightHistogram::clamp`] may clamp.
    pub fn ends() -> [f64; BINS] {
        core::array::from_fn(|bin| (f64::from(bin as i32 - OFFSET + 1) * 0.5).exp2())
    }

    /// A clamping weight `c` with `c / Σ min(w, c) ≥ stratum`, at most twice the least there is;
    /// infinite if there is none (Dittebrandt 2025, Algorithm 6, with `b = √2` and 128 bins).
    ///
    /// `stratum` is the share of all weights that a clamped one is to have; see
    /// [`stratum_beside_uniform`].
    pub fn clamp(&self, stratum: f64) -> f64 {
        let mut unclamped = 0.0;
        let mut clamped: f64 = self.counts.iter().map(|&count| f64::from(count)).sum();
        for (&count, clamp) in self.counts.iter().zip(Self::ends()) {
            if clamp >= stratum * (unclamped + clamp * clamped) {
                return clamp;
            }
            unclamped += f64::from(count) * clamp;
            clamped -= f64::from(count);
        }
        f64::INFINITY
    }
}

/// The stratum `s' = (s − u/N) / (1 − u)` for which clamped weights, mixed with uniform ones of
/// share `u`, cover the stratum `s` (Dittebrandt 2025, eq. 8.6).
pub fn stratum_beside_uniform(stratum: f64, uniform: f64, count: usize) -> f64 {
    (stratum - uniform / count as f64) / (1.0 - uniform)
}
