//! Counts of upper trees.

use crate::node::Node;

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
