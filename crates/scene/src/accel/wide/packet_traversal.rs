//! Nearest hits of rays that go through the tree side by side.
//!
//! Camera rays of neighbouring pixels visit the same nodes and triangles. Side by side they share
//! what a visit costs beyond arithmetic, and its branches that cannot be predicted. Where few rays
//! are left in a box, each goes on alone.

use super::in_flight::Many;
use super::node::{Child, ChildKind, Node};
use super::packet::{Packet, greatest};
use super::query::confirmed_nearest;
use super::row::Row;
use super::traverse::Traversal;
use super::{Walk, WideBvh};
use crate::accel::batch::{HitBatch, RayBatch};
use crate::accel::block::{Nearest, TriangleBlock};
use crate::accel::stack::{STACK_CAPACITY, Stack, StackMemory};
use lightshed_lanes::{AnyLanes, LaneKernel, LaneMask, Lanes, MOST_LANES};

/// Where fewer rays than these are in a box, each goes on alone. 3 to 12 make no difference.
const FEW: u32 = 4;
/// Fewest rays of a batch that are tried.
const FEWEST: usize = 16;

/// A child to be visited, and the rays that were in its node.
#[derive(Clone, Copy)]
struct Visit {
    node: u32,
    slot: u32,
    rays: u64,
}

impl WideBvh {
    /// The nearest hit of each of the first `count` rays.
    #[inline]
    pub fn intersect_batch(&self, rays: &RayBatch, count: usize, hits: &mut HitBatch) {
        self.lanes.run(NearestOfBatch {
            bvh: self,
            rays,
            count: count.min(RayBatch::CAPACITY),
            hits,
        });
    }
}

struct NearestOfBatch<'a> {
    bvh: &'a WideBvh,
    rays: &'a RayBatch,
    count: usize,
    hits: &'a mut HitBatch,
}

impl LaneKernel for NearestOfBatch<'_> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.bvh.nodes.walk::<L, _>(self);
    }
}

impl Walk for NearestOfBatch<'_> {
    type Output = ();

    #[inline(always)]
    fn walk<L: Lanes, M: AnyLanes, R: Row>(self, nodes: &[Node<R>]) {
        let Self {
            bvh,
            rays,
            count,
            hits,
        } = self;
        if !intersect::<L, M, R>(bvh, nodes, rays, count, hits) {
            Many::<Nearest, _, _>::new(bvh, rays, count, hits).walk::<L, M, R>(nodes);
        }
    }
}

/// Finds the nearest hits of the first `count` rays, at most [`RayBatch::CAPACITY`], if they are a
/// packet; if they are not, does nothing and returns false.
#[inline(always)]
fn intersect<L: Lanes, M: AnyLanes, R: Row>(
    bvh: &WideBvh,
    nodes: &[Node<R>],
    rays: &RayBatch,
    count: usize,
    hits: &mut HitBatch,
) -> bool {
    if count < FEWEST {
        return false;
    }
    let Some(packet) = Packet::new::<L::Long, R>(rays, count, bvh.uncertainty) else {
        return false;
    };
    let mut traversal = PacketTraversal {
        bvh,
        nodes,
        packet,
        hits,
    };
    traversal.start();
    traversal.go::<L, M>();
    traversal.finish::<L::Long>();
    true
}

/// The rays and what they have hit so far. Until the end, the second barycentric weight of a hit is
/// that of the first vertex, and `t` of a ray that has hit nothing is its end.
struct PacketTraversal<'a, R> {
    bvh: &'a WideBvh,
    nodes: &'a [Node<R>],
    packet: Packet<'a>,
    hits: &'a mut HitBatch,
}

