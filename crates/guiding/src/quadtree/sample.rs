//! The warp from the root down.

use super::bits::inner_count;
use crate::square::choose_quarter;
use glam::Vec2;

/// Maps `u` in [0, 1)² to the point of the unit square whose density is the tree's. `INNER` is at least the number of inner nodes.
///
/// A quarter of a node is chosen with the probability of its share of the node's leaves: first the half along v, then that
/// along u within it. What is left of each number goes on to the quarter.
#[inline]
pub(super) fn descend<const INNER: usize>(words: &[u32], u: [f32; 2]) -> Vec2 {
    // Leaves below each inner node, and the first inner node among its children. Children stand behind their parents, those of the
    // last node last: from the back, the children of each are the next ones.
    let (mut leaves, mut first) = ([0u16; INNER], [0u16; INNER]);
    let count = (inner_count(words) as usize).min(INNER);
    let mut next = count;
    for (index, word) in words.iter().enumerate().rev() {
        for nibble in (0..8).rev() {
            let inner = 8 * index + nibble;
            let children = (word >> (4 * nibble) & 15).count_ones();
            let mut below = 4 - children as u16;
            for _ in 0..children {
                next = next.saturating_sub(1);
                below += leaves[next % INNER];
            }
            leaves[inner % INNER] = below;
            first[inner % INNER] = next as u16;
        }
    }
    let (mut corner, mut side, mut u) = (Vec2::ZERO, 1.0, u);
    let mut inner = 0;
    loop {
        let bits = words[inner / 8] >> (4 * (inner % 8)) & 15;
        let mut below = [1.0; 4];
        let mut child = usize::from(first[inner % INNER]);
        let mut children = [0; 4];
        for quarter in 0..4 {
            if bits >> quarter & 1 != 0 {
                below[quarter] = f32::from(leaves[child % INNER]);
                children[quarter] = child;
                child += 1;
            }
        }
        let quarter = choose_quarter(below, &mut u);
        side *= 0.5;
        corner += side * Vec2::new((quarter & 1) as f32, (quarter >> 1) as f32);
        if bits >> quarter & 1 == 0 {
            return corner + side * Vec2::from(u);
        }
        inner = children[quarter];
    }
}
