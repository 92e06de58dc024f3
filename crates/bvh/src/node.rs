//! Nodes of a binary tree.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lightshed_spatial::Bounds;

/// A node: a box, and a range of the tree's primitives in the order of its leaves.
///
/// Nodes lie in depth-first order, and a tree over `n` primitives has `2n − 1` of them, so
/// children need no references: the first child of node `i` is node `i + 1`, and the second is node
/// `i + 2 c`, with `c` the first child's count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Node {
    /// Least corner.
    pub min: Vec3,
    /// Place of the first primitive below, in the order of the leaves.
    pub first: u32,
    /// Greatest corner.
    pub max: Vec3,
    /// Primitives below; 1 for a leaf.
    pub count: u32,
}

const _: () = assert!(size_of::<Node>() == 32);

impl Node {
    /// The box.
    #[inline(always)]
    pub fn bounds(&self) -> Bounds {
        Bounds::new(self.min, self.max)
    }

    /// Whether this is a single primitive.
    #[inline(always)]
    pub fn is_leaf(&self) -> bool {
        self.count == 1
    }
}
