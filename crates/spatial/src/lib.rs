//! Spatial orders and indices: orders along curves, sorts, sparse grids, neighbour search, indices
//! of surface sites.
//!
//! The crate uses only points and boxes. Lights, cached radiance and reservoirs are stored by the
//! crates above. Positions are in any unit of length, the same for all.
//!
//! | you want | take | exactness |
//! |---|---|---|
//! | boxes | [`Bounds`] | `f32` |
//! | an order in which neighbours stay near | [`CurveOrder`], [`Curve`], [`CurveCube`] | integers; cells found in `f64` |
//! | Morton codes | [`morton63_encode`], [`morton63_decode`], [`morton30_encode`], [`morton30_decode`] | integers |
//! | a stable sort by 30-bit keys | [`sort_by_key`], [`KeyedIndex`] | integers |
//! | a grid of cubic cells | [`CubicGrid`] | `f64` |
//! | the occupied places of a grid, and who is in them | [`SparseGrid`], [`CellRanges`] | integers |
//! | the finest grid with few occupied cells | [`finest_bits_below`] | integers |
//! | room for the next build | [`ensure_capacity`] | |
//! | points near a point | [`PointGrid`] | none is missed |
//! | the nearest few of many surface sites | [`SiteTree`], [`SiteGrid`] with a [`SiteMetric`] | as a look at every one |
//! | leaves that follow the samples | [`AdaptiveOctree`], [`OctreeNeighbours`] | cells found in `f32`, the rest integers |
//! | their limits | [`MAX_OCTREE_DEPTH`], [`MAX_OCTREE_NODES`] | |
//! | cells that grow with distance, apart by normal, in a table of bounded size | [`LevelGrid`], [`CellTable`], [`HashGrid`] | cells found in `f64`, the rest integers |
//! | the cell of a surface point | [`SpatialIndex`], [`SurfaceSite`] | |
//!
//! # Features
//!
//! - `parallel`: encodes and sorts over a rayon pool. Same result, bit for bit.
#![forbid(unsafe_code)]

mod bounds;
mod capacity;
mod cells;
mod cubic_grid;
mod curve;
mod hash_grid;
mod index;
mod morton;
mod nearest;
mod octree;
mod order;
mod point_grid;
mod radix;
mod site_grid;
mod site_tree;
mod sparse_grid;

pub use bounds::Bounds;
pub use capacity::ensure_capacity;
pub use cells::{CellRanges, finest_bits_below};
pub use cubic_grid::{CubicGrid, KEY_BITS};
pub use curve::{CellLanes, Curve, CurveCube};
pub use glam;
pub use hash_grid::{CellKey, CellTable, HashGrid, HashGridError, LevelGrid, LevelGridOptions, Occupancy};
pub use index::{SpatialIndex, SurfaceSite};
pub use lightshed_lanes as lanes;
pub use morton::{morton30_decode, morton30_encode, morton63_decode, morton63_encode};
pub use nearest::{Nearest, NearestSites, Neighbour, SiteMetric};
pub use octree::{
    AdaptiveOctree, Correspondence, MAX_OCTREE_DEPTH, MAX_OCTREE_NODES, OctreeCell, OctreeError,
    OctreeNeighbours, OctreeNode, OctreeOptions,
};
pub use order::{CurveOrder, SortedIndices};
pub use point_grid::{PointGrid, PointGridError};
pub use radix::{KeyedIndex, sort_by_key};
pub use site_grid::SiteGrid;
pub use site_tree::{SiteTree, SiteTreeError};
pub use sparse_grid::{SparseGrid, SparseRow, for_each_row_within};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/spatial.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
