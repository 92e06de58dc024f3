//! Guides that learn from paths where light comes from, Markov chains of lobes that need no list of
//! lights, and caches of visible lights.
//!
//! The crate knows no scene: it uses positions, directions and radiance, and lights as the crate
//! `lightshed-lights` does. A renderer records samples while it traces paths, updates once a pass
//! or a frame, and asks for a distribution at each vertex of its paths. Every distribution states
//! the density with which it actually samples, so estimates that divide by it are unbiased whatever
//! was learnt.
//!
//! | you want | take |
//! |---|---|
//! | a guide over space | [`GuidingField`] with a [`DirectionalModel`]: [`QuadtreeModel`], [`WeightedTreeModel`], [`VmfModel`] |
//! | quadtrees alone, and their limits | [`CompressedQuadtree`], [`MAX_QUADTREE_BITS`], [`MAX_QUADTREE_DEPTH`] |
//! | lobes alone | [`VmfMixture`], [`VmfLobe`], [`concentration_of`] |
//! | a field on a device | [`GuidingField::flat`], [`FlatGuidingField`] |
//! | the same in a bounded memory | [`HashCells`] as the field's partition |
//! | chains that need no list of lights | [`MarkovState`], [`MarkovChain`] |
//! | choosing among neighbours' states | [`Discovery`], [`neighbour_offset`] of [`OFFSET_WORDS`] words |
//! | caches of visible lights | [`LightCache`], [`LightTreeCache`] |
//! | a cache on a device | [`LightCache::flat`], [`FlatLightCache`] |
//!
//! Chapter, section and equation numbers refer to Dittebrandt 2025 (*Guided Sampling of
//! Illumination for Real-Time Path Tracing*) unless another work is named.
//!
//! # Features
//!
//! - `parallel`: updates over a rayon pool. Same result, bit for bit.
//! - `serde`: saves and loads learnt data.
#![forbid(unsafe_code)]

mod binary_tree;
mod error;
mod field;
mod flat;
mod hash_cells;
mod light_cache;
mod lobe;
mod markov;
mod model;
mod options;
mod partition;
mod passage;
mod places;
mod quadtree;
mod ranges;
mod recorder;
mod sample;
mod saved;
mod share;
mod square;
mod vmf;
mod weighted_tree;

pub use binary_tree::BinaryTree;
pub use error::GuidingError;
pub use field::{FieldUpdate, Guidance, GuidingField};
pub use flat::FlatGuidingField;
pub use glam;
pub use hash_cells::{HashCells, HashCellsOptions};
pub use light_cache::{
    BucketRule, CacheMoments, CacheUse, Exploration, ExplorationTable, ExplorationWeights, FlatLightCache,
    LightCache, LightCacheOptions, LightCacheReport, LightRecord, LightTreeCache, LightTreeCacheOptions,
    MAX_BUCKET,
};
pub use lightshed_lights as lights;
pub use lightshed_sampling as sampling;
pub use lightshed_spatial as spatial;
pub use markov::{
    ApparentDistance, Discovery, Finding, MarkovChain, MarkovModel, MarkovOptions, MarkovState, OFFSET_WORDS,
    Proposal, SeenLobe, TargetLobe, neighbour_offset,
};
pub use model::DirectionalModel;
pub use options::{FieldOptions, Interpolation};
pub use partition::Partition;
pub use passage::{FlightArrival, FlightEnd, Visit};
pub use places::{MAX_PLACES, PlaceBlock, PlaceDirections, PlaceModel, PlaceOptions};
pub use quadtree::{
    CompressedQuadtree, MAX_PRODUCT_BITS, MAX_QUADTREE_BITS, MAX_QUADTREE_DEPTH, QuadtreeCell, QuadtreeGoal,
    QuadtreeModel, QuadtreeOptions, QuadtreeProduct, SeenQuadtree,
};
pub use sample::{GuidingSample, TrainingSample};
pub use saved::SavedField;
pub use vmf::{
    MAX_CONCENTRATION, MAX_LOBES, VmfFit, VmfFitOptions, VmfLobe, VmfMixture, VmfModel, VmfSample,
    concentration_of,
};
pub use weighted_tree::{
    WeightedDirections, WeightedNode, WeightedTree, WeightedTreeModel, WeightedTreeOptions,
};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guiding.md")]
struct Guide;

/// The guide to light caches is included, too.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/light_cache.md")]
struct LightCacheGuide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
