//! Rays through the eight-wide tree.
//!
//! Boxes are tested by slabs whose far ends are widened by the test's own rounding error (Ize 2013,
//! *Robust BVH Ray Traversal*), triangles as [`crate::accel::block`] says.
//!
//! A ray visits few nodes, and each visit waits: for the node to arrive from memory, for the chain
//! of operations on it, for a branch that cannot be predicted. So several rays are in flight at
//! once, a step of each in turn ([`IN_FLIGHT`]). The next node of each is prefetched as soon as it
//! is known, and a step uses masks and selections instead of branches where it can. A ray's own
//! steps do not depend on its neighbours: its result is the same, bit for bit, in any batch.

use super::WideBvh;
use super::node::{Child, ChildKind, Node};
use crate::accel::batch::{HitBatch, RayBatch};
use crate::accel::block::{Nearest, TriangleBlock, TriangleRay, confirmed};
use crate::accel::stack::{Stack, StackMemory};
use crate::accel::{Hit, Ray};
use core::marker::PhantomData;
use lightshed_lanes::{LaneKernel, LaneMask, Lanes, flip_mask, prefetch_line};

/// `1 + 2γ(3)`, rounded up: how far the slab test's far end may be off (Ize 2013 §3).
pub const FAR_WIDENING: f32 = 1.0 + 4.0 * f32::EPSILON;

/// What the tests need of a ray.
///
/// No closures and no iterator adaptors from here on: they are functions of their own, which the
/// compiler does not inline into a caller with other instructions than the crate's, and a call for
/// every operation is the end of speed.
#[derive(Clone, Copy)]
pub struct RayConstants {
    triangle: TriangleRay,
    inverse_direction: [f32; 3],
    /// Exclusive-ors a child's slot to its place on the stack: the slots of a node are laid out by
    /// where the children lie (see [`Node`]), so that far ones come first and the nearest is on
    /// top. Bit `a` says whether the ray goes to the positive side of axis `a`: it is the row of
    /// the bounds in which the ray leaves.
    flip: u32,
}

impl RayConstants {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let inverse_direction = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let forwards = |axis: usize| u32::from(d[axis].is_sign_positive()) << axis;
        Self {
            triangle: TriangleRay::new(ray, inverse_direction),
            inverse_direction,
            flip: forwards(0) | forwards(1) | forwards(2),
        }
    }

    /// Ray parameters at which the planes along `axis` are met: the nearer ones, and the farther.
    #[inline(always)]
    fn slabs<L: Lanes>(&self, node: &Node, axis: usize) -> [L; 2] {
        let far = (self.flip >> axis & 1) as usize;
        let origin = L::splat(self.triangle.origin[axis]);
        let inverse = L::splat(self.inverse_direction[axis]);
        [
            (L::load(&node.bounds[axis][far ^ 1]) - origin) * inverse,
            (L::load(&node.bounds[axis][far]) - origin) * inverse,
        ]
    }

    /// Where the ray enters each child's box, and in which it does before `t_max`.
    #[inline(always)]
    fn enter<L: Lanes>(&self, node: &Node, t_max: L) -> (L, u32) {
        // The argument that may be NaN comes first, see `Lanes`.
        let [x, y, z] = [
            self.slabs::<L>(node, 0),
            self.slabs::<L>(node, 1),
            self.slabs::<L>(node, 2),
        ];
        let near = x[0].max(y[0].max(z[0].max(L::splat(0.0))));
        let far = x[1].min(y[1].min(z[1].min(t_max)));
        (near, near.less_equal(far * L::splat(FAR_WIDENING)).bits())
    }
}

/// Rays in flight at once. With four, large scenes are a few per cent slower; sixteen gain nothing.
/// A power of two.
const IN_FLIGHT: usize = 8;

/// Where rays come from.
pub trait Rays: Copy {
    fn get(self, index: usize) -> Ray;
}

impl Rays for &[Ray] {
    #[inline(always)]
    fn get(self, index: usize) -> Ray {
        self[index]
    }
}

impl Rays for &RayBatch {
    #[inline(always)]
    fn get(self, index: usize) -> Ray {
        self.get(index)
    }
}

/// Where answers go.
pub trait Answers<A> {
    fn set(&mut self, index: usize, answer: A);
}

impl Answers<bool> for &mut [bool] {
    #[inline(always)]
    fn set(&mut self, index: usize, answer: bool) {
        self[index] = answer;
    }
}

impl Answers<Nearest> for &mut [Option<Hit>] {
    #[inline(always)]
    fn set(&mut self, index: usize, nearest: Nearest) {
        self[index] = nearest.hit();
    }
}

impl Answers<Nearest> for &mut HitBatch {
    #[inline(always)]
    fn set(&mut self, index: usize, nearest: Nearest) {
        HitBatch::set(self, index, nearest.hit());
    }
}

