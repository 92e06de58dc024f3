//! Adaptation of a tree to samples (§5.5.1).

use super::bits::{MAX_INNER, MAX_QUADTREE_DEPTH, bit, inner_count};
use super::migrate::{Moved, migrate};
use super::options::QuadtreeOptions;
use crate::ranges::SortedWeights;

/// A node of the tree, at the place of its bit.
#[derive(Clone, Copy, Default)]
struct Node {
    /// Least Morton code in its square.
    code: u32,
    depth: u32,
    /// Its value as a leaf: a share of everything.
    energy: f32,
    /// Whether it has enough samples to be split.
    is_known: bool,
    /// Numbers of its samples in the order of their codes: from the first to before the second.
    range: [u32; 2],
}

/// What a node would carry as a leaf, and its samples.
pub(super) trait Loads {
    /// Number of samples.
    fn count(&self) -> usize;

    /// How many of the samples `first` to before `end`, in the order of their Morton codes, have a
    /// code below `code`.
    fn before(&self, range: [u32; 2], code: u32) -> u32;

    /// The load of a square of `depth`, which has these samples. `prior` is a number of samples
    /// that are spread evenly over all squares.
    fn load(&self, range: [u32; 2], depth: u32, prior: f64) -> f64;
}

/// Loads are shares of the samples' weights.
impl Loads for SortedWeights {
    fn count(&self) -> usize {
        if self.total() > 0.0 { self.count() } else { 0 }
    }

    fn before(&self, range: [u32; 2], code: u32) -> u32 {
        self.below(range, code)
    }

    fn load(&self, range: [u32; 2], depth: u32, prior: f64) -> f64 {
        let share = self.sum(range) / self.total();
        let prior = prior / (self.count() as f64 + prior);
        (1.0 - prior) * share + prior * area(depth)
    }
}

/// Area of a square of the octahedral map.
pub(super) fn area(depth: u32) -> f64 {
    0.25f64.powi(depth as i32)
}

/// Moves leaves, up to the number in the options, from where they carry least to the leaf that
/// carries most.
pub(super) fn learn(words: &mut [u32], loads: &impl Loads, options: &QuadtreeOptions) {
    if loads.count() == 0 {
        return;
    }
    let bits = 32 * words.len();
    let prior = f64::from(options.prior_samples);
    // The four quarters of a node: its samples are theirs, in this order.
    let quarters = |parent: Node| {
        let (depth, mut start) = (parent.depth + 1, parent.range[0]);
        [0u32, 1, 2, 3].map(|quarter| {
            let code = parent.code | quarter << (32 - 2 * depth);
            let end = match quarter {
                3 => parent.range[1],
                _ => start + loads.before([start, parent.range[1]], code + (1 << (32 - 2 * depth))),
            };
            let range = [start, end];
            start = end;
            let samples = (range[1] - range[0]) as usize;
            Node {
                code,
                depth,
                energy: loads.load(range, depth, prior) as f32,
                is_known: samples >= options.least_samples as usize && depth < MAX_QUADTREE_DEPTH,
                range,
            }
        })
    };
    let root = Node {
        range: [0, loads.count() as u32],
        ..Node::default()
    };
    let mut nodes = [Node::default(); 4 * MAX_INNER];
    let mut inner = [0u16; MAX_INNER];
    let mut found = 1;
    for number in 0..bits / 4 {
        // The node of inner number k, found before its children.
        let parent = match number {
            0 => root,
            _ => nodes[inner[number] as usize],
        };
        nodes[4 * number..][..4].copy_from_slice(&quarters(parent));
        for place in 4 * number..4 * number + 4 {
            if bit(words, place as u32) && found < MAX_INNER {
                inner[found] = place as u16;
                found += 1;
            }
        }
    }
    for _ in 0..options.migrations {
        let Some((from, to)) = best_move(words, &nodes[..bits]) else {
            return;
        };
        if nodes[to].energy * options.eagerness <= nodes[from].energy {
            return;
        }
        let Moved { from, to, split } = migrate(words, from as u32, to as u32);
        let (from, to) = (from as usize, to as usize);
        nodes.copy_within(from + 4..bits, from);
        nodes.copy_within(to..bits - 4, to + 4);
        let children = quarters(nodes[split as usize]);
        nodes[to..to + 4].copy_from_slice(&children);
    }
}

/// The leaf that carries most, and of the inner nodes over four leaves, without that over this
/// leaf, the one that carries least; a leaf may gain more by a division than its parent did.
fn best_move(words: &[u32], nodes: &[Node]) -> Option<(usize, usize)> {
    let mut to: Option<usize> = None;
    for (place, node) in nodes.iter().enumerate() {
        let is_leaf = !bit(words, place as u32);
        if is_leaf && node.is_known && to.is_none_or(|to| node.energy > nodes[to].energy) {
            to = Some(place);
        }
    }
    let to = to?;
    let (mut from, mut number): (Option<usize>, usize) = (None, 0);
    for (place, node) in nodes.iter().enumerate() {
        if bit(words, place as u32) {
            number += 1;
            let children = words[number / 8] >> (4 * (number % 8)) & 15;
            let is_free = children == 0 && number != to / 4;
            if is_free && from.is_none_or(|from| node.energy < nodes[from].energy) {
                from = Some(place);
            }
        }
    }
    debug_assert_eq!(number as u32 + 1, inner_count(words));
    Some((from?, to))
}