impl<R: Row> PacketTraversal<'_, R> {
    #[inline(always)]
    fn start(&mut self) {
        let HitBatch { t, primitive, .. } = &mut *self.hits;
        t.clone_from(&self.packet.rays().t_max);
        primitive.clone_from(&HitBatch::NONE.primitive);
    }

    #[inline(always)]
    fn go<L: Lanes, M: AnyLanes>(&mut self) {
        let Self { bvh, nodes, .. } = *self;
        let (flip, count) = (self.packet.flip, self.packet.count());
        let mut waiting = [Visit {
            node: 0,
            slot: 0,
            rays: 0,
        }; STACK_CAPACITY];
        let mut len = 0;
        let mut t_max = greatest::<L::Long>(&self.hits.t, count);
        // A node, and the rays in it.
        let mut entered = Some((0_usize, u64::MAX >> (64 - count)));
        loop {
            if let Some((node, rays)) = entered.take() {
                // Far children wait below near ones.
                let mut order = self.packet.may_enter::<M, R>(&nodes[node], t_max);
                while order != 0 {
                    waiting[len] = Visit {
                        node: node as u32,
                        slot: order.trailing_zeros() ^ flip,
                        rays,
                    };
                    len += 1;
                    order &= order - 1;
                }
            }
            if len == 0 {
                break;
            }
            len -= 1;
            let Visit { node, slot, rays } = waiting[len];
            let node = &nodes[node as usize];
            let child = node.child(slot);
            let rays = self.packet.enter::<L::Long, R>(node, slot, &self.hits.t, rays);
            if rays.count_ones() < FEW {
                self.alone::<L, M>(child, rays);
            } else if child.kind() == ChildKind::Node {
                entered = Some((child.index(), rays));
            } else if child.kind() == ChildKind::Triangles {
                self.block::<L::Long>(&bvh.blocks[child.index()], rays);
                t_max = greatest::<L::Long>(&self.hits.t, count);
            } else {
                self.alone::<L, M>(child, rays);
            }
        }
    }

    /// The block's triangles and those of the rays that `rays` names.
    #[inline(always)]
    fn block<M: AnyLanes>(&mut self, block: &TriangleBlock, rays: u64) {
        let HitBatch {
            t: ends,
            primitive: primitives,
            barycentric: [second, first],
        } = &mut *self.hits;
        let mut place = 0;
        while place < self.packet.count() {
            let asked = Packet::lanes::<M>(rays, place);
            if asked != 0 {
                let asked = M::Mask::from_bits(asked);
                let (mut t, mut primitive) = (ends.read::<M>(place), primitives.read::<M>(place));
                let (mut a, mut b) = (first.read::<M>(place), second.read::<M>(place));
                for (lane, &number) in block.primitives.iter().enumerate() {
                    // Those that are not used are the last.
                    if number == u32::MAX {
                        break;
                    }
                    let met = self.packet.meet::<M>(block, lane, place);
                    let hit = met.hit & asked;
                    let mut taken = hit & met.t.less(t);
                    let equal = (hit & met.t.equal(t)).bits();
                    if equal != 0 {
                        taken = taken | M::Mask::from_bits(equal & later(primitive, number));
                    }
                    t = met.t.select(taken, t);
                    a = met.weights[0].select(taken, a);
                    b = met.weights[1].select(taken, b);
                    primitive = M::splat(f32::from_bits(number)).select(taken, primitive);
                }
                ends.write(place, t);
                primitives.write(place, primitive);
                first.write(place, a);
                second.write(place, b);
            }
            place += M::COUNT;
        }
    }

    /// What lies in `child` and each of the rays for itself.
    #[inline(always)]
    fn alone<L: Lanes, M: AnyLanes>(&mut self, child: Child, mut rays: u64) {
        let mut memory = StackMemory::new();
        let mut stack = Stack::new(&mut memory);
        while rays != 0 {
            let index = rays.trailing_zeros() as usize;
            rays &= rays - 1;
            let all = self.packet.rays();
            let [second, first] = &mut self.hits.barycentric;
            let found = Nearest::found(
                self.hits.t.get(index),
                self.hits.primitive.get_word(index),
                [first.get(index), second.get(index)],
            );
            let mut traversal = Traversal::below::<R>(self.bvh, child, found, &all.get(index), index);
            stack.clear();
            while !traversal.step::<L, M, R>(&mut stack, self.bvh, self.nodes, all) {}
            let (t, primitive, [a, b]) = traversal.query.parts();
            self.hits.t.set(index, t);
            self.hits.primitive.set_word(index, primitive);
            first.set(index, a);
            second.set(index, b);
        }
    }

    /// What is doubtful is looked at again.
    #[inline(always)]
    fn finish<M: AnyLanes>(&mut self) {
        let mut place = 0;
        while place < self.packet.count() {
            let [second, first] = &mut self.hits.barycentric;
            let weights = M::splat(1.0) - first.read::<M>(place) - second.read::<M>(place);
            first.write(place, weights.max(M::splat(0.0)));
            let t = self.hits.t.read::<M>(place);
            let mut doubtful = self.packet.doubtful::<M>(self.bvh.reach, t, place);
            while doubtful != 0 {
                let index = place + doubtful.trailing_zeros() as usize;
                if self.hits.get(index).is_some() {
                    let nearest = confirmed_nearest(self.bvh, self.packet.rays().get(index));
                    self.hits.set(index, nearest.hit());
                }
                doubtful &= doubtful - 1;
            }
            place += M::COUNT;
        }
    }
}

/// Lanes with primitives, numbers in bits, of which `number` is in front.
#[cold]
#[inline(never)]
fn in_front(number: u32, primitives: [u32; MOST_LANES]) -> u32 {
    let mut bits = 0;
    for (lane, &primitive) in primitives.iter().enumerate() {
        bits |= u32::from(primitive != HitBatch::NOTHING && number < primitive) << lane;
    }
    bits
}

/// Lanes whose primitive has a higher index than `number`.
#[inline(always)]
fn later<M: AnyLanes>(primitives: M, number: u32) -> u32 {
    let mut row = [HitBatch::NOTHING; MOST_LANES];
    primitives.write(&mut row);
    in_front(number, row)
}
