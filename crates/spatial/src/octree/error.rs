//! Errors of an octree.

use super::node::MAX_OCTREE_NODES;
use std::fmt;

/// Why an octree cannot be made or changed. It is then unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum OctreeError {
    /// The box to be covered is empty or not finite, or the cube around it is.
    Bounds,
    /// Leaves would be split from this many samples on, but joined below this larger number, so
    /// they would alternate.
    Thresholds {
        /// Leaves with more samples are split.
        split_above: u32,
        /// Leaves that together have fewer are joined.
        collapse_below: u32,
    },
    /// The largest depth is not in 1 to 20.
    Depth(u32),
    /// The largest number of nodes is not in 1 to 2²⁴.
    NodeLimit(usize),
    /// There must be a count for each slot, but there are `counts` for `slots`.
    Counts {
        /// Counts given.
        counts: usize,
        /// Slots of the tree.
        slots: usize,
    },
    /// The changed tree would have more inner nodes than this, its limit.
    TooManyNodes(usize),
    /// Saved nodes do not form a tree.
    Damaged,
}

impl fmt::Display for OctreeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bounds => write!(f, "the box must be finite, with some extent"),
            Self::Thresholds {
                split_above,
                collapse_below,
            } => write!(
                f,
                "leaves of more than {split_above} samples are split, so fewer than {collapse_below} cannot be joined"
            ),
            Self::Depth(depth) => write!(f, "a largest depth of {depth}: it must be in 1..=20"),
            Self::NodeLimit(limit) => {
                write!(
                    f,
                    "a limit of {limit} nodes: it must be in 1..={MAX_OCTREE_NODES}"
                )
            }
            Self::Counts { counts, slots } => write!(f, "{counts} counts for {slots} slots"),
            Self::TooManyNodes(limit) => write!(f, "the octree would have more than {limit} inner nodes"),
            Self::Damaged => write!(f, "the nodes are not those of an octree"),
        }
    }
}

impl std::error::Error for OctreeError {}
