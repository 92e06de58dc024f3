//! Domains that a condition fixes.

use crate::domain::{Domain, Pulled, ShiftMapping, Shifted, Undefined};
use crate::space::{Given, Space};
use core::fmt;
use core::marker::PhantomData;

/// A domain `D` that a random variable of space `Z` has fixed: the suffixes behind a prefix.
///
/// Samples, targets and densities are those of `D`; contribution weights are conditional ones, of
/// the space [`Given<D::Space, Z>`](Given) (Kettunen 2023 def. 4.1). Reservoirs of it therefore do
/// not merge with those of `D`, and their weights become joint ones by
/// [`ContributionWeight::join`](crate::ContributionWeight::join) alone.
///
/// Neighbours may be fixed by other values of `Z`, and all of them are held fixed at once: their
/// correspondence may depend on them, on no sample behind them. `Z` in turn must not be resampled
/// by a target that has seen the sample behind it (eq. 19).
pub struct Conditional<D, Z> {
    domain: D,
    condition: PhantomData<Z>,
}

impl<D, Z> Conditional<D, Z> {
    /// The domain as the condition has fixed it.
    pub fn new(domain: D) -> Self {
        Self {
            domain,
            condition: PhantomData,
        }
    }

    /// The domain, the condition held fixed.
    #[inline(always)]
    pub fn domain(&self) -> &D {
        &self.domain
    }
}

// Not derived: a derive would ask for `Z: Clone`.
impl<D: Clone, Z> Clone for Conditional<D, Z> {
    fn clone(&self) -> Self {
        Self::new(self.domain.clone())
    }
}

impl<D: fmt::Debug, Z> fmt::Debug for Conditional<D, Z> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Conditional").field(&self.domain).finish()
    }
}

impl<D: Domain, Z: Space> Domain for Conditional<D, Z> {
    type Sample = D::Sample;
    type Space = Given<D::Space, Z>;

    #[inline(always)]
    fn target(&self, x: &D::Sample) -> f64 {
        self.domain.target(x)
    }

    #[inline(always)]
    fn tractable_density(&self, x: &D::Sample) -> Option<f64> {
        self.domain.tractable_density(x)
    }
}

/// A shift among domains, as one among [`Conditional`] domains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConditionalShift<T>(pub T);

impl<D: Domain, Z: Space, T: ShiftMapping<D>> ShiftMapping<Conditional<D, Z>> for ConditionalShift<T> {
    #[inline(always)]
    fn shift(
        &self,
        x: &D::Sample,
        from: &Conditional<D, Z>,
        to: &Conditional<D, Z>,
    ) -> Result<Shifted<D::Sample>, Undefined> {
        self.0.shift(x, &from.domain, &to.domain)
    }

    #[inline(always)]
    fn pull(
        &self,
        y: &D::Sample,
        to: &Conditional<D, Z>,
        from: &Conditional<D, Z>,
    ) -> Result<Pulled, Undefined> {
        self.0.pull(y, &to.domain, &from.domain)
    }
}
