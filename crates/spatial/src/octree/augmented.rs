//! Data of nodes besides the path from the root.

use super::node::{MAX_OCTREE_DEPTH, MAX_OCTREE_NODES, OctreeNode};

/// The state of a leaf in the previous tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Correspondence {
    /// The same leaf, of this slot.
    Same(u32),
    /// A part of the leaf of this slot, which was split.
    PartOf(u32),
    /// Eight leaves that were joined; this slot is that of the leaf with most samples. The slots of
    /// all eight are those of its parent, `8 (slot / 8)` and the seven after it.
    Joined(u32),
}

/// Of slots that are no leaves.
pub(super) const NO_LEAF: u32 = u32::MAX;
/// Slots have 27 bits.
const KIND_SHIFT: u32 = 27;

impl Correspondence {
    /// The slot in the previous tree from which a leaf takes its record.
    #[inline(always)]
    pub fn slot(self) -> u32 {
        match self {
            Self::Same(slot) | Self::PartOf(slot) | Self::Joined(slot) => slot,
        }
    }

    pub(super) fn encode(self) -> u32 {
        match self {
            Self::Same(slot) => slot,
            Self::PartOf(slot) => slot | 1 << KIND_SHIFT,
            Self::Joined(slot) => slot | 2 << KIND_SHIFT,
        }
    }

    pub(super) fn decode(code: u32) -> Option<Self> {
        let slot = code & ((1 << KIND_SHIFT) - 1);
        match code >> KIND_SHIFT {
            0 => Some(Self::Same(slot)),
            1 => Some(Self::PartOf(slot)),
            2 => Some(Self::Joined(slot)),
            _ => None,
        }
    }
}

/// Data that traversals from the root do not need.
#[derive(Clone, Debug, Default)]
pub(super) struct Augmented {
    /// For each node its slot in its parent; 0 for the root.
    pub parents: Vec<u32>,
    /// For each node its depth; 0 for the root.
    pub depths: Vec<u8>,
    /// For each slot its state in the previous tree.
    pub correspondences: Vec<u32>,
}

impl Augmented {
    /// Of a root with eight leaves.
    pub fn of_root() -> Self {
        Self {
            parents: vec![0],
            depths: vec![0],
            correspondences: (0..8).map(|slot| Correspondence::Same(slot).encode()).collect(),
        }
    }

    /// From nodes in breadth-first order; each leaf corresponds to itself. `None` if they do not
    /// form a tree.
    pub fn of_nodes(nodes: &[OctreeNode]) -> Option<Self> {
        let mut augmented = Self {
            parents: vec![0],
            depths: vec![0],
            correspondences: Vec::with_capacity(8 * nodes.len()),
        };
        if nodes.len() > MAX_OCTREE_NODES {
            return None;
        }
        for (index, node) in nodes.iter().enumerate() {
            let depth = *augmented.depths.get(index)?;
            let is_placed = node.first_inner() as usize == augmented.parents.len();
            if node.leaf_mask() != 0xff && (!is_placed || u32::from(depth) + 2 > MAX_OCTREE_DEPTH) {
                return None;
            }
            for slot in 8 * index as u32..8 * index as u32 + 8 {
                if node.is_leaf(slot % 8) {
                    augmented
                        .correspondences
                        .push(Correspondence::Same(slot).encode());
                } else {
                    augmented.correspondences.push(NO_LEAF);
                    augmented.parents.push(slot);
                    augmented.depths.push(depth + 1);
                }
            }
        }
        (augmented.parents.len() == nodes.len()).then_some(augmented)
    }
}
