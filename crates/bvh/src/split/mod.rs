//! Builders over any split cost.
//!
//! A [`SplitSource`] divides a group of items in two. The caller decides what to build from that: a
//! binary tree ([`split_tree`]) or the children of wide nodes ([`SplitGroups`]). Costs are an
//! [`Extent`]: the surface area here, the surface area and orientation heuristic in light trees.

mod agglomerative;
mod along_curve;
mod area;
mod binary;
mod binned;
mod extent;
mod group;

pub use agglomerative::{MergedTree, Merges};
pub use along_curve::{AlongCurve, Pyramid};
pub use area::{AreaExtent, AreaItem};
pub use binary::split_tree;
pub use binned::Binned;
pub use extent::{Extent, SplitItem};
pub use group::{SplitGroup, SplitGroups, SplitSource};
