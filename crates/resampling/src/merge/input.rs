//! What goes into a merge and what comes out.

use super::report::MergeReport;
use crate::domain::Domain;
use crate::reservoir::Reservoir;
use crate::storage::Storage;

/// The reservoir of a domain: its samples, its space.
pub type DomainReservoir<D, R = f32> = Reservoir<<D as Domain>::Sample, <D as Domain>::Space, R>;

/// One input of a merge: a reservoir and the domain its sample lives in.
pub struct Input<'a, D: Domain, R: Storage = f32> {
    pub(crate) domain: &'a D,
    pub(crate) reservoir: &'a DomainReservoir<D, R>,
    pub(crate) canonical: bool,
}

// Not derived: a derive would ask for `D: Clone`.
impl<D: Domain, R: Storage> Clone for Input<'_, D, R> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<D: Domain, R: Storage> Copy for Input<'_, D, R> {}

impl<'a, D: Domain, R: Storage> Input<'a, D, R> {
    /// A canonical sample (Lin 2022 def. 6.4.2): drawn in the domain merged into, with its target,
    /// covering its support; no shift. `domain` is that domain; it may be another value with the
    /// same target and its own [`tractable_density`](Domain::tractable_density), one for each
    /// technique.
    #[inline]
    pub fn canonical(domain: &'a D, reservoir: &'a DomainReservoir<D, R>) -> Self {
        Self {
            domain,
            reservoir,
            canonical: true,
        }
    }

    /// A sample of another domain, to be shifted.
    ///
    /// Which neighbours take part must not depend on their samples: leaving one out because *its
    /// own* sample fails a test is biased. A neighbour with an empty reservoir takes part.
    #[inline]
    pub fn neighbour(domain: &'a D, reservoir: &'a DomainReservoir<D, R>) -> Self {
        Self {
            domain,
            reservoir,
            canonical: false,
        }
    }

    #[inline(always)]
    pub(crate) fn confidence(&self) -> f64 {
        f64::from(self.reservoir.confidence())
    }
}

/// The outcome of a merge.
pub struct Merged<D: Domain, R: Storage = f32> {
    /// `(Y, W_Y, Σ c_i)`. Cap its confidence before it is reused over frames.
    pub reservoir: DomainReservoir<D, R>,
    /// By-products.
    pub report: MergeReport,
}

impl<D: Domain, R: Storage> Clone for Merged<D, R> {
    fn clone(&self) -> Self {
        Self {
            reservoir: self.reservoir.clone(),
            report: self.report,
        }
    }
}

/// Why inputs cannot be merged. All causes are visible in confidences and roles alone, never in
/// samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MergeError {
    /// Pairwise MIS weighs each neighbour against the canonical samples, and none of them has
    /// confidence.
    NoCanonicalConfidence,
    /// More neighbour confidence came in than was announced.
    ConfidenceExceeded,
}

impl core::fmt::Display for MergeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NoCanonicalConfidence => "pairwise MIS needs a canonical input with positive confidence",
            Self::ConfidenceExceeded => "neighbours brought more confidence than was announced",
        })
    }
}

impl core::error::Error for MergeError {}
