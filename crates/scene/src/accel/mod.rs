//! Ray queries: the nearest hit, and whether there is any.
//!
//! [`Accelerator`] holds a tree with eight or sixteen full-precision boxes a node, as many as the
//! machine tests at once, and eight triangles a leaf. It is collapsed from a binary tree of the
//! crate `lightshed-bvh`. At equal distances the hit of the lowest index counts, and boxes are left
//! out only if they begin beyond a hit by more than rounding, so the result does not depend on the
//! tree. The feature `obvhs` adds two trees that obvhs builds and traverses, for comparison.

mod batch;
mod block;
#[cfg(feature = "obvhs")]
mod by_obvhs;
mod flat;
mod meeting;
mod ray;
mod sphere;
mod stack;
mod triangle;
mod wide;

#[cfg(test)]
mod quad_tests;
#[cfg(test)]
mod room_tests;
#[cfg(test)]
mod tests;

pub use batch::{HitBatch, RayBatch};
pub use ray::{Hit, Ray};
pub use sphere::Sphere;
pub use triangle::intersect_triangle;

#[cfg(feature = "obvhs")]
use by_obvhs::ObvhsTree;
use flat::Flat;
use glam::Vec3;
use lightshed_bvh::{Bounds, Bvh, Instance, Preset, Primitive};
use wide::{Instances, Placed, Primitives, WideBvh};

/// The tree through which rays are traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AcceleratorKind {
    /// This crate's wide tree; no tree for some dozens of triangles.
    #[default]
    Wide,
    /// obvhs' binary tree.
    #[cfg(feature = "obvhs")]
    Bvh2,
    /// obvhs' compressed eight-wide tree.
    #[cfg(feature = "obvhs")]
    Cwbvh,
}

impl AcceleratorKind {
    /// All kinds of this build, with their names.
    pub const ALL: &[(&str, Self)] = &[
        ("wide", Self::Wide),
        #[cfg(feature = "obvhs")]
        ("bvh2", Self::Bvh2),
        #[cfg(feature = "obvhs")]
        ("cwbvh", Self::Cwbvh),
    ];
}

enum Tree {
    Wide(WideBvh),
    Flat(Flat),
    #[cfg(feature = "obvhs")]
    Obvhs(ObvhsTree),
    Empty,
}

/// Boxes of an object that the box of an instance is made from.
const PARTS: usize = 16;

/// A tree over triangles and spheres. Primitives are numbered triangles first, then spheres.
pub struct Accelerator {
    tree: Tree,
}

impl Accelerator {
    /// Builds a tree. Coordinates must be finite and radii positive (`Scene` checks); no primitive
    /// at all is an empty scene that no ray hits.
    pub fn build(triangles: &[[Vec3; 3]], spheres: &[Sphere], kind: AcceleratorKind, preset: Preset) -> Self {
        let tree = if triangles.is_empty() && spheres.is_empty() {
            Tree::Empty
        } else {
            build_tree(triangles, spheres, kind, preset)
        };
        Self { tree }
    }

    /// Builds a tree with placed copies of objects below it, which are not made: a tree for each
    /// object, and one over everything. Primitives are numbered triangles first, then spheres, then
    /// for each instance the triangles of its object. The kind is `Wide`.
    ///
    /// `objects` are lists of triangles, none of them empty; instances must name them, by regular
    /// maps, and the numbers of all primitives must be less than `u32::MAX` (`Scene` checks).
    pub(crate) fn with_instances(
        triangles: &[[Vec3; 3]],
        spheres: &[Sphere],
        objects: &[&[[Vec3; 3]]],
        instances: &[Instance],
        preset: Preset,
    ) -> Self {
        if instances.is_empty() {
            return Self::build(triangles, spheres, AcceleratorKind::Wide, preset);
        }
        let (mut of_objects, mut parts) = (Vec::new(), Vec::new());
        for &corners in objects {
            // Corners are finite: there is a tree.
            let tree = Bvh::build(corners, preset.options()).unwrap_or_default();
            let mut boxes = Vec::new();
            tree.upper_boxes(PARTS, &mut boxes);
            parts.push(boxes);
            let primitives = Primitives {
                triangles: corners,
                spheres: &[],
                instances: Instances::default(),
            };
            of_objects.push(wide::build(tree, corners, primitives));
        }
        let mut first = (triangles.len() + spheres.len()) as u32;
        let placed = instances.iter().map(|instance| {
            let own = first;
            first += objects[instance.object as usize].len() as u32;
            Placed {
                to_object: instance.to_world.inverse(),
                object: instance.object,
                first: own,
            }
        });
        let below = Instances {
            placed: placed.collect(),
            objects: of_objects,
        };
        let boxes = instances
            .iter()
            .map(|instance| Shape::Instance(instance.bounds(&parts[instance.object as usize])));
        let shapes: Vec<Shape> = shapes(triangles, spheres).chain(boxes).collect();
        let primitives = Primitives {
            triangles,
            spheres,
            instances: below,
        };
        let tree = Bvh::build(&shapes, preset.options()).map(|tree| wide::build(tree, &shapes, primitives));
        Self {
            tree: tree.map_or(Tree::Empty, Tree::Wide),
        }
    }

