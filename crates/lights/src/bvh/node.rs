//! Nodes as a light BVH stores them.

use crate::block::{NodeBlock, WIDTH};

/// Up to eight children: their nodes, and what is below each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub(super) struct WideNode {
    pub nodes: NodeBlock,
    /// A block, or a light with [`LEAF`] set.
    pub children: [u32; WIDTH],
}

/// Marks a child that is a light.
pub(super) const LEAF: u32 = 1 << 31;
/// In place of a light's leaf.
pub(super) const NO_LEAF: u32 = u32::MAX;
