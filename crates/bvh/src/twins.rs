//! Two primitives built as one.
//!
//! Meshes often store both triangles of a quadrangle one after the other. Any good tree has such
//! two beside each other. If they are joined before the build, it has half the work at all levels;
//! when it is done, the leaf of two becomes a node with two leaves.
//!
//! Primitives `i` and `i + 1` are joined where the box around both is small beside their own,
//! `A(a ∪ b) < 0.75 (A(a) + A(b))`. As boxes of little in common never fulfil this, trees cost
//! what they cost without.

use crate::item::BoxItem;
use crate::node::Node;
use crate::primitive::Primitive;
use crate::source::Source;
use crate::tree::Bvh;
use glam::Vec4;
use lightshed_lanes::prefetch;
use lightshed_sampling::parallel::{for_each, for_each_chunk};

/// Largest area of the box around two, as a share of the sum of theirs.
const LARGEST: f32 = 0.75;
/// Primitives that a thread looks at. Two that lie in different chunks are not joined, so the
/// result does not depend on the threads.
const CHUNK: usize = 1 << 12;
/// The sample that says whether there are enough of them: so many primitives of each `CHUNK`.
const SAMPLE: usize = 1 << 7;
/// Fewer primitives are not worth it.
const FEWEST: usize = 64;
/// Nodes that a thread writes at once.
const NODES: usize = 1 << 12;
/// Leaves whose primitives are asked for ahead of their turn.
const AHEAD: usize = 16;
/// Marks the first of two.
const TWO: u32 = 1 << 31;

/// What is left to build over, and what each of it stands for.
#[derive(Clone, Debug, Default)]
pub struct Twins {
    boxes: Vec<BoxItem>,
    /// The first primitive of each, and [`TWO`] if there is another.
    firsts: Vec<u32>,
    /// Primitives before each leaf, and all of them.
    before: Vec<u32>,
}

impl Primitive for BoxItem {
    fn bounds(&self) -> lightshed_spatial::Bounds {
        lightshed_spatial::Bounds::new(self.min(), self.max())
    }

    #[inline(always)]
    fn corners(&self) -> [Vec4; 2] {
        [self.low, Vec4::ZERO - self.high]
    }
}

impl Twins {
    /// Joins what is to be joined; whether that saves enough to be worth it.
    pub fn find<P: Primitive>(&mut self, source: &Source<P>) -> bool {
        let count = source.len();
        if count < FEWEST || source.is_scaled() {
            return false;
        }
        let (mut looked, mut kept) = (0, 0);
        let mut words = [0; SAMPLE];
        for start in (0..count).step_by(CHUNK) {
            let words = &mut words[..SAMPLE.min(count - start)];
            looked += words.len();
            kept += join(source, start, words);
        }
        // What is joined has to be taken apart in the end.
        let is_worth = |kept: usize, looked: usize| kept * 8 <= looked * 7;
        if !is_worth(kept, looked) {
            return false;
        }
        self.firsts.clear();
        self.firsts.resize(count, 0);
        let mut counts = vec![0; count.div_ceil(CHUNK)];
        let chunks = self.firsts.chunks_mut(CHUNK).zip(&mut counts);
        for_each(chunks, |chunk, (words, kept)| {
            *kept = join(source, chunk * CHUNK, words);
        });
        let mut kept = 0;
        for (chunk, of_chunk) in counts.into_iter().enumerate() {
            let start = chunk * CHUNK;
            self.firsts.copy_within(start..start + of_chunk, kept);
            kept += of_chunk;
        }
        self.firsts.truncate(kept);
        if !is_worth(kept, count) {
            return false;
        }
        self.boxes.resize(kept, BoxItem::EMPTY);
        let firsts = &self.firsts;
        for_each_chunk(&mut self.boxes, CHUNK, |start, boxes| {
            for (item, &word) in boxes.iter_mut().zip(&firsts[start..]) {
                *item = both(source, word).0;
            }
        });
        true
    }

    /// What is left to build over.
    pub fn boxes(&self) -> &[BoxItem] {
        &self.boxes
    }

