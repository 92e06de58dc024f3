//! When leaves are split and joined.

use super::error::OctreeError;
use super::node::{MAX_OCTREE_DEPTH, MAX_OCTREE_NODES};

/// When leaves are split and joined.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OctreeOptions {
    /// A leaf with more samples is split.
    pub split_above: u32,
    /// Eight leaves of one parent that have fewer samples together become one; at most
    /// [`split_above`](Self::split_above).
    pub collapse_below: u32,
    /// Largest depth of a leaf; the children of the root have depth 1.
    pub max_depth: u32,
    /// Most inner nodes.
    pub max_nodes: usize,
}

impl Default for OctreeOptions {
    /// Split above 2,048 samples, join below 1,024; depth and node count up to the limits of the
    /// layout.
    fn default() -> Self {
        Self {
            split_above: 2048,
            collapse_below: 1024,
            max_depth: MAX_OCTREE_DEPTH,
            max_nodes: MAX_OCTREE_NODES,
        }
    }
}

impl OctreeOptions {
    /// Whether a tree can satisfy them.
    ///
    /// # Errors
    /// The option that is out of its range.
    pub fn check(&self) -> Result<(), OctreeError> {
        if self.collapse_below > self.split_above {
            return Err(OctreeError::Thresholds {
                split_above: self.split_above,
                collapse_below: self.collapse_below,
            });
        }
        if !(1..=MAX_OCTREE_DEPTH).contains(&self.max_depth) {
            return Err(OctreeError::Depth(self.max_depth));
        }
        if !(1..=MAX_OCTREE_NODES).contains(&self.max_nodes) {
            return Err(OctreeError::NodeLimit(self.max_nodes));
        }
        Ok(())
    }
}
