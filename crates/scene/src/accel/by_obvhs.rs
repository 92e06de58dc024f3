//! Trees that the crate obvhs builds and traverses, for comparison.

use super::triangle::intersect_ahead;
use super::{AcceleratorKind, Hit, Ray, Sphere, shapes};
use glam::{Vec3, Vec3A};
use lightshed_bvh::{Preset, Primitive};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use std::time::Duration;

enum Kind {
    Two(Bvh2),
    Eight(CwBvh),
}

/// A tree of obvhs, and what its leaves number.
pub(super) struct ObvhsTree {
    kind: Kind,
    triangles: Vec<[Vec3; 3]>,
    spheres: Vec<Sphere>,
}

impl ObvhsTree {
    /// Builds the compressed tree for `Cwbvh`, else the binary one.
    pub(super) fn build(
        triangles: &[[Vec3; 3]],
        spheres: &[Sphere],
        kind: AcceleratorKind,
        preset: Preset,
    ) -> Self {
        let mut time = Duration::ZERO;
        let boxes: Vec<Aabb> = shapes(triangles, spheres)
            .map(|shape| shape.bounds())
            .map(|bounds| Aabb::new(bounds.min.into(), bounds.max.into()))
            .collect();
        Self {
            kind: if kind == AcceleratorKind::Cwbvh {
                Kind::Eight(build_cwbvh(&boxes, parameters(preset, 3), &mut time))
            } else {
                Kind::Two(build_bvh2(&boxes, parameters(preset, 8), &mut time))
            },
            triangles: triangles.to_vec(),
            spheres: spheres.to_vec(),
        }
    }

    pub(super) fn intersect(&self, ray: &Ray) -> Option<Hit> {
        match &self.kind {
            Kind::Two(bvh) => self.nearest(ray, &bvh.primitive_indices, |ray, test| {
                bvh.ray_traverse(ray, &mut RayHit::none(), test);
            }),
            Kind::Eight(bvh) => self.nearest(ray, &bvh.primitive_indices, |ray, test| {
                bvh.ray_traverse(ray, &mut RayHit::none(), test);
            }),
        }
    }

    pub(super) fn occluded(&self, ray: &Ray) -> bool {
        let towards = to_obvhs(ray).0;
        match &self.kind {
            Kind::Two(bvh) => !bvh.ray_traverse_miss(towards, self.test(ray, &bvh.primitive_indices)),
            Kind::Eight(bvh) => !bvh.ray_traverse_miss(towards, self.test(ray, &bvh.primitive_indices)),
        }
    }

    #[inline(always)]
    fn test_primitive(&self, ray: &Ray, primitive: u32, t_max: f32) -> Option<Hit> {
        match self.triangles.get(primitive as usize) {
            Some(corners) => intersect_ahead(ray, corners, primitive, t_max),
            None => self.spheres[primitive as usize - self.triangles.len()]
                .intersect(ray.origin, ray.direction, t_max)
                .map(|t| Hit {
                    t,
                    primitive,
                    barycentric: [0.0; 2],
                }),
        }
    }

    /// The test that obvhs calls for each primitive, in units of the normalised ray.
    #[inline(always)]
    fn test<'a>(&'a self, ray: &'a Ray, order: &'a [u32]) -> impl FnMut(&ObvhsRay, usize) -> f32 + 'a {
        let length = to_obvhs(ray).1;
        move |_, slot| {
            self.test_primitive(ray, order[slot], ray.t_max)
                .map_or(f32::INFINITY, |hit| hit.t * length)
        }
    }

    #[inline(always)]
    fn nearest(
        &self,
        ray: &Ray,
        order: &[u32],
        traverse: impl FnOnce(ObvhsRay, &mut dyn FnMut(&ObvhsRay, usize) -> f32),
    ) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let (normalised, length) = to_obvhs(ray);
        traverse(normalised, &mut |_, slot| {
            let t_max = best.map_or(ray.t_max, |hit| hit.t);
            match self.test_primitive(ray, order[slot], t_max) {
                Some(hit) => {
                    best = Some(hit);
                    hit.t * length
                }
                None => f32::INFINITY,
            }
        });
        best
    }
}

/// obvhs takes direction components below `f32::EPSILON` for zero, so it gets the direction
/// normalised; also the length of the direction before.
#[inline(always)]
fn to_obvhs(ray: &Ray) -> (ObvhsRay, f32) {
    let length = ray.direction.length();
    let direction = Vec3A::from(ray.direction / length);
    // The far end is widened, because the primitive's own test decides at the end of the segment.
    (
        ObvhsRay::new(
            Vec3A::from(ray.origin),
            direction,
            0.0,
            ray.t_max * length * 1.000_001,
        ),
        length,
    )
}

fn parameters(preset: Preset, max_prims_per_leaf: u32) -> BvhBuildParams {
    let of_preset = match preset {
        Preset::Fastest => BvhBuildParams::fastest_build(),
        Preset::Fast => BvhBuildParams::very_fast_build(),
        Preset::Medium => BvhBuildParams::medium_build(),
        Preset::High | Preset::Best => BvhBuildParams::slow_build(),
    };
    // Splitting large triangles gained nothing in the scenes of `docs/performance-rays.md`, and
    // costs time and memory.
    BvhBuildParams {
        max_prims_per_leaf,
        pre_split: false,
        ..of_preset
    }
}
