//! Rays of about one direction, in lanes.

use super::constants::FAR_WIDENING;
use super::node::Node;
use super::row::Row;
use super::slack::slack;
use crate::accel::batch::RayBatch;
use crate::accel::block::TriangleBlock;
use crate::accel::meeting::Meeting;
use lightshed_lanes::{AnyLanes, Column, LaneMask, MOST_LANES};

/// Rays of one octant of directions along one longest axis, as many lanes at a time as `M` has.
///
/// Loops over boxes and triangles are outside, those over rays inside. Each ray does the arithmetic
/// of a ray alone, operation by operation, and so has its bits.
pub struct Packet<'a> {
    rays: &'a RayBatch,
    count: usize,
    inverse_direction: [Column; 3],
    /// As in [`crate::accel::block::TriangleRay`].
    shear: [Column; 3],
    /// Axes permuted so that the last is the longest.
    axes: [usize; 3],
    /// Bit `a` says whether the rays go to the positive side of axis `a`.
    octant: u32,
    /// As in [`super::constants::RayConstants`].
    pub flip: u32,
    /// The least and the greatest coordinate of an origin along each axis.
    origins: [[f32; 2]; 3],
    /// The least and the greatest inverse coordinate of a direction.
    inverses: [[f32; 2]; 3],
    /// The greatest of a ray, or more, see [`super::slack`].
    slack: f32,
}

/// Bits of all lanes.
#[inline(always)]
fn all<M: AnyLanes>() -> u32 {
    u32::MAX >> (32 - M::COUNT)
}

/// The least of the lanes that are not NaN, if the first is not.
#[inline(always)]
fn least<M: AnyLanes>(values: M) -> f32 {
    let mut row = [0; MOST_LANES];
    values.write(&mut row);
    let mut least = f32::from_bits(row[0]);
    for &bits in &row[1..M::COUNT] {
        let value = f32::from_bits(bits);
        least = if value < least { value } else { least };
    }
    least
}

/// The greatest of the first `count` values and 0, or more.
#[inline(always)]
pub fn greatest<M: AnyLanes>(values: &Column, count: usize) -> f32 {
    let mut greatest = M::splat(0.0);
    let mut place = 0;
    while place < count {
        // The argument that may be NaN comes first, see `AnyLanes`.
        greatest = values.read::<M>(place).max(greatest);
        place += M::COUNT;
    }
    -least(-greatest)
}

/// The greater magnitude of two ends.
#[inline(always)]
fn steepest([least, greatest]: [f32; 2]) -> f32 {
    least.abs().max(greatest.abs())
}

