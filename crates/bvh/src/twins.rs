//! Two primitives built as one.
//!
//! Meshes often store both triangles of a quadrangle one after the other. Any good tree has such
//! two beside each other. If they are joined before the build, it has half the work at all levels;
//! when it is done, the leaf of two becomes a node with two leaves.
//!
//! Primitives `i` and `i + 1` are joined where the box around both is small beside their own,
//! `A(a ∪ b) < 0.75 (A(a) + A(b))`. As boxes of little in common never fulfil this, trees cost
//! what they cost without.

use crate::item::{BoxItem, half_areas};
use crate::node::Node;
use crate::primitive::Primitive;
use crate::source::Source;
use crate::tree::Bvh;
use glam::Vec4;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneMask, Lanes, prefetch};
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
        let (firsts, lanes) = (&self.firsts, LaneChoice::best());
        for_each_chunk(&mut self.boxes, CHUNK, |start, boxes| {
            lanes.run(Boxes(source, &firsts[start..], boxes));
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
        let (leaves, lanes) = (&joined.order, LaneChoice::best());
        for_each(parts.into_iter(), |_, (from, nodes, order)| {
            lanes.run(Write {
                source,
                from,
                leaves,
                before,
                nodes,
                order,
            });
        });
    }
}

/// How many primitives a word stands for.
#[inline(always)]
fn size(word: u32) -> u32 {
    1 + (word >> 31)
}

/// The primitives that a word stands for; of one it is this twice.
#[inline(always)]
fn primitives(word: u32) -> [usize; 2] {
    let first = (word & !TWO) as usize;
    [first, first + (word >> 31) as usize]
}

/// Their items.
#[inline(always)]
fn both<P: Primitive>(source: &Source<P>, word: u32) -> [BoxItem; 2] {
    primitives(word).map(|primitive| source.item(primitive))
}

/// Writes words for the primitives from `start` on, as many as there are `words`, into the first of
/// these; returns how many words stand for them.
fn join<P: Primitive>(source: &Source<P>, start: usize, words: &mut [u32]) -> usize {
    LaneChoice::best().run(Join(source, start, words))
}

struct Join<'a, P>(&'a Source<'a, P>, usize, &'a mut [u32]);

impl<P: Primitive> LaneKernel for Join<'_, P> {
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let Self(source, start, words) = self;
        let count = words.len();
        let mut kept = 0;
        // The primitive before the next eight, its area, and whether it may be joined.
        let mut last = source.item(start);
        let mut last_area = 0.0;
        let mut is_free = false;
        for at in (0..count).step_by(LANES) {
            let (mut own, mut together) = ([[0.0; 8]; LANES], [[0.0; 8]; LANES]);
            for i in 0..LANES {
                let item = source.item(start + (at + i).min(count - 1));
                together[i] = *last.union(&item).row();
                own[i] = *item.row();
                last = item;
            }
            let areas = half_areas::<L>(&own, 0);
            let mut before = [0.0; LANES];
            before[0] = last_area;
            before[1..].copy_from_slice(&areas.store()[..LANES - 1]);
            last_area = areas.store()[LANES - 1];
            let limits = L::splat(LARGEST) * (L::load(&before) + areas);
            let is_small = half_areas::<L>(&together, 0).less(limits).bits();
            for i in 0..LANES.min(count - at) {
                let joins = is_free && is_small >> i & 1 == 1;
                // Without a branch: what the second of two writes is written over.
                words[kept] = (start + at + i) as u32;
                words[kept.saturating_sub(1)] |= u32::from(joins) << 31;
                kept += usize::from(!joins);
                is_free = !joins;
            }
        }
        kept
    }
}

/// The boxes of words.
struct Boxes<'a, P>(&'a Source<'a, P>, &'a [u32], &'a mut [BoxItem]);

impl<P: Primitive> LaneKernel for Boxes<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self(source, words, boxes) = self;
        for (item, &word) in boxes.iter_mut().zip(words) {
            let [a, b] = both(source, word);
            *item = a.union(&b);
        }
    }
}

/// Writes the nodes and leaves that come from consecutive nodes.
struct Write<'a, P> {
    source: &'a Source<'a, P>,
    from: &'a [Node],
    /// Words of all leaves.
    leaves: &'a [u32],
    /// Primitives before each.
    before: &'a [u32],
    nodes: &'a mut [Node],
    order: &'a mut [u32],
}

impl<P: Primitive> LaneKernel for Write<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self {
            source,
            from,
            leaves,
            before,
            nodes,
            order,
        } = self;
        let base = before[from[0].first as usize];
        let mut at = 0;
        for node in from {
            let (start, end) = (node.first as usize, (node.first + node.count) as usize);
            let first = before[start];
            if !node.is_leaf() {
                let count = before[end] - first;
                nodes[at] = Node { first, count, ..*node };
                at += 1;
                continue;
            }
            let soon = leaves[(start + AHEAD).min(leaves.len() - 1)];
            for primitive in primitives(soon) {
                prefetch(source.primitive(primitive));
            }
            let word = leaves[start];
            let place = (first - base) as usize;
            if size(word) == 1 {
                nodes[at] = Node { first, ..*node };
                order[place] = word;
                at += 1;
                continue;
            }
            let [a, b] = both(source, word);
            // The larger one first, as re-insertion has it.
            let is_larger = b.half_area() > a.half_area();
            let (a, b) = if is_larger { (b, a) } else { (a, b) };
            let above = Node {
                first,
                count: 2,
                ..*node
            };
            nodes[at..at + 3].copy_from_slice(&[above, a.node(first, 1), b.node(first + 1, 1)]);
            order[place..place + 2].copy_from_slice(&[a.index(), b.index()]);
            at += 3;
        }
    }
}
