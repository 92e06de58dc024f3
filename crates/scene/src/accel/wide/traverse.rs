//! Rays through the wide tree.
//!
//! Boxes are tested by slabs whose far ends are widened by the test's own rounding error (Ize 2013,
//! *Robust BVH Ray Traversal*), triangles as [`crate::accel::block`] says.
//!
//! A ray visits few nodes, and each visit waits: for the node to arrive from memory, for the chain
//! of operations on it, for a branch that cannot be predicted. So several rays are in flight at
//! once, a step of each in turn ([`super::in_flight`]). The next node of each is prefetched as soon
//! as it is known, and a step uses masks and selections instead of branches where it can. A ray's
//! own steps do not depend on its neighbours: its result is the same, bit for bit, in any batch.

use super::WideBvh;
use super::constants::{FAR_WIDENING, RayConstants};
use super::node::{Child, ChildKind, Node};
use super::rays::Rays;
use super::row::Row;
use crate::accel::Ray;
use crate::accel::block::TriangleBlock;
use crate::accel::stack::Stack;
use lightshed_lanes::{AnyLanes, LaneMask, Lanes, prefetch_line};

/// A query for a ray, answered step by step.
pub trait Query: Copy {
    /// The answer.
    type Answer: Copy;
    /// The initial answer, before any step.
    fn start(ray: &Ray) -> Self;
    /// Processes a leaf; true if the answer is final.
    fn leaf<L: Lanes>(
        &mut self,
        bvh: &WideBvh,
        rays: impl Rays,
        index: usize,
        constants: &RayConstants,
        child: Child,
    ) -> bool;
    /// Nothing that starts beyond this ray parameter matters any more.
    fn t_max(&self) -> f32;
    /// Whether nearer children are visited first.
    const ORDERED: bool;
    /// The answer at the end: what is doubtful is looked at again.
    fn answer(self, bvh: &WideBvh, rays: impl Rays, index: usize, constants: &RayConstants) -> Self::Answer;
}

/// A ray on its way.
#[derive(Clone, Copy)]
pub struct Traversal<Q> {
    pub query: Q,
    constants: RayConstants,
    child: Child,
    /// Boxes that begin beyond this are not visited.
    end: f32,
    /// Index of the ray in the query.
    pub ray: usize,
}

impl<Q: Query> Traversal<Q> {
    #[inline(always)]
    pub fn new<R: Row>(bvh: &WideBvh, ray: &Ray, index: usize) -> Self {
        Self::below::<R>(bvh, ROOT, Q::start(ray), ray, index)
    }

    /// Of what lies in `child`; for the other parts of the tree, `query` is answered.
    #[inline(always)]
    pub fn below<R: Row>(bvh: &WideBvh, child: Child, query: Q, ray: &Ray, index: usize) -> Self {
        let constants = RayConstants::new::<R>(ray, bvh);
        Self {
            end: Self::end(&query, &constants),
            query,
            constants,
            child,
            ray: index,
        }
    }

    /// The ends of rays that ask for any hit are chosen to be clear of surfaces.
    #[inline(always)]
    fn end(query: &Q, constants: &RayConstants) -> f32 {
        if Q::ORDERED {
            query.t_max() + constants.slack
        } else {
            query.t_max()
        }
    }

    #[inline(always)]
    pub fn answer(&self, bvh: &WideBvh, rays: impl Rays) -> Q::Answer {
        self.query.answer(bvh, rays, self.ray, &self.constants)
    }

    /// Visits one child; true if the ray is done. `M` are as many lanes as a row is long.
    #[inline(always)]
    pub fn step<L: Lanes, M: AnyLanes, R: Row>(
        &mut self,
        stack: &mut Stack<'_>,
        bvh: &WideBvh,
        nodes: &[Node<R>],
        rays: impl Rays,
    ) -> bool {
        if self.child.kind() == ChildKind::Node {
            let node = &nodes[self.child.index()];
            let (near, order) = self.constants.enter(node, M::splat(self.end));
            if order != 0 {
                // The nearest is visited next, or for any hit the approximately nearest block if
                // there is one; the others wait in approximate order.
                let flip = self.constants.flip;
                let children = node.children::<M>().flipped(flip);
                let next = if Q::ORDERED {
                    (near.equal(near.least_of(order)).bits() & order).trailing_zeros()
                } else {
                    let blocks = Child::blocks(children) & order;
                    (if blocks != 0 { blocks } else { order }).ilog2()
                };
                stack.push(children, near, order & !(1 << next));
                self.child = node.child(next ^ flip);
                self.prefetch(bvh, nodes);
                return false;
            }
        } else {
            let constants = &self.constants;
            if self.query.leaf::<L>(bvh, rays, self.ray, constants, self.child) {
                return true;
            }
            self.end = Self::end(&self.query, constants);
        }
        loop {
            let Some((child, entered)) = stack.pop() else {
                return true;
            };
            if entered <= self.end * FAR_WIDENING {
                self.child = Child(child);
                self.prefetch(bvh, nodes);
                return false;
            }
        }
    }

    /// Prefetches what the next step reads.
    #[inline(always)]
    fn prefetch<R: Row>(&self, bvh: &WideBvh, nodes: &[Node<R>]) {
        // Computes both addresses, then selects one, because the choice is unpredictable. Nothing
        // is read here.
        let index = self.child.index();
        let node = nodes
            .as_ptr()
            .cast::<u8>()
            .wrapping_add(index * size_of::<Node<R>>());
        let block = bvh
            .blocks
            .as_ptr()
            .cast::<u8>()
            .wrapping_add(index * size_of::<TriangleBlock>());
        let start = if self.child.kind() == ChildKind::Node {
            node
        } else {
            block
        };
        let mut offset = 0;
        while offset < size_of::<Node<R>>().max(size_of::<TriangleBlock>()) {
            prefetch_line(start.wrapping_add(offset));
            offset += 64;
        }
    }
}

const ROOT: Child = Child(0);
