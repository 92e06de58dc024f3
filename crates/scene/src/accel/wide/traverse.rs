//! Rays through the eight-wide tree.
//!
//! Boxes are tested by slabs whose far ends are widened by the test's own rounding error (Ize 2013, *Robust BVH Ray
//! Traversal*), triangles by signed areas in a space sheared along the ray (Woop, Benthin and Wald 2013, *Watertight
//! Ray/Triangle Intersection*). The signed area of an edge is `a·b − c·d`, each product rounded once: rounding is
//! monotonic, so the computed sign is never opposite to that of the exact value, only zero in its place; zero counts
//! as inside. An edge seen from its two triangles has areas that differ in sign alone. So no ray passes between two
//! triangles that share an edge or a vertex bit for bit.
//!
//! A ray visits few nodes, and each visit waits: for the node to come from memory, for the chain of operations on it, for
//! a branch that cannot be predicted. So several rays are in flight at once, a step of each in turn ([`IN_FLIGHT`]), the
//! next node of each is asked for as soon as it is known, and a step decides with masks and selections where it can.
//! A ray's own steps do not depend on its neighbours: its result is the same, bit for bit, in any company.

use super::WideBvh;
use super::node::{Child, ChildKind, Node, TriangleBlock};
use crate::accel::simd::{LaneKernel, Lanes, flip_mask, prefetch_line};
use crate::accel::stack::{Stack, StackMemory};
use crate::accel::{Hit, Ray};
use core::marker::PhantomData;

/// `1 + 2γ(3)`, rounded up: how far the slab test's far end may be off (Ize 2013 §3).
const FAR_WIDENING: f32 = 1.0 + 4.0 * f32::EPSILON;

/// What the tests need of a ray.
///
/// No closures and no iterator adaptors from here on: they are functions of their own, which the compiler does not
/// inline into a caller with other instructions than the crate's, and a call for every operation is the end of speed.
#[derive(Clone, Copy)]
struct RayConstants {
    origin: [f32; 3],
    inverse_direction: [f32; 3],
    /// Row of the node's bounds in which the ray enters, and in which it leaves, along each axis.
    near_row: [usize; 3],
    far_row: [usize; 3],
    /// Exclusive-ors a child's slot to its place on the stack: the slots of a node are laid out by where the children
    /// lie (see [`Node`]), so that far ones come first and the nearest is on top.
    flip: u32,
    /// Axes permuted so that the last is the one along which the direction is longest.
    axes: [usize; 3],
    /// Shear `d[kx] / d[kz]`, `d[ky] / d[kz]`, and `1 / d[kz]`.
    shear: [f32; 3],
}

/// A triangle's corner relative to the ray, sheared so that the ray runs along the last axis.
struct Sheared<L> {
    x: L,
    y: L,
    z: L,
}

