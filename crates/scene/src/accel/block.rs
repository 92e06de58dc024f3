//! Eight triangles at a time against one ray, watertight.
//!
//! Triangles are tested by signed areas in a space sheared along the ray (Woop, Benthin and Wald
//! 2013, *Watertight Ray/Triangle Intersection*). The signed area of an edge is `a·b − c·d`,
//! each product rounded once: rounding is monotonic, so the computed sign is never opposite to that
//! of the exact value, only zero in its place; zero counts as inside. An edge seen from its two
//! triangles has areas that differ in sign alone. So no ray passes between two triangles that share
//! an edge or a vertex bit for bit.
//!
//! No closures and no iterator adaptors here: the compiler does not inline them into a caller that
//! uses other instructions than the crate's, and a call for every operation would be far too slow.

use super::meeting::Meeting;
use super::triangle::is_ahead;
use super::{Hit, Ray};
use glam::Vec3;
use lightshed_lanes::{LaneMask, Lanes};

/// Up to eight triangles, one row of eight a coordinate: `vertices[v][axis][lane]`.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct TriangleBlock {
    pub vertices: [[[f32; 8]; 3]; 3],
    /// Index of the triangle in the order that the tree was built from.
    pub primitives: [u32; 8],
}

const _: () = assert!(size_of::<TriangleBlock>() == 320);

impl TriangleBlock {
    /// A block of the given triangles (at most eight). Unused lanes hold a point at NaN, which no
    /// ray hits.
    pub fn new(triangles: impl IntoIterator<Item = (u32, [Vec3; 3])>) -> Self {
        let mut block = Self {
            vertices: [[[f32::NAN; 8]; 3]; 3],
            primitives: [u32::MAX; 8],
        };
        for (lane, (primitive, corners)) in triangles.into_iter().enumerate() {
            block.primitives[lane] = primitive;
            for (v, corner) in corners.iter().enumerate() {
                for axis in 0..3 {
                    block.vertices[v][axis][lane] = corner[axis];
                }
            }
        }
        block
    }
}

/// A number below three for the compiler, which then checks no index.
#[derive(Clone, Copy)]
#[repr(u8)]
enum Axis {
    X,
    Y,
    Z,
}

/// What the test needs of a ray.
#[derive(Clone, Copy)]
pub struct TriangleRay {
    pub origin: [f32; 3],
    /// Axes permuted so that the last is the one along which the direction is longest.
    axes: [Axis; 3],
    /// Shear `d[kx] / d[kz]`, `d[ky] / d[kz]`, and `1 / d[kz]`.
    shear: [f32; 3],
}

/// A triangle's corner relative to the ray, sheared so that the ray runs along the last axis.
struct Sheared<L> {
    x: L,
    y: L,
    z: L,
}

impl TriangleRay {
    /// For a ray and one over each coordinate of its direction.
    #[inline(always)]
    pub fn new(ray: &Ray, inverse_direction: [f32; 3]) -> Self {
        let d = ray.direction.to_array();
        let magnitude = [d[0].abs(), d[1].abs(), d[2].abs()];
        const CYCLES: [[Axis; 3]; 3] = [
            [Axis::Y, Axis::Z, Axis::X],
            [Axis::Z, Axis::X, Axis::Y],
            [Axis::X, Axis::Y, Axis::Z],
        ];
        let longest = if magnitude[0] > magnitude[1] {
            if magnitude[0] > magnitude[2] { 0 } else { 2 }
        } else if magnitude[1] > magnitude[2] {
            1
        } else {
            2
        };
        let axes = CYCLES[longest];
        let [kx, ky, kz] = axes.map(|axis| axis as usize);
        let inverse_z = inverse_direction[kz];
        Self {
            origin: ray.origin.to_array(),
            axes,
            shear: [d[kx] * inverse_z, d[ky] * inverse_z, inverse_z],
        }
    }

