//! What is asked of a ray: its nearest hit, or whether there is any.

use super::WideBvh;
use super::constants::RayConstants;
use super::in_flight::{Many, One};
use super::node::{Child, ChildKind};
use super::rays::{Answers, Rays};
use super::traverse::Query;
use crate::accel::batch::RayBatch;
use crate::accel::block::{Nearest, confirmed};
use crate::accel::{Hit, Ray};
use lightshed_lanes::Lanes;

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
    let Confirmed(nearest) = bvh.lanes.run(One::<Confirmed>::new(bvh, &ray));
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
pub struct Any {
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

impl WideBvh {
    /// The nearest hit.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.nearest(ray).hit()
    }

    #[inline(always)]
    pub fn nearest(&self, ray: &Ray) -> Nearest {
        self.lanes.run(One::<Nearest>::new(self, ray))
    }

    /// Whether there is any hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.lanes.run(One::<Any>::new(self, ray))
    }

    #[inline(always)]
    fn many<Q: Query>(&self, rays: impl Rays, count: usize, answers: impl Answers<Q::Answer>) {
        self.lanes.run(Many::<Q, _, _>::new(self, rays, count, answers));
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
