//! Eight or sixteen rays at a time against all triangles.
//!
//! No closures and no iterator adaptors here, see [`crate::accel::block`].

use super::part::{Gathered, MAX_PARTS, Part};
use super::{AnyAlone, Flat, MAX_VERTICES, NearestAlone, Quad};
use crate::accel::meeting::{Meeting, one_sign};
use crate::accel::{HitBatch, RayBatch};
use core::cell::RefCell;
use lightshed_lanes::{AnyLanes, LaneKernel, LaneMask, Lanes, MOST_LANES, Vec3Lanes};

/// The vertices as some rays see them: relative to the rays, sheared so that the rays run along the
/// last axis. Three rows of bits of values each, as long as there are lanes, one behind the other.
#[repr(align(64))]
pub struct View([u32; 3 * MAX_VERTICES * MOST_LANES]);

/// Row `index`.
#[inline(always)]
fn row<L: AnyLanes>(rows: &[u32], index: usize) -> L {
    L::read(&rows[index * L::COUNT..(index + 1) * L::COUNT])
}

/// What is kept between batches.
pub struct Scratch {
    view: View,
    gathered: Gathered,
}

thread_local! {
    /// One for each thread, because clearing it for every batch takes a tenth of a render of the
    /// Cornell box. Everything that is read has been written for the current rays.
    static SCRATCH: RefCell<Scratch> = const {
        RefCell::new(Scratch {
            view: View([0; 3 * MAX_VERTICES * MOST_LANES]),
            gathered: Gathered::NONE,
        })
    };
}

impl View {
    /// Prepares the rays from `place` on, as many as there are lanes, for these vertices. Returns
    /// `1 / d[kz]`.
    #[inline(always)]
    fn look<L: AnyLanes>(&mut self, vertices: &[[f32; 4]], rays: &RayBatch, place: usize) -> L {
        let [o, d] = rays.read::<L>(place);
        let magnitude = d.abs();
        let x_over_y = magnitude.y.less(magnitude.x);
        let along_x = x_over_y & magnitude.z.less(magnitude.x);
        let along_y = !x_over_y & magnitude.z.less(magnitude.y);
        let [d_x, d_y, d_z] = permute(d, along_x, along_y);
        let [o_x, o_y, o_z] = permute(o, along_x, along_y);
        // The same permutation of indices, to pick coordinates of a vertex by.
        let axes = Vec3Lanes::splat([0, 1, 2].map(f32::from_bits));
        let [k_x, k_y, k_z] = permute(axes, along_x, along_y);
        let inverse_z = L::splat(1.0) / d_z;
        let (shear_x, shear_y) = (d_x * inverse_z, d_y * inverse_z);
        let seen = self.0.chunks_exact_mut(3 * L::COUNT);
        for (vertex, seen) in vertices.iter().zip(seen) {
            let z = L::pick(vertex, k_z) - o_z;
            let x = L::pick(vertex, k_x) - o_x - shear_x * z;
            let y = L::pick(vertex, k_y) - o_y - shear_y * z;
            x.write(&mut seen[..L::COUNT]);
            y.write(&mut seen[L::COUNT..2 * L::COUNT]);
            z.write(&mut seen[2 * L::COUNT..]);
        }
        inverse_z
    }

    #[inline(always)]
    fn vertex<L: AnyLanes>(&self, vertex: u8) -> [L; 3] {
        let first = 3 * vertex as usize;
        [
            row::<L>(&self.0, first),
            row::<L>(&self.0, first + 1),
            row::<L>(&self.0, first + 2),
        ]
    }

    /// A quad as the rays see it.
    #[inline(always)]
    fn see<L: AnyLanes>(&self, quad: &Quad) -> Seen<L> {
        let [a, b, c, d] = quad.corners;
        let [a_x, a_y, a_z] = self.vertex::<L>(a);
        let [b_x, b_y, b_z] = self.vertex::<L>(b);
        let [c_x, c_y, c_z] = self.vertex::<L>(c);
        let [d_x, d_y, d_z] = self.vertex::<L>(d);
        // Products rounded on their own, never fused: the antisymmetry of the areas rests on it.
        let (forth, back) = (a_x * c_y, a_y * c_x);
        let first = [c_x * b_y - c_y * b_x, forth - back, b_x * a_y - b_y * a_x];
        let second = [d_x * c_y - d_y * c_x, a_x * d_y - a_y * d_x, back - forth];
        Seen {
            areas: [first, second],
            z: [[a_z, b_z, c_z], [a_z, c_z, d_z]],
            inside: inside([first, second]),
        }
    }
}

