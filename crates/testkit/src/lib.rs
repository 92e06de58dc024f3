//! Statistics, quadrature, exact enumeration and planted faults for tests of estimators.
//!
//! A test compares an estimator with something that the estimator did not compute itself. This
//! crate supplies such things:
//!
//! | question | tool |
//! |---|---|
//! | is `E[f(Y) W]` exactly `Σ f` on a finite domain? | [`expectation`], [`expectation_vector`], [`distribution`] |
//! | does a histogram match a density? | [`chi_squared_test`], [`kolmogorov_smirnov_test`] |
//! | is a Monte Carlo mean right? | [`MeanTest`] |
//! | does a density integrate to one? | [`integrate`], [`integrate_rectangle`], [`integrate_sphere`], [`integrate_lobe`] |
//! | is a distribution of directions one? | [`DirectionConformance`] |
//! | is a Jacobian right? | [`jacobian_determinant`] |
//! | does a shift mapping keep its laws? | [`ShiftConformance`] |
//! | do two images agree? | [`compare_tiles`] |
//! | is an `f32` result close to an `f64` truth? | [`ulp_error`], [`hostile_f32`] |
//! | how far apart are two `f32`? | [`ulp_distance`], [`ulp_size`] |
//! | random numbers of tests | [`rng`], [`uniform_f64`], [`uniform_f32`] |
//! | data that may be absent | [`found_or_skipped`] |
//! | can this test fail at all? | [`check_faults`] |
//!
//! Every statistical test takes a `significance`: the probability that it rejects a *correct*
//! implementation. With the fixed seeds of [`rng`] a test that passes once always passes. The
//! significance says how unlucky a seed can be, and therefore how much a failure means.
#![forbid(unsafe_code)]

mod chi2;
mod conformance;
mod directions;
mod enumerate;
mod fault;
mod hostile_unit;
mod jacobian;
mod ks;
mod mean;
mod quadrature;
mod rejection;
mod skip;
mod sphere;
mod tiles;
mod ulp;
mod uniform;

pub use chi2::{ChiSquaredReport, chi_squared_test, family_significance};
pub use conformance::{Shift, ShiftConformance, ShiftTally};
pub use directions::{DirectionConformance, DirectionFault};
pub use enumerate::{
    Chooser, Expectation, VectorExpectation, distribution, expectation, expectation_vector, for_each_outcome,
};
pub use fault::{CaughtFault, FaultError, check_faults};
pub use hostile_unit::hostile_unit_f32;
pub use jacobian::{JacobianEstimate, jacobian_determinant};
pub use ks::{KolmogorovSmirnovReport, kolmogorov_smirnov_test};
pub use mean::{MeanReport, MeanTest};
pub use quadrature::{GaussLegendre, Integral, integrate, integrate_rectangle};
pub use rand;
pub use rejection::StatisticsError;
pub use skip::found_or_skipped;
pub use sphere::{integrate_hemisphere, integrate_lobe, integrate_sphere};
pub use tiles::{ChannelRatio, ImageMoments, TileOptions, TileReport, TileScore, compare_tiles};
pub use ulp::{hostile_f32, relative_error, ulp_distance, ulp_error, ulp_size};
pub use uniform::{rng, uniform_f32, uniform_f64};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/testkit.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
