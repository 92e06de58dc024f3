//! Top-down by the surface area heuristic, with planes between equal bins.
//!
//! Wald 2007, *On fast Construction of SAH-based Bounding Volume Hierarchies*: 16 bins along each
//! of three axes. Three passes over a group's items divide it: boxes, bins, and the move to both
//! sides. The move goes from the items to the place of the group's nodes, and back at the next
//! level: the nodes' memory is the only other buffer. Large groups are taken in chunks, on all
//! threads. Only minima and counts are computed, so the tree is the same for any number of threads.
//! Groups of up to eight are left to [`treelet`](crate::treelet).

mod bins;
mod group;
mod partition;
mod together;

pub use group::{Group, HALVE_FROM, Room, Task, WAITING, build_alone};

/// Bins along each axis.
const BINS: usize = 16;
