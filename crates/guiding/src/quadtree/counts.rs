//! Trees as counts: what a descent reads, without rank and select.
//!
//! Inner nodes in depth-first order, a word each: byte `q` is the number of inner nodes in the
//! subtree of quarter `q`, 0 for a leaf. A subtree of `m` inner nodes has `1 + 3 m` leaves. The
//! first inner node of a quarter follows its parent and the subtrees of the quarters before it, so
//! a node needs no pointer.

use super::bits::{MAX_INNER, MAX_QUADTREE_DEPTH, inner_count};

/// Words of the counts of a tree of so many words.
#[inline(always)]
pub(super) fn count_words(tree_words: usize) -> usize {
    8 * tree_words
}

/// Writes the counts of a tree.
pub(super) fn count(words: &[u32], counts: &mut [u32]) {
    let inner = inner_count(words) as usize;
    let nibble = |number: usize| words[number / 8] >> (4 * (number % 8)) & 15;
    // Inner nodes in each subtree, and the first inner node among the children, breadth first:
    // children follow their parents, those of the last node last.
    let (mut sizes, mut first) = ([1u32; MAX_INNER], [0usize; MAX_INNER]);
    let mut start = inner;
    for number in (0..inner).rev() {
        let children = nibble(number).count_ones() as usize;
        start -= children;
        first[number] = start;
        sizes[number] += sizes[start..start + children].iter().sum::<u32>();
    }
    let mut places = [0usize; MAX_INNER];
    for number in 0..inner {
        let (mut child, mut next, mut word) = (first[number], places[number] + 1, 0);
        for quarter in (0..4).filter(|quarter| nibble(number) >> quarter & 1 != 0) {
            word |= sizes[child] << (8 * quarter);
            places[child] = next;
            next += sizes[child] as usize;
            child += 1;
        }
        counts[places[number]] = word;
    }
}

/// Inner nodes in the subtree of a quarter of a node.
#[inline(always)]
pub(super) fn count_of(node: u32, quarter: u32) -> u32 {
    node >> (8 * quarter) & 255
}

/// How far behind a node that of its quarter is.
#[inline(always)]
pub(super) fn step_to(node: u32, quarter: u32) -> usize {
    // Byte `q` of the product is the sum of the bytes below it: at most 255 in all.
    1 + (node.wrapping_mul(0x0101_0100) >> (8 * quarter) & 255) as usize
}

/// Depth of the leaf that has a point of the square by its Morton code.
#[inline(always)]
pub(super) fn depth_at(counts: &[u32], code: u32) -> u32 {
    let (mut inner, mut depth, mut code) = (0, 0, code);
    loop {
        let (node, quarter) = (counts[inner], code >> 30);
        depth += 1;
        if count_of(node, quarter) == 0 || depth == MAX_QUADTREE_DEPTH {
            return depth;
        }
        inner += step_to(node, quarter);
        code <<= 2;
    }
}
