//! Bounding volume hierarchies, built fast.
//!
//! The crate knows boxes, and nothing of their contents: the same code builds trees over triangles,
//! instances and lights. A tree is binary, has one primitive in each leaf, and is stored in
//! depth-first order ([`Node`]); a program that traverses wide trees makes them from it.
//!
//! | you want | take |
//! |---|---|
//! | a tree | [`Bvh::build`] with a [`Method`] or a [`Preset`] |
//! | trees again and again, in the same memory | [`Builder`] |
//! | the preset for a number of rays | [`Preset::for_rays`] |
//! | what lies near a point | [`Bvh::for_each_near`] |
//! | the same tree for moved primitives, and whether that is good enough | [`Bvh::refit`] |
//! | a better tree out of a tree | [`Bvh::reinsert`] |
//! | copies of objects | [`InstanceTree`] |
//! | another split cost than surface area, or a wide tree by it | [`Extent`], [`SplitSource`], [`split_tree`], [`SplitGroups`] |
//! | surface area as a split cost | [`AreaExtent`] of [`AreaItem`]s |
//! | a subset of primitives in proportion to weights | [`sample`] with [`Sampling`], [`WeightHistogram`], [`stratum_beside_uniform`] |
//! | trees of `obvhs` | `Bvh::to_obvhs_bvh2`, `Bvh::to_obvhs_cwbvh` with the feature `obvhs` |
//!
//! ```
//! use lightshed_bvh::glam::Vec3;
//! use lightshed_bvh::{Bvh, Preset, Ray};
//!
//! let triangle = |z: f32| [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z), Vec3::new(0.0, 1.0, z)];
//! let triangles = [triangle(2.0), triangle(5.0), triangle(1.0)];
//! let tree = Bvh::build(&triangles, Preset::Best.options())?;
//! let ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: f32::INFINITY };
//! // These triangles lie across the ray: it meets each in its plane.
//! let hit = tree.nearest(&ray, |index, _| Some(triangles[index as usize][0].z));
//! assert_eq!(hit, Some((2, 1.0)));
//! # Ok::<(), lightshed_bvh::BuildError>(())
//! ```
//!
//! # What is not a box
//!
//! A primitive with a box that is not finite, or with its corners exchanged, is an error that names
//! it. Equal boxes, boxes without extent, and coordinates of any size are allowed; trees have at
//! most [`MAX_DEPTH`] levels.
//!
//! # Features
//!
//! - `parallel`: builds on a rayon pool. The tree is the same, bit for bit.
//! - `obvhs`: trees of that crate.
#![forbid(unsafe_code)]
// Kernels loop over axes and lanes by index: iterator adaptors are not inlined into them (see the
// crate `lightshed-lanes`).
#![allow(clippy::needless_range_loop)]

mod binned;
mod build;
mod clusters;
mod counts;
mod curve;
mod error;
mod instances;
mod interior;
mod item;
mod morton;
mod near;
mod node;
#[cfg(feature = "obvhs")]
mod obvhs_trees;
mod options;
mod paired;
mod ploc;
mod preset;
mod primitive;
mod refit;
mod reinsertion;
mod source;
mod split;
mod subset;
mod sweep;
mod traverse;
mod tree;
mod treelet;
mod twins;

pub use build::Builder;
pub use clusters::{Clustered, Clusters};
pub use error::BuildError;
pub use glam;
pub use instances::{Instance, InstanceTree};
pub use interior::Interior;
pub use lightshed_spatial::Bounds;
pub use node::Node;
#[cfg(feature = "obvhs")]
pub use obvhs;
pub use options::{BuildOptions, Method};
pub use preset::Preset;
pub use primitive::{MAX_PRIMITIVES, Primitive};
pub use refit::Refit;
pub use reinsertion::Reinsertion;
pub use split::{
    AlongCurve, AreaExtent, AreaItem, Binned, Extent, MergedTree, Merges, Pyramid, SplitGroup, SplitGroups,
    SplitItem, SplitSource, split_tree,
};
pub use subset::{Insertion, Sampling, SubsetOptions, WeightHistogram, sample, stratum_beside_uniform};
pub use traverse::{MAX_DEPTH, Ray};
pub use tree::{Bvh, TreeFault};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/bvh.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
