//! Reservoirs, resampled importance sampling, MIS families, GRIS, conditional RIS and
//! spatiotemporal reuse.
//!
//! Generic over the sample, the integration domain and the shift mapping: no scene, no renderer, no
//! thread pool. Implement [`Domain`] for a pixel (or a cell, or a suffix space behind a prefix),
//! [`ShiftMapping`] between two of them, and [`merge`] reuses samples among them without bias.
//!
//! | you want | take |
//! |---|---|
//! | one sample of many candidates, or several | [`Ris`], [`MixtureRis`], [`RisMany`] |
//! | samples of other domains | [`merge`], [`Input`], [`Mis`] |
//! | passes over pixels and frames | [`Reuse`], [`Topology`], [`History`] |
//! | suffixes behind prefixes | [`Conditional`], [`FinalGather`] |
//! | chains in a tile of pixels | [`ChainTile`], [`spatial_smis`], [`temporal_smis`] |
//! | how samples hang together | [`Moments`], [`duplicate_rate`], [`neighbour_correlation`], [`series_autocorrelation`] |
//!
//! Equation numbers refer to Lin 2022 (*High-Quality Sampling for Complex Effects in Real-Time Ray
//! Tracing*, ch. 6 and app. B) and Kettunen 2023 (*Conditional Resampled Importance Sampling and
//! ReSTIR*).
#![forbid(unsafe_code)]

mod choose;
mod conditional;
mod diagnostics;
mod domain;
mod gather;
mod merge;
mod mis;
mod mutation;
mod record;
mod reservoir;
mod reuse;
mod ris;
mod selection;
mod space;
mod stochastic_mis;
mod storage;
mod weight;

pub use choose::Choose;
pub use conditional::{Conditional, ConditionalShift};
pub use diagnostics::{
    DistinctSamples, Moments, correlation, duplicate_rate, neighbour_correlation, series_autocorrelation,
};
pub use domain::{
    BrokenLaw, Domain, IdentityShift, Jacobian, Pulled, ShiftMapping, Shifted, Undefined, round_trip,
};
pub use gather::{FinalGather, JointContribution, PrefixWeight};
pub use lightshed_sampling as sampling;
pub use merge::{
    Carried, Contribution, DomainReservoir, Evaluations, Input, MergeError, MergeReport, Merged,
    PairwiseStream, UndefinedShifts, integrate, merge, merge_and_integrate, merge_several,
};
pub use mis::{Mis, MisError, Pairwise, Technique};
pub use mutation::Mutation;
pub use record::{ReservoirRecord, SelectionRecord, TAG_EMPTY, TAG_SAMPLE};
pub use reservoir::Reservoir;
pub use reuse::{
    CellGrid, Domains, Extent, Filtered, History, MergeRule, NeighbourLists, PairedPattern, Pattern,
    PatternError, PixelNeighbours, PixelPairs, Reuse, ReuseError, Sums, Topology, TopologyError,
};
pub use ris::{MixtureRis, Ris, RisMany, balance_over_techniques};
pub use selection::{JumpSelection, Kept, Selection, Selections, WithoutReplacement, spread_copies};
pub use space::{Counting, Given, Joint, Space};
pub use stochastic_mis::{ChainTile, Exchange, SetWeight, TileScratch, permute, spatial_smis, temporal_smis};
pub use storage::Storage;
pub use weight::{ConditionallyIndependent, ContributionWeight, Tractable, WeightError};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/resampling.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