    /// The nearest hit in the open segment.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        match &self.tree {
            Tree::Wide(bvh) => bvh.intersect(ray),
            Tree::Flat(flat) => flat.intersect(ray),
            #[cfg(feature = "obvhs")]
            Tree::Obvhs(tree) => tree.intersect(ray),
            Tree::Empty => None,
        }
    }

    /// Whether anything lies in the open segment.
    pub fn occluded(&self, ray: &Ray) -> bool {
        match &self.tree {
            Tree::Wide(bvh) => bvh.occluded(ray),
            Tree::Flat(flat) => flat.occluded(ray),
            #[cfg(feature = "obvhs")]
            Tree::Obvhs(tree) => tree.occluded(ray),
            Tree::Empty => false,
        }
    }

    /// The nearest hit of each ray: the same as [`Accelerator::intersect`] for each, but faster.
    /// The length of the shorter slice counts.
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

    /// Whether anything lies in each open segment: the same as [`Accelerator::occluded`] for each,
    /// but faster. The length of the shorter slice counts.
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

    /// Bytes of the structure that rays of the kind `Wide` are traced through, including copies of
    /// the triangles; 0 for the others.
    pub fn wide_bytes(&self) -> usize {
        match &self.tree {
            Tree::Wide(bvh) => bvh.bytes(),
            Tree::Flat(flat) => flat.bytes(),
            _ => 0,
        }
    }
}

fn build_tree(triangles: &[[Vec3; 3]], spheres: &[Sphere], kind: AcceleratorKind, preset: Preset) -> Tree {
    match kind {
        AcceleratorKind::Wide => match Flat::build(triangles) {
            Some(flat) if spheres.is_empty() => Tree::Flat(flat),
            _ => wide_tree(triangles, spheres, preset),
        },
        #[cfg(feature = "obvhs")]
        AcceleratorKind::Bvh2 | AcceleratorKind::Cwbvh => {
            Tree::Obvhs(ObvhsTree::build(triangles, spheres, kind, preset))
        }
    }
}

fn wide_tree(triangles: &[[Vec3; 3]], spheres: &[Sphere], preset: Preset) -> Tree {
    let primitives = Primitives {
        triangles,
        spheres,
        instances: Instances::default(),
    };
    let options = preset.options();
    // Corners are finite and radii positive: there is a tree.
    let wide = if spheres.is_empty() {
        Bvh::build(triangles, options).map(|tree| wide::build(tree, triangles, primitives))
    } else {
        let shapes: Vec<Shape> = shapes(triangles, spheres).collect();
        Bvh::build(&shapes, options).map(|tree| wide::build(tree, &shapes, primitives))
    };
    wide.map_or(Tree::Empty, Tree::Wide)
}

/// A primitive of any kind.
enum Shape<'a> {
    Triangle(&'a [Vec3; 3]),
    Sphere(&'a Sphere),
    /// The box around an instance.
    Instance(Bounds),
}

impl Primitive for Shape<'_> {
    fn bounds(&self) -> Bounds {
        match self {
            Self::Triangle(corners) => corners.bounds(),
            Self::Instance(bounds) => *bounds,
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
