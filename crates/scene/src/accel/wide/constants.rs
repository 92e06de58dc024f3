//! What the tests need of a ray, and how it is tested against boxes.

use super::WideBvh;
use super::node::Node;
use super::row::Row;
use super::slack::slack;
use crate::accel::Ray;
use crate::accel::block::TriangleRay;
use lightshed_lanes::{AnyLanes, LaneMask};

/// `1 + 2γ(3)`, rounded up: how far the slab test's far end may be off (Ize 2013 §3).
pub const FAR_WIDENING: f32 = 1.0 + 4.0 * f32::EPSILON;

/// What the tests need of a ray.
///
/// No closures and no iterator adaptors in kernels: they are functions of their own, which the
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
    pub slack: f32,
    /// Exclusive-ors a child's slot to its place on the stack: the slots of a node are laid out by
    /// where the children lie (see [`Node`]), so that far ones come first and the nearest is on
    /// top.
    pub flip: u32,
}

impl RayConstants {
    #[inline(always)]
    pub fn new<R: Row>(ray: &Ray, bvh: &WideBvh) -> Self {
        let d = ray.direction.to_array();
        let inverse_direction = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let forwards = |axis: usize| u32::from(d[axis].is_sign_positive()) << axis;
        let octant = forwards(0) | forwards(1) | forwards(2);
        let triangle = TriangleRay::new(ray, inverse_direction);
        Self {
            triangle,
            inverse_direction,
            octant,
            slack: slack(bvh.uncertainty, inverse_direction, triangle.inverse_longest()),
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
    pub fn enter<M: AnyLanes, R: Row>(&self, node: &Node<R>, t_max: M) -> (M, u32) {
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