/// A quad as some rays see it: the areas and the coordinates along the rays of the corners of its
/// triangles, and which rays' lines pass through them.
#[derive(Clone, Copy)]
struct Seen<L: AnyLanes> {
    areas: [[L; 3]; 2],
    z: [[L; 3]; 2],
    inside: [L::Mask; 2],
}

impl<L: AnyLanes> Seen<L> {
    /// Which lines pass through the second triangle alone.
    #[inline(always)]
    fn second_alone(&self) -> L::Mask {
        self.inside[1] & !self.inside[0]
    }

    /// Which lines pass through both triangles: through the common edge, or where the two are not
    /// in one plane.
    #[inline(always)]
    fn both(&self) -> L::Mask {
        self.inside[0] & self.inside[1]
    }

    /// Where the rays meet one triangle, or the second where `second` is set.
    #[inline(always)]
    fn meet(&self, second: L::Mask, inverse_z: L, t_max: L) -> Meeting<L> {
        let [one, two] = &self.areas;
        let [z_one, z_two] = &self.z;
        Meeting::of_one_sign(
            self.inside[0] | self.inside[1],
            [
                two[0].select(second, one[0]),
                two[1].select(second, one[1]),
                two[2].select(second, one[2]),
            ],
            // The first corner is that of both.
            [
                z_one[0],
                z_two[1].select(second, z_one[1]),
                z_two[2].select(second, z_one[2]),
            ],
            inverse_z,
        )
        .before(t_max)
    }

    /// Where the rays of [`both`](Self::both) meet the second triangle.
    #[inline(always)]
    fn meet_second(&self, inverse_z: L, t_max: L) -> Meeting<L> {
        Meeting::of_one_sign(self.both(), self.areas[1], self.z[1], inverse_z).before(t_max)
    }

    /// Which rays meet either triangle.
    #[inline(always)]
    fn meets(&self, inverse_z: L, t_max: L) -> L::Mask {
        let hit = self.meet(self.second_alone(), inverse_z, t_max).hit;
        if self.both().bits() == 0 {
            return hit;
        }
        hit | self.meet_second(inverse_z, t_max).hit
    }
}

/// The nearest hits so far.
struct Found<L: AnyLanes> {
    t: L,
    /// Weights of the first and second corner.
    weights: [L; 2],
    primitive: L,
}

impl<L: AnyLanes> Found<L> {
    #[inline(always)]
    fn take(&mut self, met: &Meeting<L>, primitive: L) {
        self.t = met.t.select(met.hit, self.t);
        self.weights = [
            met.weights[0].select(met.hit, self.weights[0]),
            met.weights[1].select(met.hit, self.weights[1]),
        ];
        self.primitive = primitive.select(met.hit, self.primitive);
    }

    #[inline(always)]
    fn write(&self, hits: &mut HitBatch, place: usize) {
        let [a, b] = self.weights;
        hits.t.write(place, self.t);
        hits.primitive.write(place, self.primitive);
        hits.barycentric[0].write(place, b);
        hits.barycentric[1].write(place, (L::splat(1.0) - a - b).max(L::splat(0.0)));
    }
}

/// Where the areas of each triangle of a quad have one sign; zero has both. The last of the second
/// is the negated second of the first: the area of the common edge.
#[inline(always)]
fn inside<L: AnyLanes>([first, second]: [[L; 3]; 2]) -> [L::Mask; 2] {
    let (zero, common) = (L::splat(0.0), first[1]);
    if common.equal(zero).bits() != 0 {
        return [one_sign(first), one_sign(second)];
    }
    // The others have the sign of the common one in the first triangle, the other in the second.
    let least = first[0].times_sign(common).min(first[2].times_sign(common));
    let greatest = second[0].times_sign(common).max(second[1].times_sign(common));
    [zero.less_equal(least), greatest.less_equal(zero)]
}

