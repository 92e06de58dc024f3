//! RIS over candidates of one technique.

use crate::choose::Choose;
use crate::reservoir::Reservoir;
use crate::selection::{Selection, Selections};
use crate::space::Space;
use crate::storage::{Storage, product, sanitised};
use crate::weight::ContributionWeight;
use core::marker::PhantomData;

/// `M` candidates of one technique to one sample: `m_i = 1/M` (Lin 2022 eqs. 6.1–6.2).
#[derive(Clone, Debug)]
pub struct Ris<X, S: Space> {
    selection: Selection<(X, f64)>,
    candidates: u64,
    space: PhantomData<S>,
}

impl<X, S: Space> Default for Ris<X, S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<X, S: Space> Ris<X, S> {
    /// No candidates yet.
    #[inline]
    pub const fn new() -> Self {
        Self {
            selection: Selection::new(),
            candidates: 0,
            space: PhantomData,
        }
    }

    /// A candidate `x` with `p̂(x)` and its contribution weight (`1/p` where drawn from a
    /// density). Every candidate drawn must be handed in: those with a zero target, and by
    /// [`null_candidate`](Self::null_candidate) those that a sampler did not produce. They count in
    /// `M`.
    #[inline(always)]
    pub fn candidate<R: Storage>(
        &mut self,
        x: X,
        target: f64,
        weight: ContributionWeight<S, R>,
        choose: &mut impl Choose,
    ) -> bool {
        let target = sanitised(target);
        self.candidates += 1;
        self.selection
            .offer((x, target), product([target, weight.value().to_f64()]), choose)
    }

    /// A candidate that the sampler did not produce, such as a light sampler's `None`: it counts in
    /// `M` as a sample of value zero. If it is left out, `W_Y` is too large by the share of such
    /// samples.
    #[inline(always)]
    pub fn null_candidate(&mut self) {
        self.candidates += 1;
    }

    /// A sampler's answer: [`candidate`](Self::candidate) of `(x, p̂(x), W)`, or
    /// [`null_candidate`](Self::null_candidate).
    #[inline(always)]
    pub fn drawn<R: Storage>(
        &mut self,
        candidate: Option<(X, f64, ContributionWeight<S, R>)>,
        choose: &mut impl Choose,
    ) -> bool {
        match candidate {
            Some((x, target, weight)) => self.candidate(x, target, weight, choose),
            None => {
                self.null_candidate();
                false
            }
        }
    }

    /// The outcome of an earlier stage as a candidate, with this stage's target. An empty one
    /// counts in `M`.
    pub fn reservoir<R: Storage>(
        &mut self,
        reservoir: &Reservoir<X, S, R>,
        target: impl FnOnce(&X) -> f64,
        choose: &mut impl Choose,
    ) -> bool
    where
        X: Clone,
    {
        let sample = reservoir.weighted_sample();
        self.drawn(sample.map(|(x, weight)| (x.clone(), target(x), weight)), choose)
    }

    /// Appends the candidates of another stream, as if they had come here one by one.
    pub fn merge(&mut self, other: Self, choose: &mut impl Choose) -> bool {
        self.candidates += other.candidates;
        self.selection.merge(other.selection, choose)
    }

    /// `M`.
    pub fn candidates(&self) -> u64 {
        self.candidates
    }

    /// `Σ_i w_i = 1/M Σ p̂ W`, an estimate of `∫ p̂`.
    pub fn target_integral(&self) -> f64 {
        if self.candidates > 0 {
            self.selection.weight_sum() / self.candidates as f64
        } else {
            0.0
        }
    }

    /// `Y` with `W_Y = (1/p̂(Y)) (1/M) Σ p̂ W`, trusted by `confidence` (1 as in Lin 2022
    /// §6.5.2, or `M`; a choice that must not depend on the candidates' values). Empty if no
    /// candidate had a positive target.
    pub fn finish<R: Storage>(self, confidence: f32) -> Reservoir<X, S, R> {
        let integral = self.target_integral();
        finished(self.selection.into_item(), integral, confidence)
    }
}