    /// One over the longest coordinate of the direction.
    #[inline(always)]
    pub fn inverse_longest(&self) -> f32 {
        self.shear[2]
    }

    /// Hits before this ray parameter, nearer than `reach` along a coordinate, are looked at again,
    /// see [`super::triangle`].
    #[inline(always)]
    pub fn doubtful(&self, reach: f32) -> f32 {
        reach * self.shear[2].abs()
    }

    #[inline(always)]
    fn corner<L: Lanes>(&self, corner: &[[f32; 8]; 3]) -> Sheared<L> {
        let [kx, ky, kz] = [
            self.axes[0] as usize,
            self.axes[1] as usize,
            self.axes[2] as usize,
        ];
        let z = L::load(&corner[kz]) - L::splat(self.origin[kz]);
        let x = L::load(&corner[kx]) - L::splat(self.origin[kx]) - L::splat(self.shear[0]) * z;
        let y = L::load(&corner[ky]) - L::splat(self.origin[ky]) - L::splat(self.shear[1]) * z;
        Sheared { x, y, z }
    }

    /// Ray parameter, weights of the first and second vertex, and the triangles hit within
    /// `(0, t_max)`.
    #[inline(always)]
    fn test<L: Lanes>(&self, block: &TriangleBlock, t_max: f32) -> (L, L, L, u32) {
        let a = self.corner::<L>(&block.vertices[0]);
        let b = self.corner::<L>(&block.vertices[1]);
        let c = self.corner::<L>(&block.vertices[2]);
        // Products rounded on their own, never fused: the antisymmetry of the areas rests on it.
        let area_a = c.x * b.y - c.y * b.x;
        let area_b = a.x * c.y - a.y * c.x;
        let area_c = b.x * a.y - b.y * a.x;
        let areas = [area_a, area_b, area_c];
        let met = Meeting::new(areas, [a.z, b.z, c.z], L::splat(self.shear[2]));
        let hit = met.hit & met.t.less(L::splat(t_max));
        (met.t, met.weights[0], met.weights[1], hit.bits())
    }

    /// The triangles hit within `(0, t_max)`, and those of them that are hit before `doubtful`.
    #[inline(always)]
    pub fn hits<L: Lanes>(&self, block: &TriangleBlock, t_max: f32, doubtful: f32) -> (u32, u32) {
        let (t, _, _, hit) = self.test::<L>(block, t_max);
        (hit, t.less(L::splat(doubtful)).bits() & hit)
    }
}

/// Those of the hits whose planes are ahead.
#[cold]
#[inline(never)]
pub fn confirmed(ray: Ray, block: &TriangleBlock, hits: u32) -> u32 {
    let mut confirmed = hits;
    for lane in 0..8 {
        let corner = |v: usize| Vec3::from_array(block.vertices[v].map(|row| row[lane]));
        let corners = [corner(0), corner(1), corner(2)];
        if hits >> lane & 1 == 1 && !is_ahead(ray.origin, ray.direction, &corners) {
            confirmed &= !(1 << lane);
        }
    }
    confirmed
}

/// The nearest hit so far.
#[derive(Clone, Copy)]
pub struct Nearest {
    /// Its ray parameter, or the end of the ray.
    pub t: f32,
    /// Hits with a smaller parameter are candidates. It is the end of the ray, or the number after
    /// the hit's ray parameter, because a primitive of a lower index may lie at the same distance.
    bound: f32,
    primitive: u32,
    /// Weights of the first and second vertex.
    weights: [f32; 2],
}

impl Nearest {
    /// The hit with these, where `primitive` is `u32::MAX` if there is none before `t`.
    #[inline(always)]
    pub fn found(t: f32, primitive: u32, weights: [f32; 2]) -> Self {
        let next = f32::from_bits(t.to_bits() + 1);
        Self {
            t,
            bound: if primitive == u32::MAX { t } else { next },
            primitive,
            weights,
        }
    }

