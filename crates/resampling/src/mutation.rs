//! Markov chain steps of a reservoir's sample.

use crate::choose::Choose;
use crate::reservoir::Reservoir;
use crate::space::Space;
use crate::storage::{Storage, product, sanitised};
use crate::weight::ContributionWeight;

/// A proposal `y` for a reservoir's sample `x`, in the same domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mutation<X> {
    /// `y`.
    pub sample: X,
    /// `p̂(y)`.
    pub target: f64,
    /// `q(y → x) / q(x → y)`, densities of the proposals in the measure of the domain: 1 where
    /// proposals are symmetric.
    pub ratio: f64,
}

impl<X, S: Space, R: Storage> Reservoir<X, S, R> {
    /// One step of Metropolis and Hastings with the stationary density `p̂` (Sawhney et al. 2022,
    /// *Decorrelating ReSTIR Samplers via MCMC Mutations*): with probability
    /// `min(1, p̂(y) q(y → x) / (p̂(x) q(x → y)))` the sample becomes `y`, and its weight
    /// `W p̂(x) / p̂(y)`.
    ///
    /// `E[f(Y) W_Y]` is what it was: the weight of a resampled sample is a sum over its candidates
    /// divided by `p̂(x)`, and the step leaves `p̂` as it is. It tells apart samples that share
    /// their origin, in pixels and in frames. `target` is `p̂(x)` of the sample held; the
    /// confidence stays.
    ///
    /// Draws one decision unless the proposal is certain or impossible; an empty reservoir stays
    /// empty.
    #[must_use]
    pub fn mutated(self, target: f64, mutation: Mutation<X>, choose: &mut impl Choose) -> Self {
        let (held, proposed) = (sanitised(target), sanitised(mutation.target));
        let part = product([proposed, sanitised(mutation.ratio)]);
        if self.is_empty() || held == 0.0 || part == 0.0 {
            return self;
        }
        if part < held && !choose.accept(part, held) {
            return self;
        }
        let weight = product([self.weight().value().to_f64(), held]) / proposed;
        let weight = ContributionWeight::stored(weight);
        Self::assembled(Some(mutation.sample), weight, self.confidence())
    }
}