impl RayConstants {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let magnitude = [d[0].abs(), d[1].abs(), d[2].abs()];
        let kz = if magnitude[0] > magnitude[1] {
            if magnitude[0] > magnitude[2] { 0 } else { 2 }
        } else if magnitude[1] > magnitude[2] {
            1
        } else {
            2
        };
        const NEXT: [usize; 3] = [1, 2, 0];
        let kx = NEXT[kz];
        let ky = NEXT[kx];
        let inverse = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let inverse_z = inverse[kz];
        let backwards = [
            3 * usize::from(d[0].is_sign_negative()),
            3 * usize::from(d[1].is_sign_negative()),
            3 * usize::from(d[2].is_sign_negative()),
        ];
        Self {
            origin: o,
            inverse_direction: inverse,
            near_row: [backwards[0], 1 + backwards[1], 2 + backwards[2]],
            far_row: [3 - backwards[0], 4 - backwards[1], 5 - backwards[2]],
            flip: 7 ^ (backwards[0] / 3 + backwards[1] / 3 * 2 + backwards[2] / 3 * 4) as u32,
            axes: [kx, ky, kz],
            shear: [d[kx] * inverse_z, d[ky] * inverse_z, inverse_z],
        }
    }

    /// Ray parameter at which the planes of `row` along `axis` are met.
    #[inline(always)]
    fn slab<L: Lanes>(&self, node: &Node, axis: usize, row: usize) -> L {
        let from_origin = L::load(&node.bounds[row]).sub(L::splat(self.origin[axis]));
        from_origin.mul(L::splat(self.inverse_direction[axis]))
    }

    /// Where the ray enters each child's box, and in which it does before `t_max`.
    #[inline(always)]
    fn enter<L: Lanes>(&self, node: &Node, t_max: L) -> (L, u32) {
        // The argument that may be NaN comes first, see `Lanes`.
        let near = self.slab::<L>(node, 2, self.near_row[2]).max(L::splat(0.0));
        let near = self.slab::<L>(node, 1, self.near_row[1]).max(near);
        let near = self.slab::<L>(node, 0, self.near_row[0]).max(near);
        let far = self.slab::<L>(node, 2, self.far_row[2]).min(t_max);
        let far = self.slab::<L>(node, 1, self.far_row[1]).min(far);
        let far = self.slab::<L>(node, 0, self.far_row[0]).min(far);
        (near, near.less_equal(far.mul(L::splat(FAR_WIDENING))))
    }

    #[inline(always)]
    fn corner<L: Lanes>(&self, corner: &[[f32; 8]; 3]) -> Sheared<L> {
        let [kx, ky, kz] = self.axes;
        let z = L::load(&corner[kz]).sub(L::splat(self.origin[kz]));
        let x = L::load(&corner[kx])
            .sub(L::splat(self.origin[kx]))
            .sub(L::splat(self.shear[0]).mul(z));
        let y = L::load(&corner[ky])
            .sub(L::splat(self.origin[ky]))
            .sub(L::splat(self.shear[1]).mul(z));
        Sheared { x, y, z }
    }

    /// Ray parameter, weights of the first and second vertex, and the triangles hit within `(0, t_max)`.
    #[inline(always)]
    fn triangles<L: Lanes>(&self, block: &TriangleBlock, t_max: L) -> (L, L, L, u32) {
        let a = self.corner::<L>(&block.vertices[0]);
        let b = self.corner::<L>(&block.vertices[1]);
        let c = self.corner::<L>(&block.vertices[2]);
        // Products rounded on their own, never fused: the antisymmetry of the areas rests on it.
        let area_a = c.x.mul(b.y).sub(c.y.mul(b.x));
        let area_b = a.x.mul(c.y).sub(a.y.mul(c.x));
        let area_c = b.x.mul(a.y).sub(b.y.mul(a.x));
        let zero = L::splat(0.0);
        let least = area_a.min(area_b.min(area_c));
        let greatest = area_a.max(area_b.max(area_c));
        let one_sign = zero.less_equal(least) | greatest.less_equal(zero);
        // A determinant of zero (a triangle seen edge-on, or without area) gives NaN or ∞ below, which no
        // comparison passes.
        let inverse_determinant = L::splat(1.0).div(area_a.add(area_b.add(area_c)));
        let z = area_a.mul(a.z).add(area_b.mul(b.z).add(area_c.mul(c.z)));
        let t = z.mul(L::splat(self.shear[2])).mul(inverse_determinant);
        let hit = one_sign & zero.less(t) & t.less(t_max);
        (
            t,
            area_a.mul(inverse_determinant),
            area_b.mul(inverse_determinant),
            hit,
        )
    }
}

/// Rays in flight at once. With four, large scenes are a few per cent slower; sixteen gain nothing. A power of two.
const IN_FLIGHT: usize = 8;

/// A question about a ray, answered step by step.
trait Query: Copy {
    /// The answer.
    type Answer: Copy;
    /// What an answer is before any step.
    fn start(ray: &Ray) -> Self;
    /// Takes in a leaf; true if the answer is settled.
    fn leaf<L: Lanes>(&mut self, bvh: &WideBvh, ray: &Ray, constants: &RayConstants, child: Child) -> bool;
    /// Nothing that begins beyond this ray parameter matters any more.
    fn t_max(&self) -> f32;
    /// Whether nearer children are to be visited first.
    const ORDERED: bool;
    fn answer(&self) -> Self::Answer;
}