/// `M` candidates of one technique to `N` samples. Each is as [`Ris`] would give it, and they are
/// independent given the candidates (Kettunen 2023 eq. 1). One sample may be selected more than
/// once.
#[derive(Clone, Debug)]
pub struct RisMany<X, S: Space, const N: usize> {
    selections: Selections<(X, f64), N>,
    candidates: u64,
    space: PhantomData<S>,
}

impl<X: Clone, S: Space, const N: usize> Default for RisMany<X, S, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<X: Clone, S: Space, const N: usize> RisMany<X, S, N> {
    /// No candidates yet.
    #[inline]
    pub fn new() -> Self {
        Self {
            selections: Selections::new(),
            candidates: 0,
            space: PhantomData,
        }
    }

    /// A candidate; see [`Ris::candidate`].
    #[inline]
    pub fn candidate<R: Storage>(
        &mut self,
        x: &X,
        target: f64,
        weight: ContributionWeight<S, R>,
        choose: &mut impl Choose,
    ) {
        let target = sanitised(target);
        self.candidates += 1;
        self.selections
            .offer_with(product([target, weight.value().to_f64()]), choose, || {
                (x.clone(), target)
            });
    }

    /// A candidate that the sampler did not produce; see [`Ris::null_candidate`].
    #[inline]
    pub fn null_candidate(&mut self) {
        self.candidates += 1;
    }

    /// The `N` samples. An estimate of `∫ f` is the *mean* of their `f(Y) W_Y`.
    pub fn finish<R: Storage>(self, confidence: f32) -> [Reservoir<X, S, R>; N] {
        let integral = if self.candidates > 0 {
            self.selections.weight_sum() / self.candidates as f64
        } else {
            0.0
        };
        self.selections
            .into_items()
            .map(|item| finished(item, integral, confidence))
    }
}

/// `W_Y = Σw / p̂(Y)`, once.
pub(super) fn finished<X, S: Space, R: Storage>(
    item: Option<(X, f64)>,
    weight_sum: f64,
    confidence: f32,
) -> Reservoir<X, S, R> {
    let empty = Reservoir::empty(confidence);
    match item {
        Some((x, target)) => {
            let weight = ContributionWeight::stored(weight_sum / target);
            Reservoir::assembled(Some(x), weight, empty.confidence())
        }
        None => empty,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::Counting;
    use crate::weight::Tractable;

    /// A sampler that fails half of the time and else gives `x` with `p = ½`, and the target 3:
    /// over all outcomes of two draws the mean of `Σ w` is 3. Failures that are left out make it
    /// 4.5.
    #[test]
    fn candidates_that_were_not_drawn_count() {
        let weight = Tractable::<Counting>::from_density(0.5).unwrap().weight();
        let outcomes = [[false, false], [false, true], [true, false], [true, true]];
        let mean = |leave_out: bool| {
            let integrals = outcomes.map(|drawn| {
                let mut ris = Ris::<u32, Counting>::new();
                for drawn in drawn {
                    let candidate = drawn.then_some((7, 3.0, weight));
                    if drawn || !leave_out {
                        ris.drawn::<f32>(candidate, &mut lightshed_sampling::CounterRng::new(1, 2, 3));
                    }
                }
                ris.target_integral()
            });
            integrals.iter().sum::<f64>() / 4.0
        };
        assert_eq!(mean(false), 3.0);
        assert_eq!(mean(true), 4.5);
        let mut many = RisMany::<u32, Counting, 1>::new();
        many.null_candidate();
        many.candidate(&7, 3.0, weight, &mut lightshed_sampling::CounterRng::new(1, 2, 3));
        let [one]: [Reservoir<u32, Counting>; 1] = many.finish(1.0);
        assert_eq!(one.estimate(|_| 3.0), 3.0);
    }
}
