//! How each domain of a pass merges what reaches it.

use crate::choose::Choose;
use crate::domain::{Domain, ShiftMapping};
use crate::merge::{
    Contribution, DomainReservoir, Input, MergeError, MergeReport, Merged, merge, merge_and_integrate,
    merge_several,
};
use crate::mis::Mis;
use crate::reservoir::Reservoir;
use crate::space::Space;
use crate::storage::Storage;

/// How domains merge: a shift mapping, a MIS family, and a cap of confidence. What passes do to
/// each of their domains; a renderer that works domain by domain does it by itself.
///
/// ```
/// use lightshed_resampling::{IdentityShift, MergeRule, Mis};
/// let rule = MergeRule::new(IdentityShift).with_mis(Mis::Balance).with_confidence_cap(30.0);
/// # let _ = rule;
/// ```
#[derive(Clone, Copy, Debug)]
pub struct MergeRule<T> {
    pub(super) shift: T,
    pub(super) mis: Mis,
    confidence_cap: f32,
}

impl<T> MergeRule<T> {
    /// Defensive pairwise weights (Lin 2022 eq. 6.38) and a cap of 20.
    pub const fn new(shift: T) -> Self {
        Self {
            shift,
            mis: Mis::PAIRWISE_DEFENSIVE,
            confidence_cap: 20.0,
        }
    }

    /// With another MIS family.
    #[must_use]
    pub fn with_mis(self, mis: Mis) -> Self {
        Self { mis, ..self }
    }

    /// With another cap `M_c` (Lin 2022 §6.5.4): what comes out is trusted by at most it;
    /// `f32::INFINITY` for no cap. One that is NaN or negative counts as 0.
    #[must_use]
    pub fn with_confidence_cap(self, confidence_cap: f32) -> Self {
        Self {
            confidence_cap,
            ..self
        }
    }

    /// [`merge`] by this rule.
    ///
    /// # Errors
    /// As [`merge`].
    #[inline]
    pub fn merge<D: Domain, R: Storage>(
        &self,
        to: &D,
        inputs: &[Input<'_, D, R>],
        choose: &mut impl Choose,
    ) -> Result<Merged<D, R>, MergeError>
    where
        T: ShiftMapping<D>,
    {
        let merged = merge(to, &self.shift, inputs, self.mis, choose)?;
        Ok(self.capped(merged))
    }

    /// [`merge_and_integrate`] by this rule.
    ///
    /// # Errors
    /// As [`merge`].
    #[inline]
    pub fn merge_and_integrate<D: Domain, R: Storage>(
        &self,
        to: &D,
        inputs: &[Input<'_, D, R>],
        choose: &mut impl Choose,
        visit: impl FnMut(Contribution<'_, D::Sample>),
    ) -> Result<Merged<D, R>, MergeError>
    where
        T: ShiftMapping<D>,
    {
        let merged = merge_and_integrate(to, &self.shift, inputs, self.mis, choose, visit)?;
        Ok(self.capped(merged))
    }

    /// [`merge_several`] by this rule.
    ///
    /// # Errors
    /// As [`merge`].
    pub fn merge_several<D: Domain, R: Storage>(
        &self,
        to: &D,
        inputs: &[Input<'_, D, R>],
        same: impl Fn(&D::Sample, &D::Sample) -> bool,
        output: &mut [DomainReservoir<D, R>],
        choose: &mut impl Choose,
    ) -> Result<MergeReport, MergeError>
    where
        T: ShiftMapping<D>,
    {
        let report = merge_several(to, &self.shift, inputs, self.mis, same, output, choose)?;
        for reservoir in output {
            *reservoir = self.passed(reservoir);
        }
        Ok(report)
    }

    #[inline]
    pub(super) fn capped<D: Domain, R: Storage>(&self, mut merged: Merged<D, R>) -> Merged<D, R> {
        merged.reservoir = merged.reservoir.with_confidence_cap(self.confidence_cap);
        merged
    }

    /// What passes on without a merge.
    #[inline]
    pub(super) fn passed<X: Clone, S: Space, R: Storage>(
        &self,
        reservoir: &Reservoir<X, S, R>,
    ) -> Reservoir<X, S, R> {
        reservoir.clone().with_confidence_cap(self.confidence_cap)
    }
}