impl<'a> Packet<'a> {
    /// The first `count` rays of a batch, if they have one octant and one longest axis, and if
    /// their origins, directions and inverse directions are finite and their directions go along no
    /// coordinate plane.
    #[inline(always)]
    pub fn new<M: AnyLanes, R: Row>(rays: &'a RayBatch, count: usize, uncertainty: f32) -> Option<Self> {
        let [octant, axis] = Self::direction::<M>(rays, count)?;
        let axes = [(axis as usize + 1) % 3, (axis as usize + 2) % 3, axis as usize];
        let (zero, infinite) = (M::splat(0.0), M::splat(f32::INFINITY));
        let mut inverse_direction = [const { Column::splat(0.0) }; 3];
        let mut shear = [const { Column::splat(0.0) }; 3];
        // The least of each number, and of its negative.
        let mut origins = [[infinite; 2]; 3];
        let mut inverses = [[infinite; 2]; 3];
        let mut place = 0;
        while place < count {
            let asked = Self::asked::<M>(count - place);
            let [o, d] = rays.read::<M>(place);
            let (o, d) = ([o.x, o.y, o.z], [d.x, d.y, d.z]);
            let mut inverse = [zero; 3];
            for axis in 0..3 {
                inverse[axis] = M::splat(1.0) / d[axis];
                let size = inverse[axis].abs();
                let fine = o[axis].abs().less(infinite) & zero.less(size) & size.less(infinite);
                if fine.bits() & asked != asked {
                    return None;
                }
                inverse_direction[axis].write(place, inverse[axis]);
                let chosen = M::Mask::from_bits(asked);
                for (of, value) in [(&mut origins, o[axis]), (&mut inverses, inverse[axis])] {
                    let [least, negative] = of[axis];
                    of[axis] = [
                        value.select(chosen, infinite).min(least),
                        (-value).select(chosen, infinite).min(negative),
                    ];
                }
            }
            let inverse_z = inverse[axes[2]];
            shear[0].write(place, d[axes[0]] * inverse_z);
            shear[1].write(place, d[axes[1]] * inverse_z);
            shear[2].write(place, inverse_z);
            place += M::COUNT;
        }
        let mut packet = Self {
            rays,
            count,
            inverse_direction,
            shear,
            axes,
            octant,
            // As far as the first ray goes along (1, 1, 1): any order will do.
            flip: R::flip(octant, u32::from(rays.get(0).direction.element_sum() >= 0.0)),
            origins: [[0.0; 2]; 3],
            inverses: [[0.0; 2]; 3],
            slack: 0.0,
        };
        for axis in 0..3 {
            packet.origins[axis] = [least(origins[axis][0]), -least(origins[axis][1])];
            packet.inverses[axis] = [least(inverses[axis][0]), -least(inverses[axis][1])];
        }
        let [x, y, z] = packet.inverses;
        let inverses = [steepest(x), steepest(y), steepest(z)];
        packet.slack = slack(uncertainty, inverses, inverses[axes[2]]);
        Some(packet)
    }

    /// Bits of the lanes of the first `left` rays.
    #[inline(always)]
    fn asked<M: AnyLanes>(left: usize) -> u32 {
        all::<M>() >> (M::COUNT - left.min(M::COUNT))
    }

    /// The octant of the rays and their longest axis, as [`crate::accel::block::TriangleRay`]
    /// chooses it. Most batches are told from packets by their first rays.
    #[inline(always)]
    fn direction<M: AnyLanes>(rays: &RayBatch, count: usize) -> Option<[u32; 2]> {
        let zero = M::splat(0.0);
        let mut common = None;
        let mut place = 0;
        while place < count {
            let asked = Self::asked::<M>(count - place);
            let [_, d] = rays.read::<M>(place);
            let size = d.abs();
            let x_over_y = size.y.less(size.x);
            let sides = [
                zero.less(d.x).bits() & asked,
                zero.less(d.y).bits() & asked,
                zero.less(d.z).bits() & asked,
                (x_over_y & size.z.less(size.x)).bits() & asked,
                (!x_over_y & size.z.less(size.y)).bits() & asked,
            ];
            let mut found = [0; 5];
            for (found, side) in found.iter_mut().zip(sides) {
                if side != 0 && side != asked {
                    return None;
                }
                *found = u32::from(side != 0);
            }
            let [x, y, z, along_x, along_y] = found;
            let axis = if along_x == 1 { 0 } else { 2 - along_y };
            let direction = [x | y << 1 | z << 2, axis];
            if *common.get_or_insert(direction) != direction {
                return None;
            }
            place += M::COUNT;
        }
        common
    }

