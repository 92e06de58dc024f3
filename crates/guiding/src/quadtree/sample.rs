//! The warp from the root down.

use super::bits::{MAX_QUADTREE_BITS, inner_count};
use glam::Vec2;
use lightshed_sampling::ONE_MINUS_EPSILON;

/// More than the number of leaves: a power of two, so that a remainder costs nothing.
const LEAVES: usize = (3 * MAX_QUADTREE_BITS as usize / 4 + 2).next_power_of_two();

/// `1/n`.
static RECIPROCALS: [f32; LEAVES] = {
    let mut table = [1.0; LEAVES];
    let mut n = 2;
    while n < LEAVES {
        table[n] = 1.0 / n as f32;
        n += 1;
    }
    table
};

/// A leaf that was chosen, and the place in it.
pub(super) struct Chosen {
    /// Point of the unit square.
    pub square: Vec2,
    /// Depth of the leaf, from 1.
    pub depth: u32,
    /// Least Morton code in the leaf.
    pub code: u32,
}

/// Maps `u` in [0, 1)² to the point of the unit square whose density is the tree's. `INNER` is
/// more than the number of inner nodes.
///
/// A quarter of a node is selected with the probability of its share of the node's leaves: first
/// the half along v, then that along u within it. The rest of each number continues to the quarter.
#[inline]
pub(super) fn descend<const INNER: usize>(words: &[u32], u: [f32; 2]) -> Chosen {
    // `behind[k]` are the leaves below inner nodes from number k on, `first[k]` is the first inner
    // node among the children of k. Children are stored after their parents, those of the last node
    // last: from the back, the children of each are the next ones.
    let (mut behind, mut first) = ([0u16; INNER], [0u16; INNER]);
    let count = (inner_count(words) as usize).min(INNER - 1);
    let mut next = count;
    let mut sum = 0;
    let mut number = count;
    for word in words.iter().rev() {
        for nibble in (0..8).rev() {
            number = number.saturating_sub(1);
            let children = ones_of_four(word >> (4 * nibble) & 15);
            let start = next.saturating_sub(children);
            sum += 4 - children as u16 + behind[start % INNER] - behind[next % INNER];
            behind[number % INNER] = sum;
            first[number % INNER] = start as u16;
            next = start;
        }
    }
    let [mut u, mut v] = u;
    let (mut place, mut depth, mut inner, mut code) = ([0u32; 2], 0, 0usize, 0u32);
    loop {
        let bits = words[inner / 8] >> (4 * (inner % 8)) & 15;
        let start = usize::from(first[inner % INNER]);
        let mut child = start;
        let mut below = [1u16; 4];
        for (quarter, below) in below.iter_mut().enumerate() {
            let is_inner = bits >> quarter & 1;
            let leaves = behind[child % INNER] - behind[(child + 1) % INNER];
            *below = if is_inner != 0 { leaves } else { 1 };
            child += is_inner as usize;
        }
        // Both halves choose, so that nothing waits for the choice between them.
        let [a, b, c, d] = below;
        let (lower, upper) = (choose(a, b, u), choose(c, d, u));
        let (y, rest) = choose(a + b, c + d, v);
        v = rest;
        let x;
        (x, u) = if y != 0 { upper } else { lower };
        depth += 1;
        place = [2 * place[0] + x as u32, 2 * place[1] + y as u32];
        let quarter = x + 2 * y;
        code |= (quarter as u32) << (32 - 2 * depth);
        if bits >> quarter & 1 == 0 {
            // A power of two from its exponent.
            let side = f32::from_bits((127 - depth) << 23);
            let corner = Vec2::new(place[0] as f32, place[1] as f32);
            let square = (corner + Vec2::new(u, v)) * side;
            return Chosen { square, depth, code };
        }
        inner = start + ones_of_four(bits & ((1 << quarter) - 1));
    }
}

/// Ones of a number below 16.
#[inline(always)]
fn ones_of_four(bits: u32) -> usize {
    (0x4332_3221_3221_2110u64 >> (4 * bits) & 15) as usize
}

/// Selects between two numbers of leaves in proportion; the rest of the number is its position
/// within the selected part.
#[inline(always)]
fn choose(low: u16, high: u16, u: f32) -> (usize, f32) {
    let scaled = u * f32::from(low + high);
    let is_high = scaled >= f32::from(low);
    let (start, own) = if is_high { (low, high) } else { (0, low) };
    let rest = (scaled - f32::from(start)) * RECIPROCALS[usize::from(own) % LEAVES];
    (usize::from(is_high), rest.min(ONE_MINUS_EPSILON))
}