/// The coordinates with the dominant axis last, in the order that leaves handedness.
#[inline(always)]
fn permute<L: AnyLanes>(v: Vec3Lanes<L>, along_x: L::Mask, along_y: L::Mask) -> [L; 3] {
    [
        v.y.select(along_x, v.z.select(along_y, v.x)),
        v.z.select(along_x, v.x.select(along_y, v.y)),
        v.x.select(along_x, v.y.select(along_y, v.z)),
    ]
}

impl Flat {
    /// The nearest hit of each of the first `count` rays.
    #[inline]
    pub fn intersect_batch(&self, rays: &RayBatch, count: usize, hits: &mut HitBatch) {
        SCRATCH.with_borrow_mut(|scratch| {
            self.lanes.run(NearestTogether {
                scratch,
                flat: self,
                rays,
                count,
                hits,
            });
        });
    }

    /// Whether each of the first `count` rays has any hit: bit `i` for ray `i`.
    #[inline]
    pub fn occluded_batch(&self, rays: &RayBatch, count: usize) -> u64 {
        SCRATCH.with_borrow_mut(|scratch| {
            self.lanes.run(AnyTogether {
                scratch,
                flat: self,
                rays,
                count,
            })
        })
    }
}

struct NearestTogether<'a> {
    scratch: &'a mut Scratch,
    flat: &'a Flat,
    rays: &'a RayBatch,
    count: usize,
    hits: &'a mut HitBatch,
}

impl LaneKernel for NearestTogether<'_> {
    const HOT: bool = true;
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.run_long::<L, L::Long>()
    }
}

/// The nearest hits of some rays with quads before those of lower numbers.
#[inline(always)]
fn nearest<M: AnyLanes>(view: &View, quads: &[Quad], inverse_z: M, t_max: M) -> Found<M> {
    let mut found = Found {
        t: t_max,
        weights: [M::splat(0.0); 2],
        primitive: M::splat(f32::from_bits(HitBatch::NOTHING)),
    };
    for quad in quads {
        let seen = view.see::<M>(quad);
        let number = M::splat(f32::from_bits(quad.number));
        let next = M::splat(f32::from_bits(quad.number + 1));
        let second = seen.second_alone();
        let met = seen.meet(second, inverse_z, found.t);
        found.take(&met, next.select(second, number));
        if seen.both().bits() != 0 {
            let met = seen.meet_second(inverse_z, found.t);
            found.take(&met, next);
        }
    }
    found
}

/// Which rays meet any of the quads.
#[inline(always)]
fn any<M: AnyLanes>(view: &View, quads: &[Quad], inverse_z: M, t_max: M) -> M::Mask {
    let mut any = M::Mask::from_bits(0);
    for quad in quads {
        any = any | view.see::<M>(quad).meets(inverse_z, t_max);
    }
    any
}

/// Which rays from `place` on enter which parts before `t_max`.
#[inline(always)]
fn enter<M: AnyLanes>(
    entered: &mut [u64; MAX_PARTS],
    parts: &[Part],
    rays: &RayBatch,
    place: usize,
    t_max: M,
    wanted: u32,
) {
    if parts.is_empty() {
        return;
    }
    let [origin, direction] = rays.read::<M>(place);
    let one = M::splat(1.0);
    let inverse = Vec3Lanes::new(one / direction.x, one / direction.y, one / direction.z);
    for (part, entered) in parts.iter().zip(entered) {
        let mask = part.is_entered(origin, inverse, t_max).bits() & wanted;
        *entered |= u64::from(mask) << place;
    }
}

impl NearestTogether<'_> {
    /// On lanes `M`; single rays on lanes `L`.
    #[inline(always)]
    fn run_long<L: Lanes, M: AnyLanes>(self) {
        let Self {
            scratch: Scratch { view, gathered },
            flat,
            rays,
            count,
            hits,
        } = self;
        let count = count.min(RayBatch::CAPACITY);
        let mut entered = [0; MAX_PARTS];
        let mut place = 0;
        while place < count {
            let inverse_z = view.look::<M>(&flat.vertices, rays, place);
            let found = nearest(view, &flat.quads, inverse_z, rays.t_max.read::<M>(place));
            found.write(hits, place);
            let wanted = first_bits(count - place);
            enter(&mut entered, &flat.parts, rays, place, found.t, wanted);
            if !flat.needles.is_empty() {
                let mut near = found.t.less(inverse_z.abs() * M::splat(flat.reach)).bits();
                while near != 0 {
                    let index = place + near.trailing_zeros() as usize;
                    if hits.get(index).is_some() {
                        let ray = &rays.get(index);
                        hits.set(index, NearestAlone { flat, ray }.run::<L>());
                    }
                    near &= near - 1;
                }
            }
            place += M::COUNT;
        }
        for (part, entered) in flat.parts.iter().zip(entered) {
            gathered.take::<L>(rays, entered);
            let mut rest = entered;
            let mut place = 0;
            while place < gathered.count {
                let inverse_z = view.look::<M>(&part.vertices, &gathered.rays, place);
                let t_max = gathered.rays.t_max.read::<M>(place);
                let found = nearest(view, &part.quads, inverse_z, t_max);
                found.write(&mut gathered.hits, place);
                place += M::COUNT;
            }
            let mut index = 0;
            while rest != 0 {
                let place = rest.trailing_zeros() as usize;
                hits.take_nearer(place, &gathered.hits, index);
                rest &= rest - 1;
                index += 1;
            }
        }
    }
}

