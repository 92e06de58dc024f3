//! The warp from the root down.

use super::bits::{MAX_QUADTREE_DEPTH, inner_count};
use super::counts::{count_of, step_to};
use glam::Vec2;
use lightshed_sampling::ONE_MINUS_EPSILON;

/// A leaf that was chosen, and the place in it.
pub(super) struct Chosen {
    /// Point of the unit square.
    pub square: Vec2,
    /// Depth of the leaf, from 1.
    pub depth: u32,
    /// Least Morton code in the leaf.
    pub code: u32,
}

impl Chosen {
    /// The point `u` of the leaf at `place` among those of its depth.
    #[inline(always)]
    fn new(place: [u32; 2], u: [f32; 2], depth: u32, code: u32) -> Self {
        // A power of two from its exponent.
        let side = f32::from_bits((127 - depth) << 23);
        let corner = Vec2::new(place[0] as f32, place[1] as f32);
        let square = (corner + Vec2::from(u)) * side;
        Self { square, depth, code }
    }
}

/// Maps `u` in [0, 1)² to the point of the unit square whose density is the tree's. `INNER` is
/// more than the number of inner nodes.
///
/// A quarter of a node is selected with the probability of its share of the node's leaves: first
/// the half along v, then that along u within it. The rest of each number continues to the quarter.
#[inline]
pub(super) fn descend<const INNER: usize>(words: &[u32], u: [f32; 2]) -> Chosen {
    // `first[k]` is the first inner node among the children of k, `behind[k]` thrice the sum over
    // levels of how many inner nodes are not before the first descendant of k. Descendants of a
    // node follow each other on each level, so `(behind[k] − behind[k + 1]) / 3` inner nodes are in
    // the subtree of k. Children are stored after their parents, those of the last node last.
    let (mut behind, mut first) = ([0f32; INNER], [0u16; INNER]);
    let count = (inner_count(words) as usize).min(INNER - 1);
    let (mut start, mut number) = (count, count);
    for word in words.iter().rev() {
        for nibble in (0..8).rev() {
            number = number.saturating_sub(1);
            start = start.saturating_sub(ones_of_four(word >> (4 * nibble) & 15));
            first[number % INNER] = start as u16;
            behind[number % INNER] = 3.0 * (count - number) as f32 + behind[start % INNER];
        }
    }
    let [mut u, mut v] = u;
    let (mut place, mut depth, mut inner, mut code) = ([0u32; 2], 0, 0usize, 0u32);
    loop {
        let bits = words[inner / 8] >> (4 * (inner % 8)) & 15;
        let start = usize::from(first[inner % INNER]);
        let mut next = start;
        let bounds = [1, 2, 4, 8].map(|quarter| {
            let bound = behind[next % INNER];
            next += usize::from(bits & quarter != 0);
            bound
        });
        // Each inner node has three leaves more than the leaf in whose place it is.
        let [a, b, c, d] = bounds;
        let (a, b, c, d) = (
            1.0 + (a - b),
            1.0 + (b - c),
            1.0 + (c - d),
            1.0 + (d - behind[next % INNER]),
        );
        let (y, rest) = choose(a + b, c + d, v);
        v = rest;
        let x;
        (x, u) = choose(pick(y, a, c), pick(y, b, d), u);
        depth += 1;
        place = [2 * place[0] + x, 2 * place[1] + y];
        let quarter = x + 2 * y;
        code |= quarter << (32 - 2 * depth);
        if bits >> quarter & 1 == 0 {
            return Chosen::new(place, [u, v], depth, code);
        }
        inner = start + ones_of_four(bits & ((1 << quarter) - 1));
    }
}

/// [`descend`] by the tree's counts: the same bits. The bits themselves are the plain way, which
/// has to count first.
#[inline]
pub(super) fn descend_counts(counts: &[u32], u: [f32; 2]) -> Chosen {
    let [mut u, mut v] = u;
    let (mut place, mut depth, mut inner, mut code) = ([0u32; 2], 0, 0usize, 0u32);
    loop {
        let node = counts[inner];
        let [a, b, c, d] = [0, 1, 2, 3].map(|quarter| (1 + 3 * count_of(node, quarter)) as f32);
        let (y, rest) = choose(a + b, c + d, v);
        v = rest;
        let x;
        (x, u) = choose(pick(y, a, c), pick(y, b, d), u);
        depth += 1;
        place = [2 * place[0] + x, 2 * place[1] + y];
        let quarter = x + 2 * y;
        code |= quarter << (32 - 2 * depth);
        if count_of(node, quarter) == 0 || depth == MAX_QUADTREE_DEPTH {
            return Chosen::new(place, [u, v], depth, code);
        }
        inner += step_to(node, quarter);
    }
}

/// Ones of a number below 16.
#[inline(always)]
fn ones_of_four(bits: u32) -> usize {
    (0x4332_3221_3221_2110u64 >> (4 * bits) & 15) as usize
}

/// The second of two numbers for 1, the first for 0: no branch, because nothing foretells it.
#[inline(always)]
fn pick(which: u32, first: f32, second: f32) -> f32 {
    let [first, second] = [first, second].map(f32::to_bits);
    f32::from_bits(first ^ (first ^ second) & which.wrapping_neg())
}

/// Selects between two numbers of leaves in proportion; the rest of the number is its position
/// within the selected part.
#[inline(always)]
fn choose(low: f32, high: f32, u: f32) -> (u32, f32) {
    let scaled = u * (low + high);
    let is_high = u32::from(scaled >= low);
    let rest = (scaled - pick(is_high, 0.0, low)) * (1.0 / pick(is_high, low, high));
    (is_high, rest.min(ONE_MINUS_EPSILON))
}
