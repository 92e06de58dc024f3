//! A few triangles without a tree: every ray is tested against all of them.
//!
//! For some dozens of triangles that is faster than any tree, because nothing waits for memory and
//! no branch depends on the rays. A single ray is tested against eight triangles at a time, as in a
//! leaf of the tree. Several rays are tested side by side, which shares work between triangles: a
//! vertex is sheared once for all its triangles, and the triangles of a quad have a common edge and
//! one of them is tested to the end, see [`Quad`]. Shadow rays within a room are not tested
//! against its walls, see [`Enclosure`], and only rays that enter the box around a thing are tested
//! against it, see [`part`]. Both ways do the arithmetic of
//! [`intersect_triangle`](super::intersect_triangle), operation by operation, and give its bits.

mod build;
mod enclosure;
mod part;
mod together;

use super::block::{Nearest, TriangleBlock, TriangleRay, confirmed};
use super::{Hit, Ray};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes};
use part::Part;

pub use enclosure::Enclosure;

/// Most triangles for which this is faster than the tree, those of parts counted as half, see
/// `docs/performance-rays.md`.
const MAX_WEIGHT: usize = 40;
/// Most triangles: all of them may be in parts.
const MAX_TRIANGLES: usize = 2 * MAX_WEIGHT;
/// Room for sheared vertices: for all numbers of a byte, so that no number has to be checked.
const MAX_VERTICES: usize = 256;

const _: () = assert!(3 * MAX_TRIANGLES <= MAX_VERTICES);

/// The triangles.
#[derive(Clone, Debug)]
pub struct Flat {
    /// In the given order; a single ray is tested against these.
    blocks: Vec<TriangleBlock>,
    /// Which triangles of each block are walls.
    wall_bits: Vec<u32>,
    /// Distinct corners of what is in no part. The fourth coordinate is meaningless.
    vertices: Vec<[f32; 4]>,
    /// So many of them are corners of [`needles`](Self::needles) and [`inner`](Self::inner).
    inner_vertices: usize,
    /// All triangles but those of parts, in the order given.
    quads: Vec<Quad>,
    /// Hits nearer than this along a coordinate are looked at again, see [`super::triangle`].
    reach: f32,
    /// Those of the triangles whose hits need that, one by one.
    needles: Vec<Quad>,
    /// Of the others those that no segment in the enclosure meets, and the rest.
    walls: Vec<Quad>,
    inner: Vec<Quad>,
    enclosure: Enclosure,
    /// Triangles against which few rays are tested. There are none where there are needles.
    parts: Vec<Part>,
    lanes: LaneChoice,
}

/// Triangles `abc` and `acd` that follow each other. Few lines pass through both, so rays are
/// tested against the one that theirs passes through. A triangle alone has `d = c`: no ray hits
/// what has no area.
#[derive(Clone, Copy, Debug)]
struct Quad {
    corners: [u8; 4],
    /// Number of the first in the order given.
    number: u32,
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
            + size_of_val(&self.quads[..])
            + size_of_val(&self.needles[..])
            + size_of_val(&self.walls[..])
            + size_of_val(&self.inner[..])
            + size_of_val(&self.wall_bits[..])
            + self.parts.iter().map(Part::bytes).sum::<usize>()
    }

    /// Whether there are things in boxes.
    #[cfg(test)]
    pub fn has_parts(&self) -> bool {
        !self.parts.is_empty()
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
        let inside = self.flat.enclosure.holds(self.ray);
        for (block, walls) in self.flat.blocks.iter().zip(&self.flat.wall_bits) {
            let tested = if inside { !*walls } else { u32::MAX };
            let (hit, near) = ray.hits::<L>(block, self.ray.t_max, doubtful);
            let (hit, near) = (hit & tested, near & tested);
            if hit != near || near != 0 && confirmed(*self.ray, block, near) != 0 {
                return true;
            }
        }
        false
    }
}
