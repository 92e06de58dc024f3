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
}

/// Moves leaves, up to the number in the options, from where they carry least to the leaf that
/// carries most.
///
/// A leaf carries `e = (1 − λ) E + λ A`, the share `E` of the samples' weights that fall into
/// it with a prior: the share `A` of the square that it covers, which weighs as much as `prior`
/// samples do, `λ = prior / (samples + prior)`. If second moments are learnt it carries `√(A e)`
/// with `E` the share of `∫ f²`: leaves of equal load then follow the root of the second moment,
/// which is the density of least variance for estimates that are noisy themselves (Rath 2020, eq. 5
/// there).
pub(super) fn learn(words: &mut [u32], weights: &SortedWeights, options: &QuadtreeOptions) {
    if weights.count() == 0 || !(weights.total() > 0.0) {
        return;
    }
    let bits = 32 * words.len();
    let count = weights.count() as f64;
    let prior = f64::from(options.prior_samples) / (count + f64::from(options.prior_samples));
    let node = |code: u32, depth: u32| {
        let (sum, samples) = weights.within(code, depth);
        let share = sum / weights.total();
        let area = 0.25f64.powi(depth as i32);
        let load = (1.0 - prior) * share + prior * area;
        let load = if options.second_moment {
            (area * load).sqrt()
        } else {
            load
        };
        Node {
            code,
            depth,
            energy: load as f32,
            is_known: samples >= options.least_samples as usize && depth < MAX_QUADTREE_DEPTH,
        }
    };
    let mut nodes = [Node::default(); 4 * MAX_INNER];
    let mut inner = [0u16; MAX_INNER];
    let mut found = 1;
    for place in 0..bits {
        let (code, depth) = match place / 4 {
            0 => (0, 0),
            // The node of inner number k, found before its children.
            number => {
                let node = nodes[inner[number] as usize];
                (node.code, node.depth)
            }
        };
        let code = code | (place as u32 & 3) << (30 - 2 * depth);
        nodes[place] = node(code, depth + 1);
        if bit(words, place as u32) && found < MAX_INNER {
            inner[found] = place as u16;
            found += 1;
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
        let Node { code, depth, .. } = nodes[split as usize];
        for child in 0..4 {
            let code = code | (child as u32) << (30 - 2 * depth);
            nodes[to + child] = node(code, depth + 1);
        }
    }
}

/// The inner node over four leaves that carries least, and the leaf that carries most.
fn best_move(words: &[u32], nodes: &[Node]) -> Option<(usize, usize)> {
    let (mut from, mut to): (Option<usize>, Option<usize>) = (None, None);
    let mut number = 0;
    for (place, node) in nodes.iter().enumerate() {
        if bit(words, place as u32) {
            number += 1;
            let children = words[number / 8] >> (4 * (number % 8)) & 15;
            if children == 0 && from.is_none_or(|from| node.energy < nodes[from].energy) {
                from = Some(place);
            }
        } else if node.is_known && to.is_none_or(|to| node.energy > nodes[to].energy) {
            to = Some(place);
        }
    }
    debug_assert_eq!(number as u32 + 1, inner_count(words));
    from.zip(to)
}
