//! Better trees by moving subtrees.
//!
//! Meister and Bittner 2018, *Parallel Reinsertion for Bounding Volume Hierarchy Optimization*: for
//! each of the largest nodes the place is searched where it lessens the sum of all areas most if it
//! is taken out and put in there. Searches run in parallel on the tree as it is; moves are then
//! made one by one, in the order of what they gain, as long as they touch nothing that another has
//! moved.

use crate::item::BoxItem;
use crate::linked::{Linked, NONE};
use crate::tree::Bvh;
use lightshed_sampling::parallel::for_each_chunk;

/// Searches that a thread makes at once.
const CHUNK: usize = 1 << 8;

/// How much work is spent on moving subtrees.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reinsertion {
    /// Share of the nodes, the largest ones, that are looked at in each pass, in `[0, 1]`.
    pub share: f32,
    /// Number of passes.
    pub passes: u32,
}

/// A move that was found.
#[derive(Clone, Copy, Debug)]
struct Move {
    gain: f32,
    node: u32,
    /// The node beside which it goes.
    target: u32,
}

impl Bvh {
    /// Moves subtrees to where the sum of areas is least. The boxes must be exact; the result is
    /// the same for any number of threads.
    pub fn reinsert(&mut self, reinsertion: &Reinsertion) {
        let nodes = self.nodes.len();
        let batch = ((nodes as f64 * f64::from(reinsertion.share)).ceil() as usize).min(nodes);
        // Of up to two primitives there is one tree.
        if batch == 0 || self.len() < 3 {
            return;
        }
        let mut linked = Linked::new(self);
        let mut largest: Vec<(f32, u32)> = Vec::new();
        let mut locked = vec![0u32; nodes];
        for pass in 1..=reinsertion.passes {
            largest.clear();
            largest.extend((1..nodes as u32).map(|node| (linked.boxes[node as usize].half_area(), node)));
            let batch = batch.min(largest.len());
            if batch < largest.len() {
                largest.select_nth_unstable_by(batch, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            }
            largest.truncate(batch);
            let mut moves: Vec<Option<Move>> = vec![None; batch];
            for_each_chunk(&mut moves, CHUNK, |start, moves| {
                let mut waiting = Vec::new();
                for (found, &(_, node)) in moves.iter_mut().zip(&largest[start..]) {
                    *found = linked.best_move(node, &mut waiting);
                }
            });
            let mut moves: Vec<Move> = moves.into_iter().flatten().collect();
            if moves.is_empty() {
                break;
            }
            moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
            for found in &moves {
                linked.make(found, &mut locked, pass);
            }
        }
        linked.write(self);
    }
}

impl Linked {
    /// The place for `node` that lessens the sum of areas most, if any does.
    fn best_move(&self, node: u32, waiting: &mut Vec<(u32, f32)>) -> Option<Move> {
        let area = |node: u32| self.boxes[node as usize].half_area();
        let parent = self.parents[node as usize];
        if parent == NONE || self.parents[parent as usize] == NONE {
            return None;
        }
        let own = self.boxes[node as usize];
        let own_area = own.half_area();
        let mut best = Move {
            gain: 0.0,
            node,
            target: NONE,
        };
        // What is saved by taking the node out, at the nodes below the one that the search has come
        // up to.
        let mut saved = area(parent);
        let mut rest = self.boxes[self.sibling(node) as usize];
        let mut at = parent;
        let mut search = self.sibling(node);
        loop {
            waiting.push((search, saved));
            while let Some((target, saved)) = waiting.pop() {
                // The new parent is no smaller than the node.
                if !(saved - own_area > best.gain) {
                    continue;
                }
                let union = own.union(&self.boxes[target as usize]).half_area();
                if saved - union > best.gain {
                    best.gain = saved - union;
                    best.target = target;
                }
                let below = saved + area(target) - union;
                if !self.is_leaf(target) && below - own_area > best.gain {
                    let [low, high] = self.children[target as usize];
                    waiting.extend([(high, below), (low, below)]);
                }
            }
            let above = self.parents[at as usize];
            if above == NONE {
                break;
            }
            if at != parent {
                saved += area(at) - rest.half_area();
            }
            search = self.sibling(at);
            at = above;
            // The box of `at` without the node.
            rest = rest.union(&self.boxes[search as usize]);
        }
        let is_move = best.target != NONE && best.target != self.sibling(node);
        is_move.then_some(best)
    }

    /// Makes a move unless one of this pass has touched what it touches.
    fn make(&mut self, &Move { node, target, .. }: &Move, locked: &mut [u32], pass: u32) {
        let parent = self.parents[node as usize];
        if parent == NONE {
            return;
        }
        let (above, sibling) = (self.parents[parent as usize], self.sibling(node));
        let target_parent = self.parents[target as usize];
        if above == NONE || target == parent || target == sibling || target_parent == NONE {
            return;
        }
        let touched = [node, parent, above, sibling, target, target_parent];
        if touched.iter().any(|&node| locked[node as usize] == pass) {
            return;
        }
        // Another move may have brought the target below the node.
        let mut up = target;
        while up != NONE {
            if up == node {
                return;
            }
            up = self.parents[up as usize];
        }
        touched.iter().for_each(|&node| locked[node as usize] = pass);
        self.replace(above, parent, sibling);
        let target_parent = self.parents[target as usize];
        self.replace(target_parent, target, parent);
        self.children[parent as usize] = [target, node];
        self.parents[target as usize] = parent;
        self.parents[node as usize] = parent;
        self.fit_from(above);
        self.fit_from(parent);
    }

    /// Puts `new` where `old` is among the children of `parent`.
    fn replace(&mut self, parent: u32, old: u32, new: u32) {
        for child in &mut self.children[parent as usize] {
            if *child == old {
                *child = new;
            }
        }
        self.parents[new as usize] = parent;
    }

    /// Boxes from a node up to the root.
    fn fit_from(&mut self, node: u32) {
        let mut at = node;
        while at != NONE {
            let [low, high] = self.children[at as usize];
            let union: BoxItem = self.boxes[low as usize].union(&self.boxes[high as usize]);
            self.boxes[at as usize] = union;
            at = self.parents[at as usize];
        }
    }
}