    /// What [`Nearest::found`] is made from.
    #[inline(always)]
    pub fn parts(&self) -> (f32, u32, [f32; 2]) {
        (self.t, self.primitive, self.weights)
    }

    /// No hit yet.
    #[inline(always)]
    pub fn none(ray: &Ray) -> Self {
        Self {
            t: ray.t_max,
            bound: ray.t_max,
            primitive: u32::MAX,
            weights: [0.0; 2],
        }
    }

    /// Adds the nearest hit among a block's triangles, which are in the order of their indices; at
    /// equal distances, that of the lowest index.
    #[inline(always)]
    pub fn take_block<L: Lanes>(&mut self, ray: &TriangleRay, block: &TriangleBlock) {
        let (t, a, b, hit) = ray.test::<L>(block, self.bound);
        self.take::<L>(block, t, [a, b], hit);
    }

    /// The same for a ray whose nearest hit is doubtful: only hits whose planes are ahead, among
    /// those before `doubtful`.
    #[inline(always)]
    pub fn take_confirmed<L: Lanes>(
        &mut self,
        ray: &TriangleRay,
        of: &Ray,
        block: &TriangleBlock,
        doubtful: f32,
    ) {
        let (t, a, b, hit) = ray.test::<L>(block, self.bound);
        let near = t.less(L::splat(doubtful)).bits() & hit;
        let hit = hit & !near | confirmed(*of, block, near);
        self.take::<L>(block, t, [a, b], hit);
    }

    #[inline(always)]
    fn take<L: Lanes>(&mut self, block: &TriangleBlock, t: L, [a, b]: [L; 2], hit: u32) {
        let nearest = t.least_of(hit);
        let lane = (t.equal(nearest).bits() & hit).trailing_zeros() as usize & 7;
        // Selections instead of a branch on whether there was a hit, which is practically random.
        let primitive = block.primitives[lane];
        let found = hit != 0 && (nearest.first() < self.t || primitive < self.primitive);
        let (a, b) = (a.store()[lane], b.store()[lane]);
        self.t = if found { nearest.first() } else { self.t };
        // The next number after a positive number below infinity.
        let next = f32::from_bits(nearest.first().to_bits() + 1);
        self.bound = if found { next } else { self.bound };
        self.primitive = if found { primitive } else { self.primitive };
        self.weights = if found { [a, b] } else { self.weights };
    }

    /// A hit with a sphere of this index, or in an instance whose first primitive has it, must lie
    /// before this.
    #[inline(always)]
    pub fn bound_of_other(&self, primitive: u32) -> f32 {
        if primitive < self.primitive {
            self.bound
        } else {
            self.t
        }
    }

    /// Takes in a hit with a sphere, before [`Nearest::bound_of_other`].
    #[inline(always)]
    pub fn take_sphere(&mut self, t: f32, primitive: u32) {
        *self = Self {
            t,
            bound: f32::from_bits(t.to_bits() + 1),
            primitive,
            weights: [1.0, 0.0],
        };
    }

    /// Takes in what was found in an instance, whose primitives begin at `first`, before
    /// [`Nearest::bound_of_other`].
    #[inline(always)]
    pub fn take_other(&mut self, found: Self, first: u32) {
        if found.primitive != u32::MAX {
            *self = Self {
                primitive: first + found.primitive,
                ..found
            };
        }
    }

    /// Whether what was found lies before `doubtful`, so that planes must be looked at.
    #[inline(always)]
    pub fn is_doubtful(&self, doubtful: f32) -> bool {
        self.t < doubtful && self.primitive != u32::MAX
    }

    /// The hit, if there was any.
    #[inline(always)]
    pub fn hit(&self) -> Option<Hit> {
        let [a, b] = self.weights;
        let barycentric = [b, (1.0 - a - b).max(0.0)];
        (self.primitive != u32::MAX).then_some(Hit {
            t: self.t,
            primitive: self.primitive,
            barycentric,
        })
    }
}