/// One bit a ray.
impl Answers<bool> for &mut u64 {
    #[inline(always)]
    fn set(&mut self, index: usize, answer: bool) {
        **self |= u64::from(answer) << (index % 64);
    }
}

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

impl Query for Nearest {
    type Answer = Self;
    const ORDERED: bool = true;

    #[inline(always)]
    fn start(ray: &Ray) -> Self {
        Self::none(ray)
    }

    #[inline(always)]
    fn leaf<L: Lanes>(
        &mut self,
        bvh: &WideBvh,
        rays: impl Rays,
        index: usize,
        constants: &RayConstants,
        child: Child,
    ) -> bool {
        if child.kind() == ChildKind::Triangles {
            self.take_block::<L>(&constants.triangle, &bvh.blocks[child.index()]);
        } else if child.kind() == ChildKind::Instance {
            self.take_instance(bvh, &rays.get(index), child.index());
        } else {
            let ray = rays.get(index);
            let sphere = &bvh.spheres[child.index()];
            let primitive = bvh.first_sphere + child.index() as u32;
            let bound = self.bound_of_other(primitive);
            if let Some(t) = sphere.intersect(ray.origin, ray.direction, bound) {
                self.take_sphere(t, primitive);
            }
        }
        false
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t
    }

    #[inline(always)]
    fn answer(self, bvh: &WideBvh, rays: impl Rays, index: usize, constants: &RayConstants) -> Self {
        if self.is_doubtful(constants.triangle.doubtful(bvh.reach)) {
            confirmed_nearest(bvh, rays.get(index))
        } else {
            self
        }
    }
}

impl Nearest {
    /// Takes in the nearest hit within an instance.
    #[inline(never)]
    fn take_instance(&mut self, bvh: &WideBvh, ray: &Ray, instance: usize) {
        let (object, mut local, first) = bvh.instances.enter(instance, ray);
        local.t_max = self.bound_of_other(first);
        self.take_other(object.nearest(&local), first);
    }
}

/// The nearest hit whose plane is ahead. The loop of [`Nearest`] carries nothing for needles, which
/// costs every ray some per cent: the few rays whose nearest hit is doubtful start anew.
#[cold]
#[inline(never)]
pub fn confirmed_nearest(bvh: &WideBvh, ray: Ray) -> Nearest {
    let Confirmed(nearest) = bvh.lanes.run(One {
        bvh,
        ray: &ray,
        query: PhantomData::<Confirmed>,
    });
    nearest
}

/// [`Nearest`] that looks at the planes of doubtful hits.
#[derive(Clone, Copy)]
struct Confirmed(Nearest);

impl Query for Confirmed {
    type Answer = Self;
    const ORDERED: bool = true;

    #[inline(always)]
    fn start(ray: &Ray) -> Self {
        Self(Nearest::none(ray))
    }

    #[inline(always)]
    fn leaf<L: Lanes>(
        &mut self,
        bvh: &WideBvh,
        rays: impl Rays,
        index: usize,
        constants: &RayConstants,
        child: Child,
    ) -> bool {
        if child.kind() == ChildKind::Triangles {
            let (ray, block) = (&constants.triangle, &bvh.blocks[child.index()]);
            let doubtful = ray.doubtful(bvh.reach);
            self.0.take_confirmed::<L>(ray, &rays.get(index), block, doubtful);
            return false;
        }
        self.0.leaf::<L>(bvh, rays, index, constants, child)
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.0.t
    }

