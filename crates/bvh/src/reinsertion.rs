//! Better trees by moving subtrees.
//!
//! Meister and Bittner 2018, *Parallel Reinsertion for Bounding Volume Hierarchy Optimization*: for
//! each of the largest nodes the place is searched where it lessens the sum of all areas most if it
//! is taken out and put in there. Searches run in parallel on the tree as it is; moves are then
//! made one by one, in the order of what they gain, as long as they touch nothing that another has
//! moved.
//!
//! Most of what can be gained is in few nodes, and each move makes others possible. So later passes
//! look at fewer nodes.

use crate::item::BoxItem;
use crate::node::Node;
use crate::paired::{Paired, ROOT, area_of};
use crate::tree::Bvh;
use lightshed_lanes::resize_in_huge_pages;
use lightshed_sampling::parallel::for_each_chunk;

/// Searches that a thread makes at once.
const CHUNK: usize = 1 << 6;
/// In place of a cell.
const NONE: u32 = u32::MAX;
/// How many times as many nodes as move at first are places to move to.
const REACH: usize = 2;
/// About how many nodes say which are large.
const SAMPLE: usize = 1 << 15;
/// Groups of areas: by the exponent and three more bits.
const AREAS: usize = 1 << 11;

/// How much work is spent on moving subtrees.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reinsertion {
    /// Share of the nodes, the largest ones, that are looked at in the first pass, in `[0, 1]`;
    /// pass `k` looks at a share of `1 / (2k − 1)` of these.
    pub share: f32,
    /// Number of passes.
    pub passes: u32,
}

/// A move that was found.
#[derive(Clone, Copy, Debug)]
struct Move {
    gain: f32,
    node: u32,
    /// The cell beside whose subtree it goes.
    target: u32,
}

impl Bvh {
    /// Moves subtrees to where the sum of areas is least. The boxes must be exact; the result is
    /// the same for any number of threads.
    pub fn reinsert(&mut self, reinsertion: &Reinsertion) {
        self.reinsert_into(reinsertion, &mut Self::default());
    }

    /// The same, with the memory of another tree, which has the former one afterwards if there
    /// were moves.
    pub(crate) fn reinsert_into(&mut self, reinsertion: &Reinsertion, room: &mut Self) {
        let nodes = self.nodes.len();
        let first = largest(nodes, reinsertion.share);
        // Of up to two primitives there is one tree.
        if first == 0 || reinsertion.passes == 0 || self.len() < 3 {
            return;
        }
        let areas = || {
            self.nodes
                .iter()
                .map(|node| BoxItem::new(&node.bounds(), 0).half_area())
        };
        let least = area_of_largest(nodes, first.saturating_mul(REACH), areas);
        let mut paired = Paired::new(self, least);
        if paired.improve(first, reinsertion.passes) {
            resize_in_huge_pages(&mut room.nodes, self.nodes.len(), Node::default());
            resize_in_huge_pages(&mut room.order, self.order.len(), 0);
            core::mem::swap(self, room);
            paired.write(room, self);
        }
    }
}

/// How many of `nodes` are a share of them.
pub fn largest(nodes: usize, share: f32) -> usize {
    ((nodes as f64 * f64::from(share)).ceil() as usize).min(nodes)
}

/// An area that about `count` of `all` nodes reach, by a sample.
fn area_of_largest<A: Iterator<Item = f32>>(all: usize, count: usize, areas: impl FnOnce() -> A) -> f32 {
    if count >= all {
        return 0.0;
    }
    let step = all.div_ceil(SAMPLE);
    let mut numbers = vec![0u32; AREAS];
    for area in areas().step_by(step) {
        numbers[(area.to_bits() >> 20) as usize % AREAS] += 1;
    }
    let mut left = count.div_ceil(step);
    for (group, &number) in numbers.iter().enumerate().rev() {
        if number as usize >= left {
            return f32::from_bits((group as u32) << 20);
        }
        left -= number as usize;
    }
    0.0
}

impl Paired {
    /// Moves subtrees; the first pass looks at the `first` largest. Whether any was moved.
    pub fn improve(&mut self, first: usize, passes: u32) -> bool {
        let areas = || (0..self.len() as u32).map(|cell| area_of(self.cell(cell)));
        let mut threshold = area_of_largest(self.len(), first, areas);
        let mut largest: Vec<(f32, u32)> = Vec::new();
        let mut locked = vec![0u32; self.len()];
        let mut has_moved = false;
        for pass in 1..=passes {
            let share = |pass: u32| first.div_ceil(2 * pass as usize - 1);
            self.collect_largest(threshold, share(pass), &mut largest);
            let next = share(pass + 1).min(largest.len());
            if next > 0 {
                let by_area = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
                threshold = largest.select_nth_unstable_by(next - 1, by_area).1.0;
            }
            let mut moves: Vec<Option<Move>> = vec![None; largest.len()];
            for_each_chunk(&mut moves, CHUNK, |start, moves| {
                let mut waiting = Vec::new();
                for (found, &(_, node)) in moves.iter_mut().zip(&largest[start..]) {
                    *found = self.best_move(node, &mut waiting);
                }
            });
            let mut moves: Vec<Move> = moves.into_iter().flatten().collect();
            if moves.is_empty() {
                break;
            }
            moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
            for found in &moves {
                self.make(found, &mut locked, pass);
            }
            has_moved = true;
        }
        has_moved
    }

