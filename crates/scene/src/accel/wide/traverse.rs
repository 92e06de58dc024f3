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
use super::node::{Child, ChildKind, Node};
use super::query::Query;
use super::rays::Rays;
use super::row::Row;
use super::slack::slack;
use crate::accel::Ray;
use crate::accel::block::{TriangleBlock, TriangleRay};
use crate::accel::stack::Stack;
use lightshed_lanes::{AnyLanes, LaneMask, Lanes, prefetch_line};

/// `1 + 2γ(3)`, rounded up: how far the slab test's far end may be off (Ize 2013 §3).
pub const FAR_WIDENING: f32 = 1.0 + 4.0 * f32::EPSILON;

/// What the tests need of a ray.
///
/// No closures and no iterator adaptors from here on: they are functions of their own, which the
/// compiler does not inline into a caller with other instructions than the crate's, and a call for
/// every operation is the end of speed.
#[derive(Clone, Copy)]
pub struct RayConstants {
    pub triangle: TriangleRay,
    inverse_direction: [f32; 3],
    /// Bit `a` says whether the ray goes to the positive side of axis `a`: it is the row of the
    /// bounds in which the ray leaves.
    octant: u32,
    /// How much farther than a hit what is nearer may seem to begin, see [`super::slack`].
    slack: f32,
    /// Exclusive-ors a child's slot to its place on the stack: the slots of a node are laid out by
    /// where the children lie (see [`Node`]), so that far ones come first and the nearest is on
    /// top.
    flip: u32,
}

impl RayConstants {
    #[inline(always)]
    fn new<R: Row>(ray: &Ray, bvh: &WideBvh) -> Self {
        let d = ray.direction.to_array();
        let inverse_direction = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let forwards = |axis: usize| u32::from(d[axis].is_sign_positive()) << axis;
        let octant = forwards(0) | forwards(1) | forwards(2);
        Self {
            triangle: TriangleRay::new(ray, inverse_direction),
            inverse_direction,
            octant,
            slack: slack(bvh.uncertainty, inverse_direction),
            flip: R::flip(octant, u32::from(d[0] + d[1] + d[2] >= 0.0)),
        }
    }

    /// Ray parameters at which the planes along `axis` are met: the nearer ones, and the farther.
    #[inline(always)]
    fn slabs<M: AnyLanes, R: Row>(&self, node: &Node<R>, axis: usize) -> [M; 2] {
        let far = (self.octant >> axis & 1) as usize;
        let origin = M::splat(self.triangle.origin[axis]);
        let inverse = M::splat(self.inverse_direction[axis]);
        [
            (node.bound::<M>(axis, far ^ 1) - origin) * inverse,
            (node.bound::<M>(axis, far) - origin) * inverse,
        ]
    }

    /// Where the ray enters each child's box, and in which it does before `t_max`, in the order of
    /// the children.
    #[inline(always)]
    fn enter<M: AnyLanes, R: Row>(&self, node: &Node<R>, t_max: M) -> (M, u32) {
        // The argument that may be NaN comes first, see `AnyLanes`.
        let [x, y, z] = [
            self.slabs::<M, R>(node, 0),
            self.slabs::<M, R>(node, 1),
            self.slabs::<M, R>(node, 2),
        ];
        let near = x[0].max(y[0].max(z[0].max(M::splat(0.0))));
        let far = x[1].min(y[1].min(z[1].min(t_max))) * M::splat(FAR_WIDENING);
        let (near, far) = (near.flipped(self.flip), far.flipped(self.flip));
        (near, near.less_equal(far).bits())
    }
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
            end: query.t_max() + constants.slack,
            query,
            constants,
            child,
            ray: index,
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
            self.end = self.query.t_max() + constants.slack;
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
        prefetch_line(start);
        prefetch_line(start.wrapping_add(64));
        prefetch_line(start.wrapping_add(128));
        prefetch_line(start.wrapping_add(192));
        prefetch_line(start.wrapping_add(256));
        if size_of::<Node<R>>() > 320 {
            prefetch_line(start.wrapping_add(320));
            prefetch_line(start.wrapping_add(384));
        }
    }
}

const ROOT: Child = Child(0);
