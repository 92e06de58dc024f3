//! Unbiased contribution weights: marginal, conditional and joint, told apart by their type.
//!
//! An unbiased contribution weight `W_X ≥ 0` of a random variable `X` in a space with measure
//! `dx` satisfies, for every integrable `f`,
//!
//! > `E[f(X) W_X] = ∫_{supp X} f(x) dx` (Lin 2022 eq. 6.8), equivalently `E[W_X | X] = 1/p_X(X)`
//! > (eq. 6.9).
//!
//! Conditional weights `W_{X|Z}` satisfy `E[f(X) W_{X|Z} | Z] = ∫_{supp X|Z} f(x) dx` (Kettunen
//! 2023 eq. 5) and are weights of the space [`Given<S, Z>`](crate::Given). Two weights have no
//! product:
//!
//! ```compile_fail
//! use lightshed_resampling::{ContributionWeight, Counting, Given};
//! let prefix = ContributionWeight::<Counting>::new(2.0)?;
//! let suffix = ContributionWeight::<Given<Counting, Counting>>::new(3.0)?;
//! let joint = prefix * suffix; // error: the two may share randomness
//! # Ok::<(), lightshed_resampling::WeightError>(())
//! ```
//!
//! because `W_Z · W_{X|Z}` is a joint weight only if `(X, W_{X|Z})` is conditionally independent
//! of `W_Z` given `Z` (Theorem 4.1). Two ways lead across:
//!
//! ```
//! use lightshed_resampling::{
//!     ConditionallyIndependent, ContributionWeight, Counting, Given, Joint, Tractable,
//! };
//! let suffix = ContributionWeight::<Given<Counting, Counting>>::new(3.0)?;
//!
//! // The prefix was drawn from a density: 1/p(z) is a function of z alone, so nothing is to be promised.
//! let prefix = Tractable::<Counting>::from_density(0.5)?;
//! let joint: ContributionWeight<Joint<Counting, Counting>> = prefix.join(suffix);
//! assert_eq!(joint.value(), 6.0);
//!
//! // The prefix was resampled: its weight carries randomness of its own, and independence is
//! // the caller's word.
//! let prefix = ContributionWeight::<Counting>::new(2.0)?;
//! let joint = prefix.join(suffix, ConditionallyIndependent::PROMISED);
//! assert_eq!(joint.value(), 6.0);
//! # Ok::<(), lightshed_resampling::WeightError>(())
//! ```

use crate::space::{Given, Joint, Space};
use crate::storage::{Storage, product};
use core::marker::PhantomData;
use lightshed_sampling::{Density, Measure};

/// Why a number is no contribution weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WeightError {
    /// The weight or the density is negative (Lin 2022 §B.3.2: a negative weight cannot be
    /// resampled).
    Negative,
    /// The weight or the density is NaN or infinite, or the density is so small that its reciprocal
    /// is.
    NotFinite,
    /// The density is zero: a sample with zero density cannot have been drawn.
    ZeroDensity,
    /// The confidence is negative, NaN or infinite.
    Confidence,
}

impl core::fmt::Display for WeightError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Negative => "contribution weight or density is negative",
            Self::NotFinite => "contribution weight or density, or its reciprocal, is not finite",
            Self::ZeroDensity => "density of a drawn sample is zero",
            Self::Confidence => "confidence is negative or not finite",
        })
    }
}

impl core::error::Error for WeightError {}

fn checked(value: f64) -> Result<f64, WeightError> {
    if !value.is_finite() {
        Err(WeightError::NotFinite)
    } else if value < 0.0 {
        Err(WeightError::Negative)
    } else {
        Ok(value)
    }
}

fn reciprocal(density: f64) -> Result<f64, WeightError> {
    let density = checked(density)?;
    if density == 0.0 {
        Err(WeightError::ZeroDensity)
    } else {
        checked(1.0 / density)
    }
}

/// An unbiased contribution weight `W ≥ 0` in the space `S`, finite, stored as `R`. Its unit is
/// that of the measure of `S` (steradians for `SolidAngle`): it takes the place of `1/p`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct ContributionWeight<S: Space, R: Storage = f32> {
    value: R,
    space: PhantomData<S>,
}

/// Zero, stored as `f32`: for one storage only, so that `ContributionWeight::<S>::default()` needs
/// no other type.
impl<S: Space> Default for ContributionWeight<S> {
    fn default() -> Self {
        Self::zero()
    }
}