/// The nearest hit.
#[derive(Clone, Copy)]
struct Nearest {
    t: f32,
    primitive: u32,
    weights: [f32; 2],
}

impl Query for Nearest {
    type Answer = Option<Hit>;
    const ORDERED: bool = true;

    #[inline(always)]
    fn start(ray: &Ray) -> Self {
        Self {
            t: ray.t_max,
            primitive: u32::MAX,
            weights: [0.0; 2],
        }
    }

    #[inline(always)]
    fn leaf<L: Lanes>(&mut self, bvh: &WideBvh, ray: &Ray, constants: &RayConstants, child: Child) -> bool {
        if child.kind() == ChildKind::Triangles {
            let block = &bvh.blocks[child.index()];
            let (t, a, b, hit) = constants.triangles::<L>(block, L::splat(self.t));
            let nearest = t.least_of(hit);
            let lane = (t.equal(nearest) & hit).trailing_zeros() as usize & 7;
            // Selections in place of a branch on whether there was a hit, which is as good as random.
            let found = hit != 0;
            let (a, b) = (a.store()[lane], b.store()[lane]);
            self.t = if found { nearest.first() } else { self.t };
            self.primitive = if found {
                block.primitives[lane]
            } else {
                self.primitive
            };
            self.weights = if found { [a, b] } else { self.weights };
        } else if let Some(t) = bvh.spheres[child.index()].intersect(ray.origin, ray.direction, self.t) {
            self.t = t;
            self.primitive = bvh.first_sphere + child.index() as u32;
            self.weights = [1.0, 0.0];
        }
        false
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t
    }

    #[inline(always)]
    fn answer(&self) -> Option<Hit> {
        let [a, b] = self.weights;
        let barycentric = [b, (1.0 - a - b).max(0.0)];
        (self.primitive != u32::MAX).then_some(Hit {
            t: self.t,
            primitive: self.primitive,
            barycentric,
        })
    }
}

/// Whether there is any hit.
#[derive(Clone, Copy)]
struct Any {
    t_max: f32,
    found: bool,
}

impl Query for Any {
    type Answer = bool;
    const ORDERED: bool = false;

    #[inline(always)]
    fn start(ray: &Ray) -> Self {
        Self {
            t_max: ray.t_max,
            found: false,
        }
    }

    #[inline(always)]
    fn leaf<L: Lanes>(&mut self, bvh: &WideBvh, ray: &Ray, constants: &RayConstants, child: Child) -> bool {
        self.found = if child.kind() == ChildKind::Triangles {
            constants
                .triangles::<L>(&bvh.blocks[child.index()], L::splat(self.t_max))
                .3
                != 0
        } else {
            bvh.spheres[child.index()]
                .intersect(ray.origin, ray.direction, self.t_max)
                .is_some()
        };
        self.found
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn answer(&self) -> bool {
        self.found
    }
}

/// A ray on its way.
#[derive(Clone, Copy)]
struct Traversal<Q> {
    query: Q,
    constants: RayConstants,
    child: Child,
    /// Which of the rays asked about this is.
    ray: usize,
}

impl<Q: Query> Traversal<Q> {
    #[inline(always)]
    fn new(ray: &Ray, index: usize) -> Self {
        Self {
            query: Q::start(ray),
            constants: RayConstants::new(ray),
            child: ROOT,
            ray: index,
        }
    }

    /// Visits one child; true if the ray is done.
    #[inline(always)]
    fn step<L: Lanes>(&mut self, stack: &mut Stack<'_>, bvh: &WideBvh, rays: &[Ray]) -> bool {
        if self.child.kind() == ChildKind::Node {
            let node = &bvh.nodes[self.child.index()];
            let (near, hit) = self.constants.enter(node, L::splat(self.query.t_max()));
            if hit != 0 {
                // The nearest is visited next, or about the nearest; the others wait, about in order.
                let flip = self.constants.flip;
                let order = flip_mask(hit, flip);
                let next = if Q::ORDERED {
                    (near.equal(near.least_of(hit)) & hit).trailing_zeros() ^ flip
                } else {
                    order.ilog2()
                };
                stack.push(
                    L::load(bytemuck::cast_ref(&node.children)),
                    near,
                    order & !(1 << next),
                    flip,
                );
                self.child = node.children[(next ^ flip) as usize & 7];
                self.prefetch(bvh);
                return false;
            }
        } else if self
            .query
            .leaf::<L>(bvh, &rays[self.ray], &self.constants, self.child)
        {
            return true;
        }
        loop {
            let Some((child, entered)) = stack.pop() else {
                return true;
            };
            if entered <= self.query.t_max() {
                self.child = Child(child);
                self.prefetch(bvh);
                return false;
            }
        }
    }

