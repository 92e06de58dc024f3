//! RIS over candidates of several techniques.

use super::single::finished;
use crate::choose::Choose;
use crate::mis::share;
use crate::reservoir::Reservoir;
use crate::selection::Selection;
use crate::space::Space;
use crate::storage::{Storage, product, sanitised};
use crate::weight::ContributionWeight;
use core::marker::PhantomData;

/// Candidates of several techniques to one sample; each comes with its resampling MIS weight
/// `m_i(X_i)`, of which `Σ_i m_i = 1` over all candidates that could have been `x` (Lin 2022 eqs.
/// 6.4–6.6). Nothing is divided at the end.
#[derive(Clone, Debug)]
pub struct MixtureRis<X, S: Space> {
    selection: Selection<(X, f64)>,
    space: PhantomData<S>,
}

impl<X, S: Space> Default for MixtureRis<X, S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<X, S: Space> MixtureRis<X, S> {
    /// No candidates yet.
    #[inline]
    pub const fn new() -> Self {
        Self {
            selection: Selection::new(),
            space: PhantomData,
        }
    }

    /// A candidate `x` with `p̂(x)`, `m_i(x)` and its contribution weight.
    #[inline(always)]
    pub fn candidate<R: Storage>(
        &mut self,
        x: X,
        target: f64,
        mis: f64,
        weight: ContributionWeight<S, R>,
        choose: &mut impl Choose,
    ) -> bool {
        let target = sanitised(target);
        let weight = product([sanitised(mis), target, weight.value().to_f64()]);
        self.selection.offer((x, target), weight, choose)
    }

    /// `Σ_i w_i`, an estimate of `∫ p̂`.
    pub fn target_integral(&self) -> f64 {
        self.selection.weight_sum()
    }

    /// `Y` with `W_Y = Σw / p̂(Y)`; see [`Ris::finish`](super::Ris::finish).
    pub fn finish<R: Storage>(self, confidence: f32) -> Reservoir<X, S, R> {
        let weight_sum = self.selection.weight_sum();
        finished(self.selection.into_item(), weight_sum, confidence)
    }
}

/// The balance weight of *one* candidate `x` of technique `technique`,
/// `m(x) = p_t(x) / Σ_k n_k p_k(x)` (Talbot 2005, Lin 2022 eq. 6.5), where technique `k` draws
/// `n_k` candidates. `techniques` holds `(n_k, p_k(x))`, densities in one measure; every technique
/// is asked about `x`, also those that drew nothing useful. 0 if technique `t` cannot produce `x`
/// or does not exist.
#[inline]
pub fn balance_over_techniques(techniques: &[(u32, f64)], technique: usize) -> f64 {
    let total: f64 = techniques
        .iter()
        .map(|&(count, density)| f64::from(count) * sanitised(density))
        .sum();
    techniques
        .get(technique)
        .map_or(0.0, |&(_, density)| share(sanitised(density), total))
}
