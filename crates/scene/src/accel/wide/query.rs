//! What is asked of a ray: its nearest hit, or whether there is any.

use super::WideBvh;
use super::in_flight::One;
use super::node::{Child, ChildKind};
use super::rays::Rays;
use super::traverse::RayConstants;
use crate::accel::Ray;
use crate::accel::block::{Nearest, confirmed};
use lightshed_lanes::Lanes;

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