/// The lowest `count` bits.
#[inline(always)]
fn first_bits(count: usize) -> u32 {
    if count < u32::BITS as usize {
        (1 << count) - 1
    } else {
        u32::MAX
    }
}

struct AnyTogether<'a> {
    scratch: &'a mut Scratch,
    flat: &'a Flat,
    rays: &'a RayBatch,
    count: usize,
}

impl LaneKernel for AnyTogether<'_> {
    const HOT: bool = true;
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> u64 {
        self.run_long::<L, L::Long>()
    }
}

impl AnyTogether<'_> {
    /// On lanes `M`; single rays on lanes `L`.
    #[inline(always)]
    fn run_long<L: Lanes, M: AnyLanes>(self) -> u64 {
        let Self {
            scratch: Scratch { view, gathered },
            flat,
            rays,
            count,
        } = self;
        let count = count.min(RayBatch::CAPACITY);
        let inner = &flat.vertices[..flat.inner_vertices.min(flat.vertices.len())];
        let mut entered = [0; MAX_PARTS];
        let mut occluded = 0;
        let mut place = 0;
        while place < count {
            let wanted = first_bits(count - place);
            let leaving = !flat.enclosure.holds_lanes::<M>(rays, place);
            let leaves = !flat.walls.is_empty() && leaving.bits() & wanted != 0;
            let vertices = if leaves { &flat.vertices[..] } else { inner };
            let inverse_z = view.look::<M>(vertices, rays, place);
            let t_max = rays.t_max.read::<M>(place);
            let mut met = any(view, &flat.inner, inverse_z, t_max);
            if leaves {
                met = met | any(view, &flat.walls, inverse_z, t_max) & leaving;
            }
            let mut met = met.bits();
            if !flat.needles.is_empty() {
                let near = inverse_z.abs() * M::splat(flat.reach);
                let (mut all, mut doubtful) = (0, 0);
                for quad in &flat.needles {
                    let hit = view.see::<M>(quad).meet(M::Mask::from_bits(0), inverse_z, t_max);
                    all |= hit.hit.bits();
                    doubtful |= (hit.hit & hit.t.less(near)).bits();
                }
                met |= all & !doubtful;
                doubtful &= !met;
                while doubtful != 0 {
                    let lane = doubtful.trailing_zeros();
                    let ray = &rays.get(place + lane as usize);
                    met |= u32::from(AnyAlone { flat, ray }.run::<L>()) << lane;
                    doubtful &= doubtful - 1;
                }
            }
            enter(&mut entered, &flat.parts, rays, place, t_max, wanted & !met);
            occluded |= u64::from(met & wanted) << place;
            place += M::COUNT;
        }
        for (part, entered) in flat.parts.iter().zip(entered) {
            // Those that meet another part already.
            let mut rest = entered & !occluded;
            gathered.take::<L>(rays, rest);
            let mut place = 0;
            let mut met = 0u64;
            while place < gathered.count {
                let inverse_z = view.look::<M>(&part.vertices, &gathered.rays, place);
                let t_max = gathered.rays.t_max.read::<M>(place);
                met |= u64::from(any(view, &part.quads, inverse_z, t_max).bits()) << place;
                place += M::COUNT;
            }
            while rest != 0 {
                occluded |= (met & 1) << rest.trailing_zeros();
                met >>= 1;
                rest &= rest - 1;
            }
        }
        occluded
    }
}
