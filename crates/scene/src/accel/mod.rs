//! Ray queries: the nearest hit, and whether there is any.
//!
//! [`Accelerator`] holds one of three trees over the same primitives. The default is this crate's
//! own, with eight full-precision boxes a node and eight triangles a leaf tested at once, collapsed
//! from a binary tree of the crate `lightshed-bvh`; the other two are built and traversed by obvhs,
//! to be measured against. Of equal distances the hit of the lowest index counts, so that what this
//! crate's tree finds does not depend on how it was built.

mod batch;
mod block;
mod flat;
mod ray;
mod sphere;
mod stack;
mod triangle;
mod wide;

#[cfg(test)]
mod tests;

pub use batch::{HitBatch, RayBatch};
pub use ray::{Hit, Ray};
pub use sphere::Sphere;
pub use triangle::intersect_triangle;

use flat::Flat;
use glam::{Vec3, Vec3A};
use lightshed_bvh::{Bounds, Bvh, Preset, Primitive};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use std::time::Duration;
use wide::{Primitives, WideBvh};

/// Which tree rays are traced through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AcceleratorKind {
    /// This crate's eight-wide tree; for some dozens of triangles, none at all.
    #[default]
    Wide,
    /// obvhs' binary tree.
    Bvh2,
    /// obvhs' compressed eight-wide tree.
    Cwbvh,
}

enum Tree {
    Wide(WideBvh),
    Flat(Flat),
    Bvh2(Bvh2),
    Cwbvh(CwBvh),
    Empty,
}

/// A tree over triangles and spheres. Primitives are numbered triangles first, then spheres.
pub struct Accelerator {
    tree: Tree,
    /// What obvhs' traversals test; empty with the wide tree, which has its own copies.
    triangles: Vec<[Vec3; 3]>,
    spheres: Vec<Sphere>,
}

impl Accelerator {
    /// Builds a tree. Coordinates must be finite and radii positive (`Scene` checks); no primitive
    /// at all is an empty scene that no ray hits.
    pub fn build(triangles: &[[Vec3; 3]], spheres: &[Sphere], kind: AcceleratorKind, preset: Preset) -> Self {
        let kept = if kind == AcceleratorKind::Wide {
            (Vec::new(), Vec::new())
        } else {
            (triangles.to_vec(), spheres.to_vec())
        };
        let tree = if triangles.is_empty() && spheres.is_empty() {
            Tree::Empty
        } else {
            build_tree(triangles, spheres, kind, preset)
        };
        Self {
            tree,
            triangles: kept.0,
            spheres: kept.1,
        }
    }

