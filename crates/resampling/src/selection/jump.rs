//! Streaming selection that draws a random number only when the selection changes.

use crate::choose::uniform_positive;
use rand::Rng;

/// [`Selection`](crate::Selection) by jumps: the same distribution, an addition and a comparison a
/// candidate, and about `ln M` random numbers for a stream of `M` similar weights instead of `M`.
///
/// While the sum of weights grows from `S` to `S'`, the selected item survives with probability
/// `S/S'`. So one uniform `u` in (0, 1], drawn when an item is selected at sum `S`, fixes the sum
/// `S/u` beyond which the next selection happens: the single-item case of Efraimidis & Spirakis
/// 2006 (A-ExpJ). The resolution of `u` acts on the *ratio* of sums, so shares far below 2⁻⁵³
/// are served too.
///
/// How many numbers are drawn depends on them; where each candidate must consume its own (replay,
/// GPU parity) use `Selection`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpSelection<X> {
    item: Option<X>,
    weight_sum: f64,
    threshold: f64,
}

impl<X> Default for JumpSelection<X> {
    fn default() -> Self {
        Self::new()
    }
}

impl<X> JumpSelection<X> {
    /// Nothing seen yet.
    #[inline]
    pub const fn new() -> Self {
        Self {
            item: None,
            weight_sum: 0.0,
            threshold: 0.0,
        }
    }

    /// Offers an item; true if it is now the selected one. Weights that are zero, negative or not
    /// finite add nothing.
    #[inline(always)]
    pub fn offer<R: Rng + ?Sized>(&mut self, item: X, weight: f64, rng: &mut R) -> bool {
        // Also false for NaN.
        if !(weight > 0.0 && weight < f64::INFINITY) {
            return false;
        }
        self.weight_sum = (self.weight_sum + weight).min(f64::MAX);
        let accepted = self.weight_sum > self.threshold;
        if accepted {
            self.item = Some(item);
            self.threshold = self.weight_sum / uniform_positive(rng);
        }
        accepted
    }

    /// Appends another stream, as if its items had come here one by one.
    #[inline]
    pub fn merge<R: Rng + ?Sized>(&mut self, other: Self, rng: &mut R) -> bool {
        match other.item {
            Some(item) => self.offer(item, other.weight_sum, rng),
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
