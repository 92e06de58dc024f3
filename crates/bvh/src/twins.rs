//! Two primitives built as one.
//!
//! Meshes often store both triangles of a quadrangle one after the other. Any good tree has such
//! two beside each other. If they are joined before the build, it has half the work at all levels;
//! when it is done, the leaf of two becomes a node with two leaves.
//!
//! Primitives `i` and `i + 1` are joined where the box around both is small beside their own,
//! `A(a ∪ b) < 0.75 (A(a) + A(b))`. As boxes of little in common never fulfil this, trees cost
//! nearly what they cost without.

use crate::item::{BoxItem, half_areas};
use crate::node::Node;
use crate::primitive::Primitive;
use crate::source::Source;
use crate::tree::Bvh;
use glam::Vec4;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneMask, Lanes, prefetch, resize_in_huge_pages};
use lightshed_sampling::parallel::{for_each, for_each_chunk};

/// Largest area of the box around two, as a share of the sum of theirs.
const LARGEST: f32 = 0.75;
/// Largest share of the primitives that is left to build over. What is joined has to be taken apart
/// in the end, and both trees have to lie in memory: with more left than this the build takes
/// longer than one of all.
const MOST_LEFT: f64 = 0.7;
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
        let is_worth = |kept: usize, looked: usize| kept as f64 <= MOST_LEFT * looked as f64;
        if !is_worth(kept, looked) {
            return false;
        }
        self.firsts.clear();
        resize_in_huge_pages(&mut self.firsts, count, 0);
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
        resize_in_huge_pages(&mut self.boxes, kept, BoxItem::EMPTY);
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
        resize_in_huge_pages(&mut tree.nodes, 2 * count - 1, Node::default());
        resize_in_huge_pages(&mut tree.order, count, 0);
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
                nodes[at] = Node {
                    first,
                    count,
                    ..*node
                };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Method;
    use glam::Vec3;
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::Bounds;
    use lightshed_testkit::check_faults;

    /// Boxes of which up to `group` after each other are nearly the same; some are points.
    fn boxes(count: u32, group: u32) -> Vec<Bounds> {
        (0..count)
            .map(|index| {
                let mut rng = CounterRng::new(3, index / group, group);
                let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                let size = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 0.1;
                let longer = 1.0 + 0.2 * (index % group) as f32;
                let is_point = rng.next_u32().is_multiple_of(17);
                Bounds::new(at, at + if is_point { Vec3::ZERO } else { size * longer })
            })
            .collect()
    }

    /// What stands for what by the definition, a chunk at a time.
    fn words_of(items: &[BoxItem], share: f32) -> Vec<u32> {
        let mut words: Vec<u32> = Vec::new();
        for (chunk, items) in items.chunks(CHUNK).enumerate() {
            let mut i = 0;
            while i < items.len() {
                let word = (chunk * CHUNK + i) as u32;
                let is_small = items.get(i + 1).is_some_and(|next| {
                    let limit = share * (items[i].half_area() + next.half_area());
                    items[i].union(next).half_area() < limit
                });
                words.push(if is_small { word | TWO } else { word });
                i += 1 + usize::from(is_small);
            }
        }
        words
    }

    /// Neighbours are joined as the definition says, whatever the lanes, and boxes are those of
    /// both. Another share is noticed.
    #[test]
    fn neighbours_are_joined() {
        for count in [64, 65, 71, 1000, 2 * CHUNK as u32 + 3] {
            for group in [2, 4, 5] {
                let boxes = boxes(count, group);
                let source = Source::new(&boxes).unwrap();
                let items: Vec<BoxItem> = (0..boxes.len()).map(|i| source.item(i)).collect();
                let mut twins = Twins::default();
                assert!(twins.find(&source), "{count} {group}");
                check_faults(&[()], |fault| {
                    let expected = words_of(&items, fault.map_or(LARGEST, |()| 0.5));
                    if twins.firsts != expected {
                        return Err(format!("{count} in groups of {group}"));
                    }
                    Ok(())
                })
                .unwrap();
                for lanes in [LaneChoice::best(), LaneChoice::ARRAY] {
                    let mut words = vec![7; CHUNK.min(boxes.len())];
                    let kept = lanes.run(Join(&source, 0, &mut words));
                    assert_eq!(words[..kept], words_of(&items[..words.len()], LARGEST));
                }
                for (item, &word) in twins.boxes.iter().zip(&twins.firsts) {
                    let [a, b] = primitives(word).map(|i| boxes[i]);
                    assert_eq!(Primitive::bounds(item), a.union(&b));
                }
            }
        }
        // Nothing in common, too few, or too large for areas.
        let apart = boxes(1000, 1);
        assert!(!Twins::default().find(&Source::new(&apart).unwrap()));
        let few = boxes(FEWEST as u32 - 1, 2);
        assert!(!Twins::default().find(&Source::new(&few).unwrap()));
        let huge: Vec<Bounds> = boxes(1000, 2)
            .iter()
            .map(|b| Bounds::new(b.min * 1e30, b.max * 1e30))
            .collect();
        assert!(!Twins::default().find(&Source::new(&huge).unwrap()));
    }

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// One that was two is one.
        Lost,
        /// A box is not that of its primitive.
        Box,
    }

    /// Trees come out whole, with exact boxes, in memory that held others; what is lost is noticed.
    #[test]
    fn trees_are_taken_apart() {
        let other = Bvh::build(&boxes(3000, 1), Method::Curve).unwrap();
        for count in [64, 3 * NODES as u32, 1001] {
            for (group, method) in [(2, Method::Binned), (4, Method::Curve), (5, Method::Binned)] {
                let boxes = boxes(count, group);
                let source = Source::new(&boxes).unwrap();
                let mut twins = Twins::default();
                assert!(twins.find(&source));
                check_faults(&[Fault::Lost, Fault::Box], |fault| {
                    let mut joined = Bvh::build(twins.boxes(), method).unwrap();
                    let (mut twins, mut tree) = (twins.clone(), other.clone());
                    if let Some(Fault::Lost) = fault {
                        let two = twins.firsts.iter().position(|&word| size(word) == 2);
                        twins.firsts[two.unwrap()] &= !TWO;
                    }
                    twins.expand(&source, &mut joined, &mut tree);
                    if let Some(Fault::Box) = fault {
                        tree.nodes[1].min.x -= 1.0;
                    }
                    tree.check(&boxes).map_err(|fault| fault.to_string())?;
                    let mut fitted = tree.clone();
                    fitted.refit(&boxes).map_err(|error| error.to_string())?;
                    if fitted != tree {
                        return Err("a box is not exact".to_owned());
                    }
                    Ok(())
                })
                .unwrap();
            }
        }
    }
}
