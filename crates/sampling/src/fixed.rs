//! Sums whose bits do not depend on the order of their terms.
//!
//! Addition of floats is not associative. If several threads add to a record, its bits differ in
//! each run, and so do those of every image that reads it. Sums of integers are the same in any
//! order and any grouping. [`FixedSum`] rounds each term to a multiple of 2⁻⁶⁴ and adds in
//! 128 bits. Terms saturate, not the sum: with terms of both signs, a saturating sum would depend
//! on the order, too.

use core::iter::Sum;
use core::ops::AddAssign;

/// Bits after the binary point.
const FRACTION_BITS: i32 = 64;

/// A sum in fixed point: `Σ round(clamp(x_i) · 2⁶⁴) · 2⁻⁶⁴`, the same bits for any
/// order of the terms and any grouping of partial sums. Guides and caches use such sums for their
/// records, which any number of threads fill.
///
/// - Terms beyond ±2³¹, infinities included, count as ±2³¹; [`clamped`](Self::clamped) counts
///   them. For radiance this limit is far above any useful sample; scale larger values.
/// - NaN adds nothing and is counted by [`refused`](Self::refused).
/// - The sum holds any 2³² − 1 terms. With more, it wraps around: the result is defined and the
///   same in any order, but wrong.
///
/// # Precision
/// Each term is rounded to the nearest multiple of 2⁻⁶⁴ (5·10⁻²⁰), halves to even; the
/// sum of the rounded terms is exact.
///
/// ```
/// use lightshed_sampling::FixedSum;
///
/// let terms = [1e9, 1e-9, -1e9, 0.25];
/// let sum: FixedSum = terms.into_iter().collect();
/// let backwards: FixedSum = terms.into_iter().rev().collect();
/// assert_eq!(sum, backwards);
/// assert!((sum.value() - 0.250_000_001).abs() < 1e-18);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FixedSum {
    sum: i128,
    clamped: u32,
    refused: u32,
}

impl FixedSum {
    /// Largest magnitude of a term, 2³¹.
    pub const MAX_TERM: f64 = (1u64 << 31) as f64;

    /// The sum of no terms.
    pub const ZERO: Self = Self {
        sum: 0,
        clamped: 0,
        refused: 0,
    };

    /// Adds a term.
    #[inline]
    pub fn add(&mut self, term: f64) {
        if term.is_nan() {
            self.refused = self.refused.saturating_add(1);
            return;
        }
        if term.abs() > Self::MAX_TERM {
            self.clamped = self.clamped.saturating_add(1);
        }
        let term = term.clamp(-Self::MAX_TERM, Self::MAX_TERM);
        // Scaling by a power of two is exact.
        let fixed = (term * 2f64.powi(FRACTION_BITS)).round_ties_even() as i128;
        self.sum = self.sum.wrapping_add(fixed);
    }

    /// Adds the terms of another sum.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        self.sum = self.sum.wrapping_add(other.sum);
        self.clamped = self.clamped.saturating_add(other.clamped);
        self.refused = self.refused.saturating_add(other.refused);
    }

    /// The sum, rounded to the nearest `f64`.
    #[inline]
    pub fn value(&self) -> f64 {
        self.sum as f64 * 2f64.powi(-FRACTION_BITS)
    }

    /// Number of terms larger than [`FixedSum::MAX_TERM`]; saturates.
    pub fn clamped(&self) -> u32 {
        self.clamped
    }

    /// Number of terms that were NaN; saturates.
    pub fn refused(&self) -> u32 {
        self.refused
    }
}

impl AddAssign<f64> for FixedSum {
    #[inline]
    fn add_assign(&mut self, term: f64) {
        self.add(term);
    }
}

impl FromIterator<f64> for FixedSum {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut sum = Self::ZERO;
        terms.into_iter().for_each(|term| sum.add(term));
        sum
    }
}

impl Sum for FixedSum {
    fn sum<I: Iterator<Item = Self>>(sums: I) -> Self {
        sums.fold(Self::ZERO, |mut all, sum| {
            all.merge(&sum);
            all
        })
    }
}

/// A mean `Σ x_i / n` of terms added in any order, by a [`FixedSum`] and a count. Samples of value
/// zero count; NaN does not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FixedMean {
    sum: FixedSum,
    count: u64,
}

impl FixedMean {
    /// The mean of no terms.
    pub const EMPTY: Self = Self {
        sum: FixedSum::ZERO,
        count: 0,
    };

    /// Adds a term.
    #[inline]
    pub fn add(&mut self, term: f64) {
        self.sum.add(term);
        self.count = self.count.wrapping_add(u64::from(!term.is_nan()));
    }

    /// Adds the terms of another mean.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        self.sum.merge(&other.sum);
        self.count = self.count.wrapping_add(other.count);
    }

    /// The mean; `None` if no terms were added.
    #[inline]
    pub fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum.value() / self.count as f64)
    }

    /// How many terms were added.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their sum.
    pub fn sum(&self) -> FixedSum {
        self.sum
    }
}