    /// The cells of at least an area, but for the root and what has no grandparent: at most
    /// `most`, the largest.
    fn collect_largest(&self, area: f32, most: usize, largest: &mut Vec<(f32, u32)>) {
        largest.clear();
        let mut waiting: Vec<u32> = Vec::new();
        let below = |cell: u32| self.children(cell).into_iter().flat_map(|low| [low, low + 1]);
        waiting.extend(below(ROOT).flat_map(below));
        // A cell's area is no less than those below it.
        while let Some(cell) = waiting.pop() {
            let own = area_of(self.cell(cell));
            if own >= area {
                largest.push((own, cell));
                waiting.extend(below(cell));
            }
        }
        if most < largest.len() {
            largest.select_nth_unstable_by(most, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            largest.truncate(most);
        }
    }

    /// The place for `node`, which has a grandparent, that lessens the sum of areas most, if any
    /// does.
    fn best_move(&self, node: u32, waiting: &mut Vec<(f32, u32)>) -> Option<Move> {
        let parent = self.parent(node);
        let mut search = Search {
            cells: self,
            own: *self.cell(node),
            own_area: area_of(self.cell(node)),
            gain: 0.0,
            target: NONE,
        };
        // What is saved by taking the node out, at the cells below the one that the search has come
        // up to; and the box of that cell without the node.
        let mut saved = area_of(self.cell(parent));
        let mut rest = *self.cell(node ^ 1);
        // Beside its sibling it is already.
        if let Some(low) = self.children(node ^ 1) {
            waiting.push((area_of(&rest), low));
            search.look(waiting);
        }
        let mut at = parent;
        while at != ROOT {
            if at != parent {
                saved += area_of(self.cell(at)) - rest.half_area();
            }
            let beside = at ^ 1;
            search.look_at(beside, self.cell(beside), saved, waiting);
            search.look(waiting);
            rest = rest.union(self.cell(beside));
            at = self.parent(at);
        }
        (search.target != NONE).then_some(Move {
            gain: search.gain,
            node,
            target: search.target,
        })
    }

    /// Makes a move unless one of this pass has touched what it touches.
    fn make(&mut self, &Move { node, target, .. }: &Move, locked: &mut [u32], pass: u32) {
        let (sibling, parent) = (node ^ 1, self.parent(node));
        let touched = [node, sibling, parent, target, self.parent(target)];
        if touched.iter().any(|&cell| locked[cell as usize] == pass) {
            return;
        }
        // Another move may have brought the target below the node, or made them meet.
        if target == parent || target == sibling {
            return;
        }
        let mut up = target;
        while up != ROOT {
            if up == node {
                return;
            }
            up = self.parent(up);
        }
        touched.iter().for_each(|&cell| locked[cell as usize] = pass);
        self.reinsert(node, target);
    }
}

/// The search for the place of one subtree.
struct Search<'a> {
    cells: &'a Paired,
    own: BoxItem,
    own_area: f32,
    /// What the best place so far gains.
    gain: f32,
    target: u32,
}

impl Search<'_> {
    /// Looks at pairs of cells until none is left.
    #[inline(always)]
    fn look(&mut self, waiting: &mut Vec<(f32, u32)>) {
        while let Some((saved, low)) = waiting.pop() {
            let [a, b] = [self.cells.cell(low), self.cells.cell(low + 1)];
            self.look_at(low, a, saved, waiting);
            self.look_at(low + 1, b, saved, waiting);
        }
    }

    /// Looks at one cell, above which `saved` is saved.
    #[inline(always)]
    fn look_at(&mut self, at: u32, cell: &BoxItem, saved: f32, waiting: &mut Vec<(f32, u32)>) {
        // The new parent is no smaller than the node.
        if !(saved - self.own_area > self.gain) {
            return;
        }
        let gain = saved - self.own.union(cell).half_area();
        if gain > self.gain {
            (self.gain, self.target) = (gain, at);
        }
        let below = gain + area_of(cell);
        if below - self.own_area > self.gain
            && let Some(low) = self.cells.children(at)
        {
            waiting.push((below, low));
        }
    }
}
