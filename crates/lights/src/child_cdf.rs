//! Cumulative distributions over the children of a node.

use crate::approximate::approximate_inverse;
use lightshed_lanes::Lanes;

/// Cumulative weights of the children of a node, `C_k = Σ_{j ≤ k} w_j`; child `k` is selected
/// with probability `w_k / C_7`. The values do not decrease, and two are equal only for a child
/// that must not be selected. They stay in lanes, because reading one of eight numbers that have
/// just been written is slow.
#[derive(Clone, Copy)]
pub struct ChildCdf<L> {
    ends: L,
    /// The last of them, in all lanes: the same bits, as sums are formed in the same order.
    total: L,
}

impl<L: Lanes> ChildCdf<L> {
    /// The distribution of weights that are not negative and have a finite sum.
    #[inline(always)]
    pub fn new(weights: L) -> Self {
        Self {
            ends: weights.running_sums(),
            total: weights.total(),
        }
    }

    /// As [`new`](Self::new), scaled to a sum of about one if the sum is at least the least normal
    /// number. Sums and scale depend on the same weights, not on each other.
    #[inline(always)]
    pub fn normalized(weights: L) -> Self {
        let Self { ends, total } = Self::new(weights);
        let scale = approximate_inverse(total);
        Self {
            ends: ends * scale,
            total: total * scale,
        }
    }

    /// The sum of two distributions.
    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        Self {
            ends: self.ends + other.ends,
            total: self.total + other.total,
        }
    }

    /// The distribution with each child's share multiplied by a positive factor.
    #[inline(always)]
    pub fn times(self, factors: L) -> Self {
        Self::new((self.ends - self.ends.delayed()) * factors)
    }

    /// The sum of all weights.
    #[inline(always)]
    pub fn total(&self) -> f64 {
        f64::from(self.total.first())
    }

    /// The start of the interval of `lane`, and its width. Without a branch for the first lane,
    /// which would be mispredicted as often as that lane is selected.
    #[inline(always)]
    pub fn interval(&self, lane: usize) -> (f64, f64) {
        let start = f64::from(self.ends.delayed().lane(lane));
        (start, f64::from(self.ends.lane(lane)) - start)
    }

    /// Probability of `lane`; 0 where no child contributes.
    #[inline(always)]
    pub fn probability(&self, lane: usize) -> f64 {
        if self.total() > 0.0 {
            self.interval(lane).1 / self.total()
        } else {
            0.0
        }
    }

    /// The lane whose interval contains `x`, which is less than the total.
    #[inline(always)]
    pub fn lane_at(&self, x: f64) -> usize {
        self.ends.count_at_most(x)
    }
}

/// Probability of `index` in any number of cumulative weights.
#[inline(always)]
pub(crate) fn probability_at(cdf: &[f64], index: usize) -> f64 {
    let low = if index == 0 { 0.0 } else { cdf[index - 1] };
    match cdf.last() {
        Some(&total) if total > 0.0 => (cdf[index] - low) / total,
        _ => 0.0,
    }
}
