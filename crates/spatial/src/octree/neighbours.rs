//! Leaves that share faces.

use super::tree::{AdaptiveOctree, OctreeCell};

/// For each leaf of an octree the leaves that share a part of a face with it, on coarser and on
/// finer sides alike.
///
/// At each face, a leaf of depth `d` has either one neighbour that is not deeper, or any number of
/// deeper ones. The lists of all leaves are stored one after the other; their total length is twice
/// the number of touching pairs.
#[derive(Clone, Debug, Default)]
pub struct OctreeNeighbours {
    /// For each slot the start of its list, and the end of the last list.
    starts: Vec<u32>,
    slots: Vec<u32>,
}

impl OctreeNeighbours {
    /// Of all leaves of `tree`.
    pub fn new(tree: &AdaptiveOctree) -> Self {
        let mut found = Self::default();
        found.rebuild(tree);
        found
    }

    /// The same for another tree, with the memory of this one.
    pub fn rebuild(&mut self, tree: &AdaptiveOctree) {
        self.slots.clear();
        self.starts.clear();
        for slot in 0..tree.slot_count() as u32 {
            self.starts.push(self.slots.len() as u32);
            if tree.is_leaf(slot) {
                let cell = tree.cell(slot);
                for (axis, is_upper) in [
                    (0, false),
                    (0, true),
                    (1, false),
                    (1, true),
                    (2, false),
                    (2, true),
                ] {
                    self.at_face(tree, cell, axis, is_upper);
                }
            }
        }
        self.starts.push(self.slots.len() as u32);
    }

    /// The neighbours of a leaf, face by face: the lower and the upper one along x, then y, then z.
    #[inline]
    pub fn of(&self, slot: u32) -> &[u32] {
        match self.starts.get(slot as usize..slot as usize + 2) {
            Some(&[start, end]) => &self.slots[start as usize..end as usize],
            _ => &[],
        }
    }

    fn at_face(&mut self, tree: &AdaptiveOctree, cell: OctreeCell, axis: usize, is_upper: bool) {
        let mut beyond = cell;
        let coordinate = &mut beyond.coordinates[axis];
        let last = (1 << cell.depth) - 1;
        *coordinate = match (is_upper, *coordinate) {
            (true, c) if c < last => c + 1,
            (false, c) if c > 0 => c - 1,
            _ => return,
        };
        match tree.slot_of_cell(beyond) {
            (slot, true) => self.slots.push(slot),
            // Seen from there the face is the other one.
            (slot, false) => self.touching(tree, slot, axis, !is_upper),
        }
    }

    /// Leaves below an inner node's slot that touch one of its faces.
    fn touching(&mut self, tree: &AdaptiveOctree, slot: u32, axis: usize, is_upper: bool) {
        let node = tree.nodes()[slot as usize / 8].inner(slot % 8);
        let inner = tree.nodes()[node as usize];
        for child in (0..8).filter(|child| (child >> axis & 1 == 1) == is_upper) {
            let slot = 8 * node + child;
            match inner.is_leaf(child) {
                true => self.slots.push(slot),
                false => self.touching(tree, slot, axis, is_upper),
            }
        }
    }
}
