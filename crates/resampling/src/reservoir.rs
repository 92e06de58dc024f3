//! A reservoir: one sample, its unbiased contribution weight, and how much it is trusted.

use crate::space::{Given, Space};
use crate::storage::Storage;
use crate::weight::{ContributionWeight, Tractable, WeightError};

/// A sample `X`, its unbiased contribution weight `W_X` in the space `S`, and its confidence `c`
/// (Lin 2022 §6.5.2, there `M_r`).
///
/// * An *empty* reservoir (no sample, or `W = 0`) is a null sample: it contributes nothing and
///   keeps its confidence, because the technique that came up empty could have produced any sample
///   of its support.
/// * Confidence weighs a *technique* in MIS weights. It must not depend on the value of the sample.
///   Capping it leaves `W` alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reservoir<X, S: Space, R: Storage = f32> {
    sample: Option<X>,
    weight: ContributionWeight<S, R>,
    confidence: f32,
}

impl<X, S: Space, R: Storage> Default for Reservoir<X, S, R> {
    fn default() -> Self {
        Self::empty(0.0)
    }
}

impl<X, S: Space, R: Storage> Reservoir<X, S, R> {
    /// A reservoir with a sample.
    ///
    /// # Errors
    /// [`WeightError::Confidence`] unless `confidence` is finite and not negative.
    pub fn new(sample: X, weight: ContributionWeight<S, R>, confidence: f32) -> Result<Self, WeightError> {
        if confidence.is_finite() && confidence >= 0.0 {
            Ok(Self::assembled(Some(sample), weight, confidence))
        } else {
            Err(WeightError::Confidence)
        }
    }

    /// A sample drawn from a known density in `S`, `W = 1/p`.
    ///
    /// # Errors
    /// [`WeightError`] where the density has no finite positive reciprocal, or the confidence is
    /// not valid.
    pub fn from_density(sample: X, density: R, confidence: f32) -> Result<Self, WeightError> {
        Self::new(
            sample,
            Tractable::<S, R>::from_density(density)?.weight(),
            confidence,
        )
    }

    /// A null sample of a technique trusted by `confidence` (NaN and negative count as 0).
    #[inline]
    pub fn empty(confidence: f32) -> Self {
        // Also false for NaN.
        let confidence = if confidence > 0.0 {
            confidence.min(f32::MAX)
        } else {
            0.0
        };
        Self::assembled(None, ContributionWeight::zero(), confidence)
    }

    #[inline]
    pub(crate) fn assembled(sample: Option<X>, weight: ContributionWeight<S, R>, confidence: f32) -> Self {
        Self {
            sample,
            weight,
            confidence,
        }
    }

    /// The sample, unless it is the null sample.
    #[inline(always)]
    pub fn sample(&self) -> Option<&X> {
        self.sample.as_ref()
    }

    /// The sample with its weight: what an estimator `f(X) W_X` needs.
    #[inline(always)]
    pub fn weighted_sample(&self) -> Option<(&X, ContributionWeight<S, R>)> {
        self.sample.as_ref().map(|sample| (sample, self.weight))
    }

    /// `W_X`; 0 for the null sample.
    #[inline(always)]
    pub fn weight(&self) -> ContributionWeight<S, R> {
        self.weight
    }

    /// `c ≥ 0`.
    #[inline(always)]
    pub fn confidence(&self) -> f32 {
        self.confidence
    }

    /// Whether it holds the null sample.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.sample.is_none()
    }

    /// `c ← min(c, cap)` (Lin 2022 §6.5.4). Never touches `W`. A cap that is NaN or negative
    /// counts as 0.
    #[inline(always)]
    #[must_use]
    pub fn with_confidence_cap(mut self, cap: f32) -> Self {
        self.confidence = self.confidence.min(cap.max(0.0));
        self
    }

    /// The estimate `f(X) W_X` of `∫ f`, 0 for the null sample. `f` is in the measure of `S`.
    #[inline]
    pub fn estimate(&self, integrand: impl FnOnce(&X) -> f64) -> f64 {
        self.sample
            .as_ref()
            .map_or(0.0, |x| integrand(x) * self.weight.value().to_f64())
    }

    /// Keeps the sample only if `support` is true, otherwise the null sample; confidence stays.
    /// This is RIS with `M = 1` and a target that vanishes outside the support, such as `p̂ V`
    /// after a visibility test: `W` is then unchanged. The domain that the reservoir is used in
    /// must have that target. Otherwise MIS weights count on samples that the technique no longer
    /// produces.
    #[inline]
    #[must_use]
    pub fn within(self, support: impl FnOnce(&X) -> bool) -> Self {
        let kept = self.sample.as_ref().is_some_and(support);
        if kept { self } else { Self::empty(self.confidence) }
    }

    /// The same reservoir with a conditional weight: of a domain that a variable of space `Z` had
    /// fixed before anything was drawn in it (see [`ContributionWeight::given`]).
    #[inline]
    pub fn given<Z: Space>(self) -> Reservoir<X, Given<S, Z>, R> {
        Reservoir::assembled(self.sample, self.weight.given(), self.confidence)
    }

    /// Replaces the sample by an equal one in another form (packed, borrowed, converted).
    #[inline]
    pub fn map<Y>(self, f: impl FnOnce(X) -> Y) -> Reservoir<Y, S, R> {
        Reservoir::assembled(self.sample.map(f), self.weight, self.confidence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::Counting;

    #[test]
    fn capping_leaves_the_weight_and_emptiness_keeps_the_confidence() {
        let reservoir = Reservoir::<u32, Counting>::from_density(7, 0.25, 40.0).unwrap();
        let capped = reservoir.with_confidence_cap(20.0);
        assert_eq!((capped.confidence(), capped.weight().value()), (20.0, 4.0));
        assert_eq!(capped.with_confidence_cap(f32::NAN).confidence(), 0.0);
        let empty = Reservoir::<u32, Counting>::empty(12.0);
        assert!(empty.is_empty());
        assert_eq!((empty.confidence(), empty.weight().value()), (12.0, 0.0));
        assert_eq!(empty.estimate(|_| 1.0), 0.0);
        assert_eq!(
            Reservoir::<u32, Counting>::from_density(7, 0.25, -1.0),
            Err(WeightError::Confidence)
        );
    }
}
