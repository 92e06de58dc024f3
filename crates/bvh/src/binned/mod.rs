//! Top-down by the surface area heuristic, among the planes between equal bins.
//!
//! Wald 2007, *On fast Construction of SAH-based Bounding Volume Hierarchies*: 16 bins along each
//! of three axes. Three passes over a group's items divide it: boxes, bins, and the move to both
//! sides, from the items to where the group's nodes will be, or back at the next level: the nodes'
//! memory is the only other buffer. Large groups are taken in chunks, on all threads; what is
//! computed are minima and counts, so that the tree is the same for any number of them. Groups of
//! up to eight are left to [`treelet`](crate::treelet).

mod bins;
mod group;
mod partition;
mod together;

pub use group::{Group, HALVE_FROM, Room, Task, WAITING, build_alone};

/// Bins along each axis.
const BINS: usize = 16;