    /// Asks for what the next step reads.
    #[inline(always)]
    fn prefetch(&self, bvh: &WideBvh) {
        // Both addresses, and a selection: which it is cannot be predicted. Nothing is read here.
        let index = self.child.index();
        let node = bvh
            .nodes
            .as_ptr()
            .cast::<u8>()
            .wrapping_add(index * size_of::<Node>());
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
    }
}

const ROOT: Child = Child(0);

struct One<'a, Q> {
    bvh: &'a WideBvh,
    ray: &'a Ray,
    query: PhantomData<Q>,
}

impl<Q: Query> LaneKernel for One<'_, Q> {
    type Output = Q::Answer;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Q::Answer {
        let rays = core::slice::from_ref(self.ray);
        let mut traversal = Traversal::<Q>::new(self.ray, 0);
        let mut memory = StackMemory::new();
        let mut stack = Stack::new(&mut memory);
        while !traversal.step::<L>(&mut stack, self.bvh, rays) {}
        traversal.query.answer()
    }
}

struct Many<'a, Q: Query> {
    bvh: &'a WideBvh,
    rays: &'a [Ray],
    answers: &'a mut [Q::Answer],
}

impl<Q: Query> LaneKernel for Many<'_, Q> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { bvh, rays, answers } = self;
        let mut flying = rays.len().min(answers.len()).min(IN_FLIGHT);
        let mut next = flying;
        let Some(first) = rays.first() else { return };
        let mut traversals = [Traversal::<Q>::new(first, 0); IN_FLIGHT];
        for (index, ray) in rays.iter().enumerate().take(flying) {
            traversals[index] = Traversal::new(ray, index);
        }
        let mut memory = [const { StackMemory::new() }; IN_FLIGHT];
        let mut stacks = memory.each_mut().map(Stack::new);
        // Places of the traversals still in flight: the first `flying`.
        let mut places = [0; IN_FLIGHT];
        for (number, place) in places.iter_mut().enumerate() {
            *place = number;
        }
        while flying > 0 {
            let mut turn = 0;
            while turn < flying {
                let place = places[turn] % IN_FLIGHT;
                let (traversal, stack) = (&mut traversals[place], &mut stacks[place]);
                if traversal.step::<L>(stack, bvh, rays) {
                    answers[traversal.ray] = traversal.query.answer();
                    if next < rays.len() {
                        *traversal = Traversal::new(&rays[next], next);
                        stack.clear();
                        next += 1;
                    } else {
                        flying -= 1;
                        places.swap(turn, flying);
                        continue;
                    }
                }
                turn += 1;
            }
        }
    }
}

impl WideBvh {
    /// The nearest hit.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.lanes.run(One {
            bvh: self,
            ray,
            query: PhantomData::<Nearest>,
        })
    }

    /// Whether there is any hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.lanes.run(One {
            bvh: self,
            ray,
            query: PhantomData::<Any>,
        })
    }

    /// The nearest hit of each ray.
    #[inline]
    pub fn intersect_many(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let count = rays.len().min(hits.len());
        self.lanes.run(Many::<Nearest> {
            bvh: self,
            rays: &rays[..count],
            answers: hits,
        });
    }

    /// Whether each ray has any hit.
    #[inline]
    pub fn occluded_many(&self, rays: &[Ray], occluded: &mut [bool]) {
        let count = rays.len().min(occluded.len());
        self.lanes.run(Many::<Any> {
            bvh: self,
            rays: &rays[..count],
            answers: occluded,
        });
    }
}
