//! Moving leaves within a tree, on its bits (§5.5.1).

use super::bits::{bit, rank};

/// Removes the four bits from `place` on, a multiple of 4, and moves those after them down. The
/// last four become zero.
fn remove(words: &mut [u32], place: u32) {
    let (first, low) = (place as usize / 32, (1u32 << (place % 32)) - 1);
    for index in first..words.len() {
        let after = words.get(index + 1).map_or(0, |word| word << 28);
        let kept = if index == first { low } else { 0 };
        words[index] = words[index] & kept | (words[index] >> 4 & !kept) | after;
    }
}

/// Moves the bits from `place` on, a multiple of 4, up by four and inserts zeros there. The last
/// four bits are lost.
fn insert(words: &mut [u32], place: u32) {
    let (first, low) = (place as usize / 32, (1u32 << (place % 32)) - 1);
    for index in (first + 1..words.len()).rev() {
        words[index] = words[index] << 4 | words[index - 1] >> 28;
    }
    words[first] = words[first] & low | (words[first] & !low) << 4;
}

/// Where the four bits were and where they are now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Moved {
    /// First of the bits that were taken away.
    pub from: u32,
    /// First of the bits that were put in, in the bits without the others.
    pub to: u32,
    /// The bit of the leaf that was split, in the bits without those taken away.
    pub split: u32,
}

/// Makes a leaf of the inner node of bit `inner`, whose children must all be leaves, and splits the
/// leaf of bit `leaf`, which must not be one of them. The number of bits stays.
pub(super) fn migrate(words: &mut [u32], inner: u32, leaf: u32) -> Moved {
    let from = 4 * (rank(words, inner) + 1);
    debug_assert!(bit(words, inner) && !bit(words, leaf));
    debug_assert!((from..from + 4).all(|place| !bit(words, place) && place != leaf));
    words[inner as usize / 32] &= !(1 << (inner % 32));
    remove(words, from);
    let split = if leaf > from { leaf - 4 } else { leaf };
    words[split as usize / 32] |= 1 << (split % 32);
    let to = 4 * (rank(words, split) + 1);
    insert(words, to);
    Moved { from, to, split }
}

#[cfg(test)]
mod tests {
    use super::super::bits::{even, is_tree, leaf_count};
    use super::*;
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::check_faults;
    use std::collections::BTreeSet;

    /// The leaves by depth and place, by walking the nodes from the root.
    fn leaves(words: &[u32]) -> BTreeSet<(u32, u32)> {
        let mut queue = std::collections::VecDeque::from([(0, 0)]);
        let (mut place, mut leaves) = (0, BTreeSet::new());
        while let Some((depth, code)) = queue.pop_front() {
            for child in 0..4 {
                let below = (depth + 1, code << 2 | child);
                match bit(words, place) {
                    true => queue.push_back(below),
                    false => assert!(leaves.insert(below)),
                }
                place += 1;
            }
        }
        assert_eq!(place, 32 * words.len() as u32);
        leaves
    }

    /// Moves leaves at random: some 400,000 times in all widths together. The tree stays one, and
    /// loses the four leaves that were joined and the one that was split, and no other. Bits moved
    /// by a place too few are found.
    #[test]
    fn migrations_lose_no_leaf() {
        check_faults(&[()], |fault| {
            for width in [1usize, 2, 3, 4, 8, 32] {
                let mut words = vec![0; width];
                even(&mut words);
                let mut rng = CounterRng::new(3, width as u32, 0);
                let bits = 32 * width as u32;
                let mut before = leaves(&words);
                // The set of leaves is made now and then, the tree is checked always.
                let moves = 1_000_000 / (6 * width);
                for number in 0..moves {
                    let mut draw = |accept: &dyn Fn(u32) -> bool| {
                        (0..10_000)
                            .map(|_| rng.next_u32() % bits)
                            .find(|&place| accept(place))
                    };
                    let children = |place| 4 * (rank(&words, place) + 1);
                    let joins = |place: u32| {
                        bit(&words, place) && (0..4).all(|child| !bit(&words, children(place) + child))
                    };
                    let Some(inner) = draw(&joins) else { continue };
                    let own = children(inner);
                    let Some(leaf) = draw(&|place| !bit(&words, place) && !(own..own + 4).contains(&place))
                    else {
                        continue;
                    };
                    let was = words.clone();
                    migrate(&mut words, inner, leaf);
                    if fault.is_some() {
                        words[width - 1] >>= 1;
                    }
                    if !is_tree(&words) {
                        // Too deep is no fault of the move.
                        let deep = rank(&words, bits) == bits / 4 - 1 && fault.is_none();
                        if !deep {
                            return Err(format!("move {number} of {width} words is no tree"));
                        }
                        words = was;
                        continue;
                    }
                    if number % (97 * width) == 0 {
                        before = leaves(&was);
                        let after = leaves(&words);
                        let gone: Vec<_> = before.difference(&after).collect();
                        let new: Vec<_> = after.difference(&before).collect();
                        let holds =
                            after.len() as u32 == leaf_count(&words) && gone.len() == 5 && new.len() == 5;
                        if !holds {
                            return Err(format!("{gone:?} became {new:?}"));
                        }
                    }
                }
                assert!(before.len() as u32 == leaf_count(&words));
            }
            Ok(())
        })
        .unwrap();
    }
}