    /// Writes the tree over the primitives out of that over [`Self::boxes`], whose order is not its
    /// own any more.
    pub fn expand<P: Primitive>(&mut self, source: &Source<P>, joined: &mut Bvh, tree: &mut Bvh) {
        let count = source.len();
        tree.nodes.resize(2 * count - 1, Node::default());
        tree.order.resize(count, 0);
        self.before.clear();
        let mut sum = 0;
        for place in &mut joined.order {
            *place = self.firsts[*place as usize];
            self.before.push(sum);
            sum += size(*place);
        }
        self.before.push(sum);
        let before = &self.before;
        let mut parts = Vec::new();
        let (mut nodes, mut order) = (&mut tree.nodes[..], &mut tree.order[..]);
        let mut at = 0;
        for (chunk, from) in joined.nodes.chunks(NODES).enumerate() {
            let next = (chunk + 1) * NODES;
            // All leaves before a node have smaller places than its first.
            let end = match joined.nodes.get(next) {
                Some(node) => node.first,
                None => joined.order.len() as u32,
            };
            let (own_nodes, rest) = nodes.split_at_mut(if next < joined.nodes.len() {
                next + 2 * (before[end as usize] - end) as usize - at
            } else {
                nodes.len()
            });
            at += own_nodes.len();
            let first = before[from[0].first as usize];
            let (own_order, rest_of_order) = order.split_at_mut((before[end as usize] - first) as usize);
            (nodes, order) = (rest, rest_of_order);
            parts.push((from, own_nodes, own_order));
        }
        let leaves = &joined.order;
        for_each(parts.into_iter(), |_, (from, nodes, order)| {
            write(source, (from, leaves, before), nodes, order);
        });
    }
}

/// How many primitives a word stands for.
#[inline(always)]
fn size(word: u32) -> u32 {
    1 + (word >> 31)
}

/// The box of what a word stands for, and the items of it: the second of one is the first again.
#[inline(always)]
fn both<P: Primitive>(source: &Source<P>, word: u32) -> (BoxItem, [BoxItem; 2]) {
    let first = (word & !TWO) as usize;
    let items = [source.item(first), source.item(first + (word >> 31) as usize)];
    (items[0].union(&items[1]), items)
}

/// Words for the primitives from `start` on, as many as there are `words`; returns how many words
/// stand for them.
fn join<P: Primitive>(source: &Source<P>, start: usize, words: &mut [u32]) -> usize {
    let count = words.len();
    let mut kept = 0;
    // A primitive, and whether it may be joined with the next.
    let mut last = source.item(start);
    let mut last_area = last.half_area();
    let mut is_free = false;
    for i in 0..count {
        let item = source.item(start + i);
        let area = item.half_area();
        let together = is_free && last.union(&item).half_area() < LARGEST * (last_area + area);
        // Without a branch: what the second of two writes is written over.
        words[kept] = (start + i) as u32;
        if kept > 0 {
            words[kept - 1] |= u32::from(together) << 31;
        }
        kept += usize::from(!together);
        is_free = !together;
        (last, last_area) = (item, area);
    }
    kept
}

/// Writes the nodes and leaves that come from consecutive nodes; `leaves` are words.
fn write<P: Primitive>(
    source: &Source<P>,
    (from, leaves, before): (&[Node], &[u32], &[u32]),
    nodes: &mut [Node],
    order: &mut [u32],
) {
    let base = before[from[0].first as usize];
    let mut to = nodes.iter_mut();
    let mut put = |node: Node| {
        if let Some(to) = to.next() {
            *to = node;
        }
    };
    for node in from {
        let (start, end) = (node.first as usize, (node.first + node.count) as usize);
        let first = before[start];
        if !node.is_leaf() {
            let count = before[end] - first;
            put(Node { first, count, ..*node });
            continue;
        }
        let soon = leaves[(start + AHEAD).min(leaves.len() - 1)] & !TWO;
        prefetch(source.primitive(soon as usize));
        let word = leaves[start];
        let index = word & !TWO;
        let place = (first - base) as usize;
        if size(word) == 1 {
            put(Node { first, ..*node });
            order[place] = index;
            continue;
        }
        let (_, [a, b]) = both(source, word);
        put(Node {
            first,
            count: 2,
            ..*node
        });
        // The larger one first, as re-insertion has it.
        let swapped = b.half_area() > a.half_area();
        let (a, b) = if swapped { (b, a) } else { (a, b) };
        put(a.node(first, 1));
        put(b.node(first + 1, 1));
        order[place] = a.index();
        order[place + 1] = b.index();
    }
}