impl<S: Space, R: Storage> ContributionWeight<S, R> {
    /// The weight of an empty reservoir.
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self::stored(0.0)
    }

    /// States that `value` is an unbiased contribution weight in `S`.
    ///
    /// # Errors
    /// [`WeightError::Negative`] or [`WeightError::NotFinite`].
    pub fn new(value: R) -> Result<Self, WeightError> {
        checked(value.to_f64()).map(|_| Self::stored(value.to_f64()))
    }

    /// Rounds a non-negative number into storage; saturates at the largest finite one.
    #[inline(always)]
    pub(crate) fn stored(value: f64) -> Self {
        Self {
            value: R::from_f64(value),
            space: PhantomData,
        }
    }

    /// The bare number, in units of the measure of `S`.
    #[inline(always)]
    pub fn value(self) -> R {
        self.value
    }

    /// The same number as a conditional weight `W_{X|Z}`: that of a sample drawn or resampled in a
    /// domain which a variable of space `Z` had fixed before. There is no way back: a conditional
    /// weight says nothing of `Z`.
    #[inline(always)]
    pub fn given<Z: Space>(self) -> ContributionWeight<Given<S, Z>, R> {
        ContributionWeight {
            value: self.value,
            space: PhantomData,
        }
    }

    /// The weight of the pair `(z, x)`, `W_{Z,X} = W_Z W_{X|Z}` (Kettunen 2023 eq. 9), under the
    /// condition that the last argument spells out.
    #[inline]
    pub fn join<X: Space>(
        self,
        conditional: ContributionWeight<Given<X, S>, R>,
        _: ConditionallyIndependent,
    ) -> ContributionWeight<Joint<S, X>, R> {
        ContributionWeight::stored(product([self.value.to_f64(), conditional.value.to_f64()]))
    }
}

/// The premise of Kettunen 2023 Theorem 4.1, given as a word of honour: *`X` and `W_{X|Z}` are
/// conditionally independent of `W_Z`, given `Z`*.
///
/// It holds if the suffix was made from random numbers of its own after `Z` was fixed. It fails if
/// the suffix depends on something besides `Z` that `W_Z` also depends on, such as the candidates
/// that `Z` was chosen from.
///
/// Besides, `W_{X|Z}` must be a conditional weight in the first place. If a supporting prefix was
/// resampled by a target that saw the suffix, the suffix is no longer distributed, given that
/// prefix, as its weight says. Keep the prefix target free of the suffix (Kettunen 2023 eq. 19).
#[derive(Clone, Copy, Debug)]
pub struct ConditionallyIndependent {
    _private: (),
}

impl ConditionallyIndependent {
    /// The caller has checked the premise.
    pub const PROMISED: Self = Self { _private: () };
}

/// A weight `1/p(x)` with a known density: a function of `x` alone, hence independent of everything
/// else given `x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tractable<S: Space, R: Storage = f32>(ContributionWeight<S, R>);

impl<S: Space, R: Storage> Tractable<S, R> {
    /// `W = 1/p` for a density (or probability) `p` in `S`.
    ///
    /// # Errors
    /// [`WeightError`] unless `p` is positive and it and its reciprocal are finite.
    pub fn from_density(density: R) -> Result<Self, WeightError> {
        reciprocal(density.to_f64()).map(|weight| Self(ContributionWeight::stored(weight)))
    }

    /// Forgets that the density was known.
    #[inline(always)]
    pub fn weight(self) -> ContributionWeight<S, R> {
        self.0
    }

    /// The weight of the pair `(z, x)`, `W_{X|Z} / p(z)` (Kettunen 2023 eq. 9). Needs no promise:
    /// the premise of Theorem 4.1 holds because `1/p(z)` is constant given `z`.
    #[inline]
    pub fn join<X: Space>(
        self,
        conditional: ContributionWeight<Given<X, S>, R>,
    ) -> ContributionWeight<Joint<S, X>, R> {
        self.0.join(conditional, ConditionallyIndependent::PROMISED)
    }
}

impl<M: Measure + Space> TryFrom<Density<M>> for Tractable<M> {
    type Error = WeightError;
    fn try_from(density: Density<M>) -> Result<Self, WeightError> {
        Self::from_density(density.value())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::Counting;
    use lightshed_sampling::SolidAngle;

    #[test]
    fn the_default_needs_no_type_of_storage() {
        assert_eq!(ContributionWeight::<Counting>::default().value(), 0.0f32);
        assert_eq!(ContributionWeight::<Counting, f64>::zero().value(), 0.0f64);
    }

    #[test]
    fn construction_refuses_what_is_no_weight() {
        type W = ContributionWeight<Counting>;
        assert_eq!(W::new(-1.0), Err(WeightError::Negative));
        assert_eq!(W::new(f32::NAN), Err(WeightError::NotFinite));
        assert_eq!(W::new(f32::INFINITY), Err(WeightError::NotFinite));
        assert_eq!(
            Tractable::<Counting>::from_density(0.0),
            Err(WeightError::ZeroDensity)
        );
        assert_eq!(
            Tractable::<Counting, f64>::from_density(1e-320),
            Err(WeightError::NotFinite)
        );
        let from_measure = Tractable::try_from(Density::<SolidAngle>::new(0.25)).unwrap();
        assert_eq!(from_measure.weight().value(), 4.0);
    }
}
