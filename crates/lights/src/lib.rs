//! Selection among many lights: light trees, cuts, light BVHs and lighting grids.
//!
//! The crate knows no scene. A light is its [`Bounds`], its intensity and, if it does not emit in
//! all directions, an [`OrientationCone`]. A receiver is a position, a normal and a bound of its
//! reflectance ([`ShadingPoint`]). Positions are in any unit of length, the same for all.
//!
//! | you want | take |
//! |---|---|
//! | one light of many, by a tree | [`LightBvh`], [`PerfectTree`], [`TwoLevelTree`], each a [`LightSampler`]; [`OpenedTree`] around them |
//! | one light of many, without a tree | [`PowerLights`], [`UniformLights`] |
//! | cuts that several points share | [`Lightcut`], [`LightSubtrees`] |
//! | light of very many point lights | [`LightingGrid`] |
//! | lights checked before a tree is built | [`check_lights`] |
//! | a tree's leaves in memory | [`LightRecord`] |
//!
//! Equation numbers refer to Lin 2022 (*High-Quality Sampling for Complex Effects in Real-Time Ray
//! Tracing*, ch. 3 and 4).
//!
//! # Features
//!
//! - `parallel`: builds over a rayon pool. Same result, bit for bit.
#![forbid(unsafe_code)]

mod approximate;
mod block;
mod bvh;
mod child_cdf;
mod cone;
mod descent;
mod factored;
mod flat;
mod grid;
mod importance;
mod instance;
mod light;
mod lightcut;
mod normals;
mod opened;
mod perfect;
#[cfg(test)]
mod properties;
mod receiver;
mod sampler;
#[cfg(test)]
mod testing;
mod traversal;
mod tree;
mod tree_sampler;
mod two_level;
mod weighing;

pub use bvh::{BvhBuild, BvhLayout, LightBvh};
pub use cone::OrientationCone;
pub use factored::{FactorRow, FactoredStep};
pub use flat::{PowerLights, UniformLights};
pub use glam;
pub use grid::{
    BlendingFunctions, Construction, Gathered, GridChange, GridError, GridLight, GridOptions, GridQuery,
    Influence, Levels, LightId, LightingGrid, MAX_ALPHA, MAX_LEVELS, MAX_SHADOW_SAMPLES, PointLight,
    UpdateReport,
};
pub use importance::Weighting;
pub use instance::LightInstance;
pub use light::{Light, LightError, MAX_LIGHTS, check_lights};
pub use lightcut::{LightSubtrees, Lightcut};
pub use lightshed_lanes as lanes;
pub use lightshed_sampling as sampling;
pub use lightshed_spatial::{Bounds, Curve};
pub use opened::OpenedTree;
pub use perfect::{LightRecord, PerfectTree, PerfectTreeOptions, Stride, TreeLayout, TreeUpdate};
pub use receiver::{Facing, Gloss, RaySegment, SegmentError, ShadingPoint};
pub use sampler::{LightChoice, LightSampler};
pub use two_level::{TwoLevelError, TwoLevelTree};
pub use weighing::Receiver;

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/lighting-grid.md")]
struct GridGuide;

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/lights.md")]
struct Guide;

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/restir_di.md")]
struct RestirGuide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
