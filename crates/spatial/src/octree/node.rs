//! The inner node.

use bytemuck::{Pod, Zeroable};

/// Largest number of inner nodes of an octree: 24 bits can distinguish as many.
pub const MAX_OCTREE_NODES: usize = 1 << 24;

/// Largest depth of a leaf: cells of 2⁻²⁰ of the cube's side are about the resolution of `f32`
/// positions.
pub const MAX_OCTREE_DEPTH: u32 = 20;

/// An inner node in 32 bits, as a device reads it. Bit `c` of the low eight says that child `c` is
/// a leaf. The other bits hold the number of the first child that is an inner node. The inner
/// children are stored one after the other, without gaps.
///
/// Bit 0 of a child's number is its half along x, bit 1 along y, bit 2 along z. Leaves have no
/// node: leaf `c` of node `n` has the slot `8 n + c`.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct OctreeNode(u32);

/// Ones of the numbers below 128.
static ONES: [u8; 128] = {
    let mut ones = [0; 128];
    let mut number = 1;
    while number < 128 {
        ones[number] = ones[number / 2] + (number % 2) as u8;
        number += 1;
    }
    ones
};

impl OctreeNode {
    /// A node of eight leaves.
    pub(super) const LEAVES: Self = Self(0xff);

    /// From its parts; `first_inner` has 24 bits.
    #[inline(always)]
    pub(super) fn new(leaf_mask: u8, first_inner: u32) -> Self {
        Self(first_inner << 8 | u32::from(leaf_mask))
    }

    /// Which children are leaves, bit `c` for child `c`.
    #[inline(always)]
    pub fn leaf_mask(self) -> u8 {
        self.0 as u8
    }

    /// Whether a child (0 to 7) is a leaf.
    #[inline(always)]
    pub fn is_leaf(self, child: u32) -> bool {
        self.0 >> child & 1 != 0
    }

    /// Number of the first inner child. Meaningless for a node with eight leaves.
    #[inline(always)]
    pub fn first_inner(self) -> u32 {
        self.0 >> 8
    }

    /// Number of a child that is an inner node.
    #[inline(always)]
    pub fn inner(self, child: u32) -> u32 {
        let before = !self.0 & 0xff & ((1 << child) - 1);
        // Of at most seven bits, without an instruction that not all processors have.
        self.first_inner() + u32::from(ONES[before as usize % ONES.len()])
    }
}
