//! The passes that change the tree (§5.6.2): mark, rebuild, augment.

use super::augmented::{Augmented, Correspondence, NO_LEAF};
use super::error::OctreeError;
use super::node::OctreeNode;
use super::options::OctreeOptions;
use super::tree::AdaptiveOctree;

/// The origin of a node of the new tree.
#[derive(Clone, Copy)]
enum Origin {
    Node(u32),
    Leaf(u32),
}

impl AdaptiveOctree {
    /// Splits each leaf with more samples than [`OctreeOptions::split_above`], and joins eight
    /// leaves of one parent that have fewer together than [`OctreeOptions::collapse_below`]; by one
    /// level at a time. `counts` are the samples of each slot. Returns whether anything was split
    /// or joined.
    ///
    /// The new tree's nodes are in breadth-first order again after any change. The cost is
    /// `O(nodes)`.
    ///
    /// # Errors
    /// Options out of range, a wrong number of counts, or too many nodes; the tree is then
    /// unchanged.
    pub fn adapt(&mut self, counts: &[u32], options: &OctreeOptions) -> Result<bool, OctreeError> {
        options.check()?;
        if counts.len() != self.slot_count() {
            return Err(OctreeError::Counts {
                counts: counts.len(),
                slots: self.slot_count(),
            });
        }
        let (mut nodes, mut changed) = (Vec::with_capacity(self.nodes.len()), false);
        let mut augmented = Augmented {
            correspondences: Vec::with_capacity(counts.len()),
            ..Augmented::of_root()
        };
        augmented.correspondences.clear();
        let mut origins = vec![Origin::Node(0)];
        // Nodes are appended to the queue as their parents are visited: breadth first.
        let mut index = 0;
        while index < origins.len() {
            let depth = augmented.depths[index];
            let first_inner = origins.len() as u32;
            let mut leaf_mask = 0u8;
            for child in 0..8 {
                let of_child = self.rebuilt(origins[index], child, u32::from(depth), counts, options);
                let slot = 8 * index as u32 + child;
                match of_child {
                    Rebuilt::Leaf(was) => {
                        leaf_mask |= 1 << child;
                        changed |= matches!(was, Correspondence::Joined(_));
                        augmented.correspondences.push(was.encode());
                    }
                    Rebuilt::Inner(origin) => {
                        changed |= matches!(origin, Origin::Leaf(_));
                        if origins.len() >= options.max_nodes {
                            return Err(OctreeError::TooManyNodes(options.max_nodes));
                        }
                        origins.push(origin);
                        augmented.parents.push(slot);
                        augmented.depths.push(depth + 1);
                        augmented.correspondences.push(NO_LEAF);
                    }
                }
            }
            let is_inner = leaf_mask != 0xff;
            nodes.push(OctreeNode::new(leaf_mask, if is_inner { first_inner } else { 0 }));
            index += 1;
        }
        (self.nodes, self.augmented) = (nodes, augmented);
        Ok(changed)
    }

    /// The origin of child number `child` of a node at `depth` with the origin `origin`.
    fn rebuilt(
        &self,
        origin: Origin,
        child: u32,
        depth: u32,
        counts: &[u32],
        options: &OctreeOptions,
    ) -> Rebuilt {
        let node = match origin {
            Origin::Leaf(slot) => return Rebuilt::Leaf(Correspondence::PartOf(slot)),
            Origin::Node(node) => node,
        };
        let (inner, slot) = (self.nodes[node as usize], 8 * node + child);
        if inner.is_leaf(child) {
            // The leaf's depth is one more than its parent's.
            let is_split = counts[slot as usize] > options.split_above && depth + 1 < options.max_depth;
            return match is_split {
                true => Rebuilt::Inner(Origin::Leaf(slot)),
                false => Rebuilt::Leaf(Correspondence::Same(slot)),
            };
        }
        let below = inner.inner(child);
        if self.nodes[below as usize].leaf_mask() == 0xff {
            let first = 8 * below as usize;
            let parts = &counts[first..first + 8];
            let together: u64 = parts.iter().map(|&count| u64::from(count)).sum();
            if together < u64::from(options.collapse_below) {
                // The first of the children with most samples.
                let largest = (0..8).rev().max_by_key(|&part| parts[part]).unwrap_or(0);
                return Rebuilt::Leaf(Correspondence::Joined((first + largest) as u32));
            }
        }
        Rebuilt::Inner(Origin::Node(below))
    }
}

/// A child in the new tree.
enum Rebuilt {
    Leaf(Correspondence),
    Inner(Origin),
}
