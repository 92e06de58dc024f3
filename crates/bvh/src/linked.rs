//! From joined groups and marked leaves to depth-first order.

use crate::item::BoxItem;
use crate::node::Node;

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