    /// The nearest hit in the open segment.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        match &self.tree {
            Tree::Wide(bvh) => bvh.intersect(ray),
            Tree::Flat(flat) => flat.intersect(ray),
            Tree::Bvh2(bvh) => self.nearest_by_obvhs(ray, &bvh.primitive_indices, |ray, test| {
                bvh.ray_traverse(ray, &mut RayHit::none(), test);
            }),
            Tree::Cwbvh(bvh) => self.nearest_by_obvhs(ray, &bvh.primitive_indices, |ray, test| {
                bvh.ray_traverse(ray, &mut RayHit::none(), test);
            }),
            Tree::Empty => None,
        }
    }

    /// Whether anything lies in the open segment.
    pub fn occluded(&self, ray: &Ray) -> bool {
        match &self.tree {
            Tree::Wide(bvh) => bvh.occluded(ray),
            Tree::Flat(flat) => flat.occluded(ray),
            Tree::Bvh2(bvh) => {
                !bvh.ray_traverse_miss(to_obvhs(ray).0, self.obvhs_test(ray, &bvh.primitive_indices))
            }
            Tree::Cwbvh(bvh) => {
                !bvh.ray_traverse_miss(to_obvhs(ray).0, self.obvhs_test(ray, &bvh.primitive_indices))
            }
            Tree::Empty => false,
        }
    }

    /// The nearest hit of each ray: as [`Accelerator::intersect`] for each, and faster. The shorter
    /// slice's length counts.
    pub fn intersect_many(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        match &self.tree {
            Tree::Wide(bvh) => bvh.intersect_many(rays, hits),
            Tree::Flat(flat) => {
                let (mut batch, mut found) = (RayBatch::NOWHERE, HitBatch::NONE);
                for (rays, hits) in rays
                    .chunks(RayBatch::CAPACITY)
                    .zip(hits.chunks_mut(RayBatch::CAPACITY))
                {
                    batch.fill(rays);
                    flat.intersect_batch(&batch, rays.len(), &mut found);
                    for (index, hit) in hits.iter_mut().enumerate().take(rays.len()) {
                        *hit = found.get(index);
                    }
                }
            }
            _ => rays
                .iter()
                .zip(hits)
                .for_each(|(ray, hit)| *hit = self.intersect(ray)),
        }
    }

    /// Whether anything lies in each open segment: as [`Accelerator::occluded`] for each, and
    /// faster. The shorter slice's length counts.
    pub fn occluded_many(&self, rays: &[Ray], occluded: &mut [bool]) {
        match &self.tree {
            Tree::Wide(bvh) => bvh.occluded_many(rays, occluded),
            Tree::Flat(flat) => {
                let mut batch = RayBatch::NOWHERE;
                for (rays, occluded) in rays
                    .chunks(RayBatch::CAPACITY)
                    .zip(occluded.chunks_mut(RayBatch::CAPACITY))
                {
                    batch.fill(rays);
                    let bits = flat.occluded_batch(&batch, rays.len());
                    for (index, occluded) in occluded.iter_mut().enumerate().take(rays.len()) {
                        *occluded = bits >> index & 1 == 1;
                    }
                }
            }
            _ => rays
                .iter()
                .zip(occluded)
                .for_each(|(ray, occluded)| *occluded = self.occluded(ray)),
        }
    }

    /// The nearest hit of each of the first `count` rays of a batch, as [`Accelerator::intersect`]
    /// finds it.
    pub fn intersect_batch(&self, rays: &RayBatch, count: usize, hits: &mut HitBatch) {
        match &self.tree {
            Tree::Wide(bvh) => bvh.intersect_batch(rays, count, hits),
            Tree::Flat(flat) => flat.intersect_batch(rays, count, hits),
            _ => {
                for index in 0..count.min(RayBatch::CAPACITY) {
                    hits.set(index, self.intersect(&rays.get(index)));
                }
            }
        }
    }

    /// Whether anything lies in the segments of each of the first `count` rays of a batch: bit `i`
    /// for ray `i`.
    pub fn occluded_batch(&self, rays: &RayBatch, count: usize) -> u64 {
        match &self.tree {
            Tree::Wide(bvh) => bvh.occluded_batch(rays, count),
            Tree::Flat(flat) => flat.occluded_batch(rays, count),
            _ => (0..count.min(RayBatch::CAPACITY)).fold(0, |occluded, index| {
                occluded | u64::from(self.occluded(&rays.get(index))) << index
            }),
        }
    }

    /// Whether rays go through a tree; few triangles have none.
    pub fn has_tree(&self) -> bool {
        !matches!(self.tree, Tree::Flat(_) | Tree::Empty)
    }

    /// Bytes of what rays of the kind `Wide` are traced through, copies of the triangles included;
    /// 0 for the others.
    pub fn wide_bytes(&self) -> usize {
        match &self.tree {
            Tree::Wide(bvh) => bvh.bytes(),
            Tree::Flat(flat) => flat.bytes(),
            _ => 0,
        }
    }

    #[inline(always)]
    fn test_primitive(&self, ray: &Ray, primitive: u32, t_max: f32) -> Option<Hit> {
        match self.triangles.get(primitive as usize) {
            Some(corners) => intersect_triangle(ray, corners, primitive, t_max),
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
    fn obvhs_test<'a>(&'a self, ray: &'a Ray, order: &'a [u32]) -> impl FnMut(&ObvhsRay, usize) -> f32 + 'a {
        let length = to_obvhs(ray).1;
        move |_, slot| {
            self.test_primitive(ray, order[slot], ray.t_max)
                .map_or(f32::INFINITY, |hit| hit.t * length)
        }
    }

    #[inline(always)]
    fn nearest_by_obvhs(
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
    // The far end is widened, since the primitive's own test decides at the end of the segment.
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

fn build_tree(triangles: &[[Vec3; 3]], spheres: &[Sphere], kind: AcceleratorKind, preset: Preset) -> Tree {
    let mut time = Duration::ZERO;
    let boxes = || -> Vec<Aabb> {
        let corners = |b: Bounds| Aabb::new(b.min.into(), b.max.into());
        shapes(triangles, spheres)
            .map(|shape| corners(shape.bounds()))
            .collect()
    };
    match kind {
        AcceleratorKind::Wide => match Flat::build(triangles) {
            Some(flat) if spheres.is_empty() => Tree::Flat(flat),
            _ => wide_tree(triangles, spheres, preset),
        },
        AcceleratorKind::Bvh2 => Tree::Bvh2(build_bvh2(&boxes(), obvhs_parameters(preset, 8), &mut time)),
        AcceleratorKind::Cwbvh => Tree::Cwbvh(build_cwbvh(&boxes(), obvhs_parameters(preset, 3), &mut time)),
    }
}

fn wide_tree(triangles: &[[Vec3; 3]], spheres: &[Sphere], preset: Preset) -> Tree {
    let primitives = Primitives { triangles, spheres };
    let options = preset.options();
    // Corners are finite and radii positive: there is a tree.
    let wide = if spheres.is_empty() {
        Bvh::build(triangles, options).map(|tree| wide::build(tree, triangles, &primitives))
    } else {
        let shapes: Vec<Shape> = shapes(triangles, spheres).collect();
        Bvh::build(&shapes, options).map(|tree| wide::build(tree, &shapes, &primitives))
    };
    wide.map_or(Tree::Empty, Tree::Wide)
}

/// A primitive of any kind.
enum Shape<'a> {
    Triangle(&'a [Vec3; 3]),
    Sphere(&'a Sphere),
}

impl Primitive for Shape<'_> {
    fn bounds(&self) -> Bounds {
        match self {
            Self::Triangle(corners) => corners.bounds(),
            Self::Sphere(sphere) => {
                // A hit may lie an ulp outside the exact box.
                let radius = Vec3::splat(sphere.radius * (1.0 + 4.0 * f32::EPSILON));
                let slack = sphere.center.abs() * f32::EPSILON;
                Bounds::new(sphere.center - radius - slack, sphere.center + radius + slack)
            }
        }
    }
}

fn shapes<'a>(triangles: &'a [[Vec3; 3]], spheres: &'a [Sphere]) -> impl Iterator<Item = Shape<'a>> {
    let triangles = triangles.iter().map(Shape::Triangle);
    triangles.chain(spheres.iter().map(Shape::Sphere))
}

fn obvhs_parameters(preset: Preset, max_prims_per_leaf: u32) -> BvhBuildParams {
    let of_preset = match preset {
        Preset::Fastest => BvhBuildParams::fastest_build(),
        Preset::Fast => BvhBuildParams::very_fast_build(),
        Preset::Medium => BvhBuildParams::medium_build(),
        Preset::High | Preset::Best => BvhBuildParams::slow_build(),
    };
    // Splitting large triangles gained nothing in the scenes of `docs/performance.md`, and costs
    // time and memory.
    BvhBuildParams {
        max_prims_per_leaf,
        pre_split: false,
        ..of_preset
    }
}
