//! Trees as bits: rank, select, and validation.
//!
//! Nodes are stored in breadth-first order, one bit each, 1 for an inner node. The root is always
//! an inner node and has no bit; inner node number 0 is the root, and number `k` the `k`-th one
//! among the bits. Its four children are the bits `4 k` to `4 k + 3`, child `x + 2 y` of half `x`
//! along u and half `y` along v. Of `N` bits, a multiple of 32, `N/4 − 1` are ones and
//! `3 N/4 + 1` zeros: the leaves.

/// Largest number of bits of a quadtree.
pub const MAX_QUADTREE_BITS: u32 = 1024;
/// Largest depth of a leaf: side 2⁻¹⁴ of the octahedral square, some 10⁻⁴ radians.
pub const MAX_QUADTREE_DEPTH: u32 = 14;

/// Most inner nodes.
pub(super) const MAX_INNER: usize = MAX_QUADTREE_BITS as usize / 4;

/// Bit number `place`.
#[inline(always)]
pub(super) fn bit(words: &[u32], place: u32) -> bool {
    words[place as usize / 32] >> (place % 32) & 1 != 0
}

/// Ones before bit number `place`, which is at most the number of bits.
#[inline(always)]
pub(super) fn rank(words: &[u32], place: u32) -> u32 {
    let whole = place as usize / 32;
    let before: u32 = words[..whole].iter().map(|word| word.count_ones()).sum();
    // All of a missing word.
    let rest = words
        .get(whole)
        .map_or(0, |word| word & ((1 << (place % 32)) - 1));
    before + rest.count_ones()
}

/// The position of one bit number `number` from 0, if it exists; with `flip` of `u32::MAX` that of
/// a zero.
pub(super) fn select(words: &[u32], number: u32, flip: u32) -> Option<u32> {
    let mut left = number;
    for (index, &word) in (0u32..).zip(words) {
        let mut word = word ^ flip;
        let ones = word.count_ones();
        if left < ones {
            for _ in 0..left {
                word &= word - 1;
            }
            return Some(32 * index + word.trailing_zeros());
        }
        left -= ones;
    }
    None
}

/// Inner nodes, including the root, of a tree with this number of words.
#[inline(always)]
pub(super) fn inner_count(words: &[u32]) -> u32 {
    8 * words.len() as u32
}

/// Leaves of a tree with this number of words.
#[inline(always)]
pub(super) fn leaf_count(words: &[u32]) -> u32 {
    24 * words.len() as u32 + 1
}

/// Writes the most uniform tree: the first nodes are inner nodes.
pub(super) fn even(words: &mut [u32]) {
    let ones = inner_count(words) - 1;
    for (index, word) in (0u32..).zip(words) {
        let own = ones.saturating_sub(32 * index);
        *word = if own >= 32 { u32::MAX } else { (1 << own) - 1 };
    }
}

/// Whether bits form a tree of depth at most [`MAX_QUADTREE_DEPTH`].
pub(super) fn is_tree(words: &[u32]) -> bool {
    let inner = inner_count(words);
    if !(1..=MAX_INNER as u32).contains(&inner) || rank(words, 32 * words.len() as u32) != inner - 1 {
        return false;
    }
    // Level by level: the nodes of one are the children of the inner nodes of the level above.
    let (mut start, mut end, mut depth) = (0, 4, 1);
    while start < end {
        let (first, last) = (rank(words, start), rank(words, end));
        (start, end) = (4 * (first + 1), 4 * (last + 1));
        if end > 32 * words.len() as u32 || (start < end && depth == MAX_QUADTREE_DEPTH) {
            return false;
        }
        depth += 1;
    }
    end == 32 * words.len() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;

    /// Rank and select of every place of every width against loops over single bits.
    #[test]
    fn rank_and_select_agree_with_loops() {
        for width in 1..=MAX_QUADTREE_BITS / 32 {
            for density in 0..4 {
                let mut rng = CounterRng::new(7, width, density);
                let words: Vec<u32> = (0..width)
                    .map(|_| match density {
                        0 => rng.next_u32(),
                        1 => rng.next_u32() & rng.next_u32() & rng.next_u32(),
                        2 => u32::MAX,
                        _ => 0,
                    })
                    .collect();
                let (mut ones, mut zeros) = (0, 0);
                for place in 0..32 * width {
                    assert_eq!(rank(&words, place), ones);
                    if bit(&words, place) {
                        assert_eq!(select(&words, ones, 0), Some(place));
                        ones += 1;
                    } else {
                        assert_eq!(select(&words, zeros, u32::MAX), Some(place));
                        zeros += 1;
                    }
                }
                assert_eq!(rank(&words, 32 * width), ones);
                assert_eq!(select(&words, ones, 0), None);
                assert_eq!(select(&words, zeros, u32::MAX), None);
            }
        }
    }

    #[test]
    fn even_trees_are_trees_and_damaged_ones_are_not() {
        for width in 1..=MAX_QUADTREE_BITS as usize / 32 {
            let mut words = vec![0; width];
            even(&mut words);
            assert!(is_tree(&words), "{width}");
            // One bit more, one less, an inner node that nothing leads to.
            for fault in 0..3 {
                let mut damaged = words.clone();
                match fault {
                    0 => damaged[0] ^= 1,
                    1 => damaged[width - 1] ^= 1 << 31,
                    _ => {
                        damaged[0] &= !0b1111;
                        damaged[width - 1] |= 0b1111 << 28;
                    }
                }
                assert!(!is_tree(&damaged), "{width}, {fault}");
            }
        }
        assert!(!is_tree(&[]));
        assert!(!is_tree(&[0; 33]));
    }
}
