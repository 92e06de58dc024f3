//! Eight or sixteen rays at a time against all triangles.
//!
//! No closures and no iterator adaptors here, see [`crate::accel::block`].

use super::{AnyAlone, Corners, Flat, MAX_EDGES, MAX_VERTICES, NearestAlone};
use crate::accel::meeting::Meeting;
use crate::accel::{HitBatch, RayBatch};
use core::cell::RefCell;
use lightshed_lanes::{AnyLanes, LaneKernel, LaneMask, Lanes, MOST_LANES, Vec3Lanes};

/// The vertices and edges as some rays see them: rows of bits of values, as long as there are
/// lanes, one behind the other.
#[repr(align(64))]
pub struct View {
    /// Vertices relative to the rays, sheared so that the rays run along the last axis: three rows
    /// each.
    vertices: [u32; 3 * MAX_VERTICES * MOST_LANES],
    /// Signed areas of the directed edges.
    areas: [u32; 2 * MAX_EDGES * MOST_LANES],
}

/// Row `index`.
#[inline(always)]
fn row<L: AnyLanes>(rows: &[u32], index: usize) -> L {
    L::read(&rows[index * L::COUNT..(index + 1) * L::COUNT])
}

thread_local! {
    /// One for each thread, because clearing it for every batch takes a tenth of a render of the
    /// Cornell box. Everything that is read has been written for the current rays.
    static VIEW: RefCell<View> = const {
        RefCell::new(View {
            vertices: [0; 3 * MAX_VERTICES * MOST_LANES],
            areas: [0; 2 * MAX_EDGES * MOST_LANES],
        })
    };
}

impl View {
    /// Prepares the rays from `place` on, as many as there are lanes. Returns `1 / d[kz]`.
    #[inline(always)]
    fn look<L: AnyLanes>(&mut self, flat: &Flat, rays: &RayBatch, place: usize) -> L {
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
        let seen = self.vertices.chunks_exact_mut(3 * L::COUNT);
        for (vertex, seen) in flat.vertices.iter().zip(seen) {
            let z = L::pick(vertex, k_z) - o_z;
            let x = L::pick(vertex, k_x) - o_x - shear_x * z;
            let y = L::pick(vertex, k_y) - o_y - shear_y * z;
            x.write(&mut seen[..L::COUNT]);
            y.write(&mut seen[L::COUNT..2 * L::COUNT]);
            z.write(&mut seen[2 * L::COUNT..]);
        }
        let areas = self.areas.chunks_exact_mut(2 * L::COUNT);
        for (edge, areas) in flat.edges.iter().zip(areas) {
            let (from, to) = (3 * edge[0] as usize, 3 * edge[1] as usize);
            let (from_x, from_y) = (row::<L>(&self.vertices, from), row::<L>(&self.vertices, from + 1));
            let (to_x, to_y) = (row::<L>(&self.vertices, to), row::<L>(&self.vertices, to + 1));
            // Products rounded on their own, never fused: the antisymmetry of the areas rests on
            // it.
            let forth = from_x * to_y;
            let back = from_y * to_x;
            (forth - back).write(&mut areas[..L::COUNT]);
            (back - forth).write(&mut areas[L::COUNT..]);
        }
        inverse_z
    }

    /// Where the rays meet a triangle within `(0, t_max)`.
    #[inline(always)]
    fn meet<L: AnyLanes>(&self, triangle: &Corners, inverse_z: L, t_max: L) -> Meeting<L> {
        let [area_a, area_b, area_c] = [
            row::<L>(&self.areas, triangle.edges[0] as usize),
            row::<L>(&self.areas, triangle.edges[1] as usize),
            row::<L>(&self.areas, triangle.edges[2] as usize),
        ];
        let [z_a, z_b, z_c] = [
            row::<L>(&self.vertices, 3 * triangle.vertices[0] as usize + 2),
            row::<L>(&self.vertices, 3 * triangle.vertices[1] as usize + 2),
            row::<L>(&self.vertices, 3 * triangle.vertices[2] as usize + 2),
        ];
        let met = Meeting::new([area_a, area_b, area_c], [z_a, z_b, z_c], inverse_z);
        Meeting {
            hit: met.hit & met.t.less(t_max),
            ..met
        }
    }
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
        VIEW.with_borrow_mut(|view| {
            self.lanes.run(NearestTogether {
                view,
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
        VIEW.with_borrow_mut(|view| {
            self.lanes.run(AnyTogether {
                view,
                flat: self,
                rays,
                count,
            })
        })
    }
}

struct NearestTogether<'a> {
    view: &'a mut View,
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

impl NearestTogether<'_> {
    /// On lanes `M`; single rays on lanes `L`.
    #[inline(always)]
    fn run_long<L: Lanes, M: AnyLanes>(self) {
        let Self {
            view,
            flat,
            rays,
            count,
            hits,
        } = self;
        let mut place = 0;
        while place < count.min(RayBatch::CAPACITY) {
            let inverse_z = view.look::<M>(flat, rays, place);
            let mut t = rays.t_max.read::<M>(place);
            let mut primitive = M::splat(f32::from_bits(HitBatch::NOTHING));
            let (mut a, mut b) = (M::splat(0.0), M::splat(0.0));
            for (number, triangle) in flat.triangles.iter().enumerate() {
                let met = view.meet(triangle, inverse_z, t);
                t = met.t.select(met.hit, t);
                a = met.weights[0].select(met.hit, a);
                b = met.weights[1].select(met.hit, b);
                primitive = M::splat(f32::from_bits(number as u32)).select(met.hit, primitive);
            }
            hits.t.write(place, t);
            hits.primitive.write(place, primitive);
            hits.barycentric[0].write(place, b);
            hits.barycentric[1].write(place, (M::splat(1.0) - a - b).max(M::splat(0.0)));
            if !flat.needles.is_empty() {
                let mut near = t.less(inverse_z.abs() * M::splat(flat.reach)).bits();
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
    }
}

struct AnyTogether<'a> {
    view: &'a mut View,
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
            view,
            flat,
            rays,
            count,
        } = self;
        let count = count.min(RayBatch::CAPACITY);
        let mut occluded = 0;
        let mut place = 0;
        while place < count {
            let inverse_z = view.look::<M>(flat, rays, place);
            let t_max = rays.t_max.read::<M>(place);
            let mut any = M::Mask::from_bits(0);
            for triangle in &flat.others {
                any = any | view.meet(triangle, inverse_z, t_max).hit;
            }
            let mut any = any.bits();
            if !flat.needles.is_empty() {
                let near = inverse_z.abs() * M::splat(flat.reach);
                let (mut all, mut doubtful) = (0, 0);
                for triangle in &flat.needles {
                    let met = view.meet(triangle, inverse_z, t_max);
                    all |= met.hit.bits();
                    doubtful |= (met.hit & met.t.less(near)).bits();
                }
                any |= all & !doubtful;
                doubtful &= !any;
                while doubtful != 0 {
                    let lane = doubtful.trailing_zeros();
                    let ray = &rays.get(place + lane as usize);
                    any |= u32::from(AnyAlone { flat, ray }.run::<L>()) << lane;
                    doubtful &= doubtful - 1;
                }
            }
            occluded |= u64::from(any) << place;
            place += M::COUNT;
        }
        // Rays that were not requested.
        if count < RayBatch::CAPACITY {
            occluded &= (1 << count) - 1;
        }
        occluded
    }
}
