//! Streaming weighted selection of one item.

use crate::choose::Choose;

/// One item out of a stream, kept with probability `w_i / Σ_j w_j` (Chao 1982; Lin 2022 eq. 5.4),
/// in constant memory.
///
/// The sum is kept in `f64`: over 10⁸ items its relative error stays below 10⁸ · 2⁻⁵³ ≈
/// 1e-8, where an `f32` sum stalls at 2²⁴ times the typical weight. Weights that are zero,
/// negative or not finite never select and add nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Selection<X> {
    item: Option<X>,
    weight_sum: f64,
}

impl<X> Default for Selection<X> {
    fn default() -> Self {
        Self::new()
    }
}

impl<X> Selection<X> {
    /// Nothing seen yet.
    #[inline]
    pub const fn new() -> Self {
        Self {
            item: None,
            weight_sum: 0.0,
        }
    }

    /// A selection in progress, as stored elsewhere. A sum that is negative or not finite counts as
    /// nothing seen.
    #[inline]
    pub fn resume(item: Option<X>, weight_sum: f64) -> Self {
        if weight_sum > 0.0 && weight_sum.is_finite() {
            Self { item, weight_sum }
        } else {
            Self::new()
        }
    }

    /// Offers an item; true if it is now the selected one. One decision for each positive weight.
    #[inline(always)]
    pub fn offer(&mut self, item: X, weight: f64, choose: &mut impl Choose) -> bool {
        self.offer_with(weight, choose, || item)
    }

    /// Offers an item that is built only if selected.
    #[inline(always)]
    pub fn offer_with(&mut self, weight: f64, choose: &mut impl Choose, item: impl FnOnce() -> X) -> bool {
        // Also false for NaN.
        if !(weight > 0.0 && weight < f64::INFINITY) {
            return false;
        }
        self.weight_sum = (self.weight_sum + weight).min(f64::MAX);
        let accepted = choose.accept(weight, self.weight_sum);
        if accepted {
            self.item = Some(item());
        }
        accepted
    }

    /// Appends another stream: the outcome is distributed as if its items had been offered here one
    /// by one.
    #[inline]
    pub fn merge(&mut self, other: Self, choose: &mut impl Choose) -> bool {
        match other.item {
            Some(item) => self.offer(item, other.weight_sum, choose),
            None => false,
        }
    }

    /// `Σ w`, over the positive finite weights seen.
    #[inline(always)]
    pub fn weight_sum(&self) -> f64 {
        self.weight_sum
    }

    /// The selected item; `None` while no weight was positive.
    #[inline(always)]
    pub fn item(&self) -> Option<&X> {
        self.item.as_ref()
    }

    /// Takes the selected item out.
    #[inline]
    pub fn into_item(self) -> Option<X> {
        self.item
    }
}
