//! N independent selections from one stream.

use crate::choose::Choose;

/// `N` items out of a stream, independent of one another given the stream, each kept with
/// probability `w_i / Σ_j w_j`: a sample with replacement.
#[derive(Clone, Debug)]
pub struct Selections<X, const N: usize> {
    items: [Option<X>; N],
    weight_sum: f64,
}

impl<X, const N: usize> Default for Selections<X, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<X, const N: usize> Selections<X, N> {
    /// Nothing seen yet.
    #[inline]
    pub fn new() -> Self {
        Self {
            items: core::array::from_fn(|_| None),
            weight_sum: 0.0,
        }
    }

    /// Offers an item to each of the `N` slots: one decision a slot. `item` is built once for each
    /// slot that takes it.
    #[inline]
    pub fn offer_with(&mut self, weight: f64, choose: &mut impl Choose, mut item: impl FnMut() -> X) {
        // Also false for NaN.
        if !(weight > 0.0 && weight < f64::INFINITY) {
            return;
        }
        self.weight_sum = (self.weight_sum + weight).min(f64::MAX);
        for slot in &mut self.items {
            if choose.accept(weight, self.weight_sum) {
                *slot = Some(item());
            }
        }
    }

    /// Appends another stream, slot by slot.
    pub fn merge(&mut self, other: Self, choose: &mut impl Choose) {
        if other.weight_sum > 0.0 {
            self.weight_sum = (self.weight_sum + other.weight_sum).min(f64::MAX);
            for (slot, item) in self.items.iter_mut().zip(other.items) {
                if choose.accept(other.weight_sum, self.weight_sum) {
                    *slot = item;
                }
            }
        }
    }

    /// `Σ w`, over the positive finite weights seen.
    #[inline(always)]
    pub fn weight_sum(&self) -> f64 {
        self.weight_sum
    }

    /// The items; all `None` while no weight was positive, all `Some` after.
    #[inline(always)]
    pub fn items(&self) -> &[Option<X>; N] {
        &self.items
    }

    /// Takes the items out.
    #[inline]
    pub fn into_items(self) -> [Option<X>; N] {
        self.items
    }
}