    #[inline(always)]
    fn answer(self, _: &WideBvh, _: impl Rays, _: usize, _: &RayConstants) -> Self {
        self
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
    fn leaf<L: Lanes>(
        &mut self,
        bvh: &WideBvh,
        rays: impl Rays,
        index: usize,
        constants: &RayConstants,
        child: Child,
    ) -> bool {
        self.found = if child.kind() == ChildKind::Triangles {
            let (ray, block) = (&constants.triangle, &bvh.blocks[child.index()]);
            let (hit, near) = ray.hits::<L>(block, self.t_max, ray.doubtful(bvh.reach));
            hit != near || near != 0 && confirmed(rays.get(index), block, near) != 0
        } else if child.kind() == ChildKind::Instance {
            let (object, local, _) = bvh.instances.enter(child.index(), &rays.get(index));
            object.occluded(&local)
        } else {
            let ray = rays.get(index);
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
    fn answer(self, _: &WideBvh, _: impl Rays, _: usize, _: &RayConstants) -> bool {
        self.found
    }
}

/// A ray on its way.
#[derive(Clone, Copy)]
pub struct Traversal<Q> {
    pub query: Q,
    constants: RayConstants,
    child: Child,
    /// Index of the ray in the query.
    ray: usize,
}

impl<Q: Query> Traversal<Q> {
    #[inline(always)]
    fn new(ray: &Ray, index: usize) -> Self {
        Self::below(ROOT, Q::start(ray), ray, index)
    }

    /// Of what lies in `child`; for the other parts of the tree, `query` is answered.
    #[inline(always)]
    pub fn below(child: Child, query: Q, ray: &Ray, index: usize) -> Self {
        Self {
            query,
            constants: RayConstants::new(ray),
            child,
            ray: index,
        }
    }

    #[inline(always)]
    fn answer(&self, bvh: &WideBvh, rays: impl Rays) -> Q::Answer {
        self.query.answer(bvh, rays, self.ray, &self.constants)
    }

    /// Visits one child; true if the ray is done.
    #[inline(always)]
    pub fn step<L: Lanes>(&mut self, stack: &mut Stack<'_>, bvh: &WideBvh, rays: impl Rays) -> bool {
        if self.child.kind() == ChildKind::Node {
            let node = &bvh.nodes[self.child.index()];
            let (near, hit) = self.constants.enter(node, L::splat(self.query.t_max()));
            if hit != 0 {
                // The nearest is visited next, or for any hit the approximately nearest block if
                // there is one; the others wait in approximate order.
                let flip = self.constants.flip;
                let order = flip_mask(hit, flip);
                let children = L::load(bytemuck::cast_ref(&node.children));
                let next = if Q::ORDERED {
                    (near.equal(near.least_of(hit)).bits() & hit).trailing_zeros() ^ flip
                } else {
                    let blocks = flip_mask(Child::blocks(children) & hit, flip);
                    (if blocks != 0 { blocks } else { order }).ilog2()
                };
                stack.push(children, near, order & !(1 << next), flip);
                self.child = node.children[(next ^ flip) as usize & 7];
                self.prefetch(bvh);
                return false;
            }
        } else if self
            .query
            .leaf::<L>(bvh, rays, self.ray, &self.constants, self.child)
        {
            return true;
        }
        loop {
            let Some((child, entered)) = stack.pop() else {
                return true;
            };
            // Triangles in the plane of a box may be hit a little before the ray enters it.
            if entered <= self.query.t_max() * FAR_WIDENING {
                self.child = Child(child);
                self.prefetch(bvh);
                return false;
            }
        }
    }

    /// Prefetches what the next step reads.
    #[inline(always)]
    fn prefetch(&self, bvh: &WideBvh) {
        // Computes both addresses, then selects one, because the choice is unpredictable. Nothing
        // is read here.
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
        traversal.answer(self.bvh, rays)
    }
}

/// Several rays, of which some are in flight at any time.
pub struct Many<'a, Q, R, A> {
    bvh: &'a WideBvh,
    rays: R,
    count: usize,
    answers: A,
    query: PhantomData<Q>,
}

impl<'a, R, A> Many<'a, Nearest, R, A> {
    /// The nearest hits of the first `count` rays.
    #[inline(always)]
    pub fn nearest(bvh: &'a WideBvh, rays: R, count: usize, answers: A) -> Self {
        Self {
            bvh,
            rays,
            count,
            answers,
            query: PhantomData,
        }
    }
}

impl<Q: Query, R: Rays, A: Answers<Q::Answer>> LaneKernel for Many<'_, Q, R, A> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self {
            bvh,
            rays,
            count,
            mut answers,
            ..
        } = self;
        if count == 0 {
            return;
        }
        let mut flying = count.min(IN_FLIGHT);
        let mut next = flying;
        let mut traversals = [Traversal::<Q>::new(&rays.get(0), 0); IN_FLIGHT];
        for (index, traversal) in traversals.iter_mut().enumerate().take(flying).skip(1) {
            *traversal = Traversal::new(&rays.get(index), index);
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
                    answers.set(traversal.ray, traversal.answer(bvh, rays));
                    if next < count {
                        *traversal = Traversal::new(&rays.get(next), next);
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
        self.nearest(ray).hit()
    }

    #[inline(always)]
    fn nearest(&self, ray: &Ray) -> Nearest {
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

    #[inline(always)]
    fn many<Q: Query>(&self, rays: impl Rays, count: usize, answers: impl Answers<Q::Answer>) {
        self.lanes.run(Many {
            bvh: self,
            rays,
            count,
            answers,
            query: PhantomData::<Q>,
        });
    }

    /// The nearest hit of each ray.
    #[inline]
    pub fn intersect_many(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.many::<Nearest>(rays, rays.len().min(hits.len()), hits);
    }

    /// Whether each ray has any hit.
    #[inline]
    pub fn occluded_many(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.many::<Any>(rays, rays.len().min(occluded.len()), occluded);
    }

    /// Whether each of the first `count` rays has any hit: bit `i` for ray `i`.
    #[inline]
    pub fn occluded_batch(&self, rays: &RayBatch, count: usize) -> u64 {
        let mut occluded = 0;
        self.many::<Any>(rays, count.min(RayBatch::CAPACITY), &mut occluded);
        occluded
    }
}
