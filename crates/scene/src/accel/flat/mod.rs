//! A few triangles without a tree: every ray is tested against all of them.
//!
//! For some dozens of triangles that is faster than any tree, because nothing waits for memory and
//! no branch depends on the rays. A single ray is tested against eight triangles at a time, as in a
//! leaf of the tree. Several rays are tested eight at a time, which shares work between triangles:
//! a vertex is sheared once for all its triangles, and the two signed areas of an edge, one for
//! each of its triangles, use the same two products. Both ways do the arithmetic of
//! [`intersect_triangle`](super::intersect_triangle), operation by operation, and give its bits.

mod build;
mod together;

use super::block::{Nearest, TriangleBlock, TriangleRay, confirmed};
use super::{Hit, Ray};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};

/// Most triangles for which this is faster than the tree, see `docs/performance-rays.md`.
const MAX_TRIANGLES: usize = 40;
/// Room for sheared vertices, and for signed areas of edges, of triangles that share nothing.
const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;
const MAX_EDGES: usize = 3 * MAX_TRIANGLES;

/// Vertices and directed edges are numbered in bytes.
const _: () = assert!(2 * MAX_EDGES <= 256);

/// The triangles.
#[derive(Clone, Debug)]
pub struct Flat {
    /// In the given order; a single ray is tested against these.
    blocks: Vec<TriangleBlock>,
    /// Distinct corners. The fourth coordinate is meaningless.
    vertices: Vec<[f32; 4]>,
    /// Distinct edges, as vertices. Edge `i` gives the directed edges `2 i` and, backwards,
    /// `2 i + 1`.
    edges: Vec<[u8; 2]>,
    /// In the order given.
    triangles: Vec<Corners>,
    /// Hits nearer than this along a coordinate are looked at again, see [`super::triangle`].
    reach: f32,
    /// Those of the triangles whose hits need that, and the others.
    needles: Vec<Corners>,
    others: Vec<Corners>,
    lanes: LaneChoice,
}

/// A triangle `abc`.
#[derive(Clone, Copy, Debug)]
struct Corners {
    /// `a`, `b`, `c`.
    vertices: [u8; 3],
    /// Directed edges `cb`, `ac`, `ba`, whose signed areas weigh `a`, `b`, `c`.
    edges: [u8; 3],
}

impl Flat {
    /// The nearest hit.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.lanes.run(NearestAlone { flat: self, ray })
    }

    /// Whether there is any hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.lanes.run(AnyAlone { flat: self, ray })
    }

    /// Bytes of the triangles.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
            + size_of_val(&self.vertices[..])
            + size_of_val(&self.edges[..])
            + 2 * size_of_val(&self.triangles[..])
    }

    /// The same on the lanes of the specification.
    #[cfg(test)]
    pub fn on_array_lanes(mut self) -> Self {
        self.lanes = LaneChoice::ARRAY;
        self
    }
}

struct NearestAlone<'a> {
    flat: &'a Flat,
    ray: &'a Ray,
}

impl LaneKernel for NearestAlone<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<Hit> {
        let ray = TriangleRay::new(self.ray, (1.0 / self.ray.direction).to_array());
        let mut nearest = Nearest::none(self.ray);
        for block in &self.flat.blocks {
            nearest.take_block::<L>(&ray, block);
        }
        let doubtful = ray.doubtful(self.flat.reach);
        if nearest.is_doubtful(doubtful) {
            nearest = Nearest::none(self.ray);
            for block in &self.flat.blocks {
                nearest.take_confirmed::<L>(&ray, self.ray, block, doubtful);
            }
        }
        nearest.hit()
    }
}

struct AnyAlone<'a> {
    flat: &'a Flat,
    ray: &'a Ray,
}

impl LaneKernel for AnyAlone<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let ray = TriangleRay::new(self.ray, (1.0 / self.ray.direction).to_array());
        let doubtful = ray.doubtful(self.flat.reach);
        for block in &self.flat.blocks {
            let (hit, near) = ray.hits::<L>(block, self.ray.t_max, doubtful);
            if hit != near || near != 0 && confirmed(*self.ray, block, near) != 0 {
                return true;
            }
        }
        false
    }
}