    /// The rays.
    #[inline(always)]
    pub fn rays(&self) -> &'a RayBatch {
        self.rays
    }

    /// Their number.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Those of `rays` that are in the lanes from `place` on.
    #[inline(always)]
    pub fn lanes<M: AnyLanes>(rays: u64, place: usize) -> u32 {
        (rays >> place) as u32 & all::<M>()
    }

    /// Children that may be entered by some ray before `t_max`, in their order: all that are, and a
    /// few more.
    ///
    /// Rounding is monotonic, so a value computed from the ends of two ranges is not beyond what
    /// any ray within them computes.
    #[inline(always)]
    pub fn may_enter<M: AnyLanes, R: Row>(&self, node: &Node<R>, t_max: f32) -> u32 {
        let (mut near, mut far) = (M::splat(0.0), M::splat(t_max + self.slack));
        for axis in 0..3 {
            let forwards = (self.octant >> axis & 1) as usize;
            let [low, high] = self.inverses[axis];
            let (low, high) = (M::splat(low), M::splat(high));
            // Origins that are farthest along, and farthest behind.
            let ahead = M::splat(self.origins[axis][forwards]);
            let behind = M::splat(self.origins[axis][forwards ^ 1]);
            let to_near = node.bound::<M>(axis, forwards ^ 1) - ahead;
            let to_far = node.bound::<M>(axis, forwards) - behind;
            near = (to_near * low).min(to_near * high).max(near);
            far = (to_far * low).max(to_far * high).min(far);
        }
        let far = far * M::splat(FAR_WIDENING);
        near.flipped(self.flip).less_equal(far.flipped(self.flip)).bits()
    }

    /// Those of `rays` that enter the box of a child before their `t_max`.
    #[inline(always)]
    pub fn enter<M: AnyLanes, R: Row>(&self, node: &Node<R>, slot: u32, t_max: &Column, rays: u64) -> u64 {
        let mut entering = 0;
        let mut place = 0;
        while place < self.count {
            let asked = Self::lanes::<M>(rays, place);
            if asked != 0 {
                let (mut near, mut far) = (M::splat(0.0), t_max.read::<M>(place) + M::splat(self.slack));
                for axis in 0..3 {
                    let forwards = (self.octant >> axis & 1) as usize;
                    let origin = self.rays.origin[axis].read::<M>(place);
                    let inverse = self.inverse_direction[axis].read::<M>(place);
                    let [first, last] = [
                        node.bound_of(axis, forwards ^ 1, slot),
                        node.bound_of(axis, forwards, slot),
                    ];
                    near = ((M::splat(first) - origin) * inverse).max(near);
                    far = ((M::splat(last) - origin) * inverse).min(far);
                }
                let hit = near.less_equal(far * M::splat(FAR_WIDENING)).bits();
                entering |= u64::from(hit & asked) << place;
            }
            place += M::COUNT;
        }
        entering
    }

    /// Where the rays from `place` on meet triangle `lane` of a block.
    #[inline(always)]
    pub fn meet<M: AnyLanes>(&self, block: &TriangleBlock, lane: usize, place: usize) -> Meeting<M> {
        let [kx, ky, kz] = self.axes;
        let [o_x, o_y, o_z] = [
            self.rays.origin[kx].read::<M>(place),
            self.rays.origin[ky].read::<M>(place),
            self.rays.origin[kz].read::<M>(place),
        ];
        let [shear_x, shear_y, inverse_z] = [
            self.shear[0].read::<M>(place),
            self.shear[1].read::<M>(place),
            self.shear[2].read::<M>(place),
        ];
        let mut corners = [[M::splat(0.0); 3]; 3];
        for (corner, vertex) in corners.iter_mut().zip(&block.vertices) {
            let z = M::splat(vertex[kz][lane % 8]) - o_z;
            let x = M::splat(vertex[kx][lane % 8]) - o_x - shear_x * z;
            let y = M::splat(vertex[ky][lane % 8]) - o_y - shear_y * z;
            *corner = [x, y, z];
        }
        let [[a_x, a_y, a_z], [b_x, b_y, b_z], [c_x, c_y, c_z]] = corners;
        // Products rounded on their own, never fused: the antisymmetry of the areas rests on it.
        let area_a = c_x * b_y - c_y * b_x;
        let area_b = a_x * c_y - a_y * c_x;
        let area_c = b_x * a_y - b_y * a_x;
        Meeting::new([area_a, area_b, area_c], [a_z, b_z, c_z], inverse_z)
    }

    /// Which of the rays from `place` on have doubtful hits at `t`, see [`crate::accel::triangle`].
    #[inline(always)]
    pub fn doubtful<M: AnyLanes>(&self, reach: f32, t: M, place: usize) -> u32 {
        let inverse_z = self.shear[2].read::<M>(place);
        let asked = Self::asked::<M>(self.count - place);
        t.less(M::splat(reach) * inverse_z.abs()).bits() & asked
    }
}
