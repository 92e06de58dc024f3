//! Trees whose nodes know their parents and children, and the way back to depth-first order.

use crate::item::BoxItem;
use crate::node::Node;
use crate::tree::{Bvh, children};

/// In place of a node.
pub const NONE: u32 = u32::MAX;

/// A tree that can be changed. Node 0 is the root; it has no parent.
pub struct Linked {
    pub boxes: Vec<BoxItem>,
    pub parents: Vec<u32>,
    /// [`NONE`] twice for a leaf.
    pub children: Vec<[u32; 2]>,
    /// The primitive of each leaf.
    pub primitives: Vec<u32>,
}

impl Linked {
    /// Of a tree, node by node.
    pub fn new(tree: &Bvh) -> Self {
        let count = tree.nodes.len();
        let mut linked = Self {
            boxes: Vec::with_capacity(count),
            parents: vec![NONE; count],
            children: Vec::with_capacity(count),
            primitives: Vec::with_capacity(count),
        };
        for (index, node) in tree.nodes.iter().enumerate() {
            linked.boxes.push(BoxItem::new(&node.bounds(), 0));
            let below = children(&tree.nodes, index).map(|both| both.map(|child| child as u32));
            for child in below.into_iter().flatten() {
                linked.parents[child as usize] = index as u32;
            }
            linked.children.push(below.unwrap_or([NONE; 2]));
            linked.primitives.push(tree.order[node.first as usize]);
        }
        linked
    }

    /// Whether a node is a leaf.
    #[inline(always)]
    pub fn is_leaf(&self, node: u32) -> bool {
        self.children[node as usize][0] == NONE
    }

    /// The other child of a node's parent; the node must not be the root.
    #[inline(always)]
    pub fn sibling(&self, node: u32) -> u32 {
        let [low, high] = self.children[self.parents[node as usize] as usize];
        if low == node { high } else { low }
    }

    /// Writes the tree in depth-first order.
    pub fn write(&self, tree: &mut Bvh) {
        let mut counts = vec![0; self.boxes.len()];
        // Parents before children: then backwards.
        let mut sequence = Vec::with_capacity(self.boxes.len());
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            sequence.push(node);
            if !self.is_leaf(node) {
                let [low, high] = self.children[node as usize];
                waiting.extend([high, low]);
            }
        }
        for &node in sequence.iter().rev() {
            counts[node as usize] = match self.children[node as usize] {
                [NONE, _] => 1,
                [low, high] => counts[low as usize] + counts[high as usize],
            };
        }
        let mut leaves = 0;
        for (cell, &node) in tree.nodes.iter_mut().zip(&sequence) {
            *cell = self.boxes[node as usize].node(leaves, counts[node as usize]);
            if self.is_leaf(node) {
                tree.order[leaves as usize] = self.primitives[node as usize];
                leaves += 1;
            }
        }
    }
}

/// The tree made of items by joining: item `i` is group `i`, and the group joined at step `k` is
/// group `n + k`.
#[derive(Clone, Debug, Default)]
pub struct Joined {
    pub parts: Vec<[u32; 2]>,
    pub boxes: Vec<BoxItem>,
    pub sizes: Vec<u32>,
}

impl Joined {
    /// Forgets all groups.
    pub fn clear(&mut self) {
        self.parts.clear();
        self.boxes.clear();
        self.sizes.clear();
    }

    /// Items of a group.
    #[inline(always)]
    pub fn size(&self, group: u32, items: usize) -> u32 {
        match (group as usize).checked_sub(items) {
            Some(joined) => self.sizes[joined],
            None => 1,
        }
    }

    /// Joins two groups and returns the new one.
    pub fn join(&mut self, low: u32, high: u32, union: BoxItem, items: usize) -> u32 {
        self.sizes.push(self.size(low, items) + self.size(high, items));
        self.parts.push([low, high]);
        self.boxes.push(union);
        (items + self.parts.len() - 1) as u32
    }

    /// Writes the tree in depth-first order: `2n − 1` cells and `n` indices. The last group is
    /// the root.
    pub fn write(&self, items: &[BoxItem], cells: &mut [BoxItem], order: &mut [u32], first: u32) {
        let count = items.len();
        let mut waiting = vec![(2 * count - 2) as u32];
        let (mut cell, mut leaf) = (0, 0);
        while let Some(group) = waiting.pop() {
            let place = first + leaf as u32;
            cells[cell] = match (group as usize).checked_sub(count) {
                Some(joined) => {
                    let [low, high] = self.parts[joined];
                    waiting.extend([high, low]);
                    self.boxes[joined].cell(place, self.sizes[joined])
                }
                None => {
                    let item = &items[group as usize];
                    order[leaf] = item.index();
                    leaf += 1;
                    item.cell(place, 1)
                }
            };
            cell += 1;
        }
    }
}

/// Puts the number of primitives below each node of an upper tree right, from the last node to the
/// root; leaves are marked by 1, others by 0.
pub fn count_below(nodes: &mut [Node]) {
    for index in (0..nodes.len()).rev() {
        if nodes[index].count == 0 {
            let low = nodes[index + 1].count;
            nodes[index].count = low + nodes[index + 2 * low as usize].count;
        }
    }
}
