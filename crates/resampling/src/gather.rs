//! The final gather over prefixes.

use crate::conditional::Conditional;
use crate::domain::{Domain, ShiftMapping};
use crate::merge::{Contribution, Input, MergeError, MergeReport, integrate};
use crate::mis::Mis;
use crate::space::{Given, Joint, Space};
use crate::storage::Storage;
use crate::weight::{ConditionallyIndependent, ContributionWeight, Tractable};

/// A final gather over `N` integration prefixes `X_i`, identically distributed, `K` of which bring
/// suffixes of their own (Kettunen 2023 eq. 23, there the first alone):
///
/// > `⟨I⟩ = 1/N Σ_{i=1}^{N} s_i/q_i m₁(X_i1) f(X_i, X_i1) W_{X_i,X_i1}`
/// > `+ 1/N Σ_{i=1}^{N} Σ_{j=2}^{M} m_j(Y_ij) f(X_i, Y_ij) W_{X_i,Y_ij}`
///
/// `s_i` is 1 if prefix `i` brings a suffix and 0 otherwise, and `q_i` is the probability of that:
/// `K/N`, or what [`FinalGather::survival`] makes of prefixes of different importance.
/// `Y_ij` is the suffix borrowed from the `j`-th supporting prefix of `X_i`, shifted to continue
/// `X_i`. Every prefix has a canonical technique, which counts in its MIS weights; roulette keeps
/// `K` canonical suffixes of the `N` and divides them by `q_i`, and the mean over prefixes divides
/// by `N`. So with one of them and `q_i = 1/N` the canonical term is *not* divided at all.
///
/// A visitor receives the contribution of each prefix with its share of a **joint** weight, in
/// another type than the conditional weights that went in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalGather {
    prefixes: u32,
    canonical: u32,
    /// `1 / (N q)` of the prefixes that follow.
    own: f64,
}

/// One suffix's part of a final gather.
pub struct JointContribution<'a, D: Domain, Z: Space> {
    /// Whether it is the prefix's own suffix.
    pub is_canonical: bool,
    /// The suffix, in the domain behind the integration prefix.
    pub sample: &'a D::Sample,
    /// The suffix's share of the joint weight: `m W_{X,Y}`, over `N` (`N q` if it is canonical). A
    /// sum of `f(X, Y)` times these over all prefixes estimates `∫∫ f`.
    pub weight: ContributionWeight<Joint<Z, D::Space>, f64>,
}

/// The contribution weight of an integration prefix, with what allows to join it with that of a
/// suffix (Kettunen 2023 Theorem 4.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrefixWeight<Z: Space>(ContributionWeight<Z, f64>);

impl<Z: Space> From<Tractable<Z, f64>> for PrefixWeight<Z> {
    /// Of a prefix that was drawn by a known density.
    fn from(prefix: Tractable<Z, f64>) -> Self {
        Self(prefix.weight())
    }
}

impl<Z: Space> PrefixWeight<Z> {
    /// Of a prefix that was resampled without regard to any of the suffixes that continue it.
    pub fn resampled(weight: ContributionWeight<Z, f64>, _: ConditionallyIndependent) -> Self {
        Self(weight)
    }
}

impl FinalGather {
    /// A gather over `prefixes` prefixes, `canonical` of them with a suffix of their own; `None`
    /// unless `1 ≤ K ≤ N`.
    pub fn new(prefixes: u32, canonical: u32) -> Option<Self> {
        (1..=prefixes).contains(&canonical).then_some(Self {
            prefixes,
            canonical,
            own: 1.0 / f64::from(canonical),
        })
    }

    /// `N`.
    pub fn prefixes(self) -> u32 {
        self.prefixes
    }

    /// `K`.
    pub fn canonical(self) -> u32 {
        self.canonical
    }

    /// The probability `q_i = min(1, K w_i / Σ w)` with which a prefix of importance `w_i` brings a
    /// suffix, where the importances of all prefixes have this sum; 0 unless both are positive.
    ///
    /// Importances may depend on all prefixes and on what they borrow, on no canonical suffix.
    pub fn survival(self, importance: f64, sum: f64) -> f64 {
        let share = f64::from(self.canonical) * importance / sum;
        // False for NaN.
        if share > 0.0 { share.min(1.0) } else { 0.0 }
    }

    /// For a prefix that brings a suffix with the probability `q`. One that never does has none to
    /// weigh.
    #[must_use]
    pub fn surviving(self, q: f64) -> Self {
        let own = if q > 0.0 {
            1.0 / (q * f64::from(self.prefixes))
        } else {
            0.0
        };
        Self { own, ..self }
    }

    /// The weight `1 / (N q)` of a canonical suffix.
    pub fn own_share(self) -> f64 {
        self.own
    }

    /// The part of one integration prefix; the suffixes `to` follow it.
    ///
    /// `inputs` are the canonical reservoir of `to` and the reservoirs of the supporting prefixes.
    /// The canonical reservoirs of the prefixes that bring a suffix hold one drawn behind theirs
    /// (or none, if nothing was found). Those of the others are empty and have the same confidence:
    /// that is what roulette has left of them.
    ///
    /// # Errors
    /// As [`integrate`].
    pub fn integrate<D: Domain, Z: Space, T: ShiftMapping<Conditional<D, Z>>, R: Storage>(
        self,
        prefix: PrefixWeight<Z>,
        to: &Conditional<D, Z>,
        shift: &T,
        inputs: &[Input<'_, Conditional<D, Z>, R>],
        mis: Mis,
        mut visit: impl FnMut(JointContribution<'_, D, Z>),
    ) -> Result<MergeReport, MergeError> {
        let (borrowed, own) = (1.0 / f64::from(self.prefixes), self.own);
        integrate(to, shift, inputs, mis, |part: Contribution<'_, D::Sample>| {
            let is_canonical = inputs[part.input].canonical;
            let share = if is_canonical { own } else { borrowed };
            let suffix = ContributionWeight::<Given<D::Space, Z>, f64>::stored(part.weight * share);
            visit(JointContribution {
                is_canonical,
                sample: part.sample,
                // `PrefixWeight` is where the premise is stated.
                weight: prefix.0.join(suffix, ConditionallyIndependent::PROMISED),
            });
        })
    }
}
