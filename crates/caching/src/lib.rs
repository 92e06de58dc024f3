//! Radiance caches that trade bias for variance: paths end early in stored radiance.
//!
//! The crate knows no scene: it uses positions, normals, radiance, and the renderer's own type of
//! vertices. A renderer says how a stored vertex scatters light (one trait, [`VertexSampler`]),
//! lets the cache update itself before a frame, and asks at each vertex of a path whether it should
//! end there ([`PathBudget`]).
//!
//! | you want | take |
//! |---|---|
//! | outgoing radiance by place, with its variance and bias | [`RadianceCache`], [`CachedRadiance`] |
//! | variance and bias of what samples of many vertices give | [`VertexMoments`], [`CellMoments`] |
//! | to end paths so that images have a noise that you choose | [`Termination`], [`PathBudget`] |
//! | records by direction, for glossy surfaces | [`Facets`] |
//! | the area spread of a path | [`AreaSpread`] |
//! | samples that pixels of all frames share by place, merged by GRIS | [`WorldReservoirs`], [`WorldLinks`] |
//! | limits | [`RECORD_VERTICES`], [`MAX_UPDATE_SAMPLES`], [`MAX_REFINEMENT`], [`MAX_FACETS`], [`MAX_CELL_RESERVOIRS`], [`MAX_READS`] |
//!
//! A path that ends in a cache estimates another integral than one that does not. Everything here
//! is **biased**, on purpose, and estimates its bias as far as possible.
//!
//! Chapter, section and equation numbers refer to Dittebrandt 2025 (*Guided Sampling of
//! Illumination for Real-Time Path Tracing*) unless another work is named.
//!
//! # Features
//!
//! - `parallel`: updates over a rayon pool. Same result, bit for bit.
#![forbid(unsafe_code)]

mod budget;
mod cache;
mod cell;
mod error;
mod facets;
mod grid;
mod moments;
mod options;
mod published;
mod record;
mod report;
mod sampler;
mod spread;
mod surroundings;
mod termination;
mod view;
mod world;

pub use budget::{PathBudget, Prefixed};
pub use cache::RadianceCache;
pub use cell::CellMoments;
pub use error::CachingError;
pub use facets::{Facets, MAX_FACETS};
pub use glam;
pub use lightshed_resampling as resampling;
pub use lightshed_sampling as sampling;
pub use lightshed_spatial as spatial;
pub use moments::VertexMoments;
pub use options::{History, MAX_REFINEMENT, MAX_UPDATE_SAMPLES, RadianceCacheOptions, Refinement};
pub use published::CachedRadiance;
pub use record::RECORD_VERTICES;
pub use report::CacheReport;
pub use sampler::{CacheSample, VertexSampler, VertexVisit};
pub use spread::AreaSpread;
pub use termination::Termination;
pub use view::CacheView;
pub use world::{
    MAX_CELL_RESERVOIRS, MAX_READS, WorldDomain, WorldLinks, WorldReads, WorldReport, WorldReservoirOptions,
    WorldReservoirs, WorldVisits,
};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/caching.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
