//! Primitives as builders move them: 32 bytes, one row of lanes.

use crate::node::Node;
use bytemuck::{Pod, Zeroable};
use glam::{BVec4A, Vec3, Vec4, Vec4Swizzles};
use lightshed_lanes::Lanes;
use lightshed_spatial::Bounds;

/// Added to an index where it is stored as the bits of a float: indices below 2²⁹ become finite
/// normal numbers, on which arithmetic is as fast as on any.
const TAG: u32 = 1 << 30;

/// The lanes of a corner.
const XYZ: BVec4A = BVec4A::new(true, true, true, false);

/// A box and the index of its primitive.
///
/// The greatest corner is stored negated: the union of two boxes is then one minimum of all lanes,
/// and the doubled centre is one difference.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct BoxItem {
    /// Least corner, and the index's bits.
    pub low: Vec4,
    /// Greatest corner, negated.
    pub high: Vec4,
}

const _: () = assert!(size_of::<BoxItem>() == 32);

impl BoxItem {
    /// What a union starts from.
    pub const EMPTY: Self = Self {
        low: Vec4::INFINITY,
        high: Vec4::INFINITY,
    };

    #[inline(always)]
    pub fn new(bounds: &Bounds, index: u32) -> Self {
        Self::from_corners([bounds.min.extend(0.0), bounds.max.extend(0.0)], index)
    }

    /// Of the box between these corners, whose fourth coordinate means nothing.
    #[inline(always)]
    pub fn from_corners([min, max]: [Vec4; 2], index: u32) -> Self {
        let tag = Vec4::new(0.0, 0.0, 0.0, f32::from_bits(index | TAG));
        Self {
            // Zeros become positive, so that minima are the same in any order.
            low: Vec4::select(XYZ, min + Vec4::ZERO, tag),
            high: Vec4::select(XYZ, Vec4::ZERO - max, Vec4::ZERO),
        }
    }

    #[inline(always)]
    pub fn index(&self) -> u32 {
        self.low.w.to_bits() ^ TAG
    }

    #[inline(always)]
    pub fn with_index(self, index: u32) -> Self {
        Self {
            low: self.low.xyz().extend(f32::from_bits(index | TAG)),
            ..self
        }
    }

    /// The sum of both corners; the fourth coordinate means nothing and is finite.
    #[inline(always)]
    pub fn doubled_center(&self) -> Vec4 {
        self.low - self.high
    }

    /// The row of lanes: least corner, index, negated greatest corner, nothing.
    #[inline(always)]
    pub fn row(&self) -> &[f32; 8] {
        bytemuck::cast_ref(self)
    }

    #[inline(always)]
    pub fn from_row(row: [f32; 8]) -> Self {
        bytemuck::cast(row)
    }

    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.min(other.high),
        }
    }

    /// Whether both have the same box.
    #[inline(always)]
    pub fn has_box_of(&self, other: &Self) -> bool {
        let equal = self.low.cmpeq(other.low).bitmask() & self.high.cmpeq(other.high).bitmask();
        equal & 7 == 7
    }

    /// Half the surface area; of a box that is not empty.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        // Minus the diagonal; signs cancel.
        let d = (self.low + self.high).xyz();
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// The diagonal's squared length.
    #[inline(always)]
    pub fn diagonal_squared(&self) -> f32 {
        (self.low + self.high).xyz().length_squared()
    }

    #[inline(always)]
    pub fn min(&self) -> Vec3 {
        self.low.xyz()
    }

    #[inline(always)]
    pub fn max(&self) -> Vec3 {
        Vec3::ZERO - self.high.xyz()
    }

    /// The node around it, in the bits of an item: nodes are written over items.
    #[inline(always)]
    pub fn cell(&self, first: u32, count: u32) -> Self {
        bytemuck::cast(self.node(first, count))
    }

    /// The node around it.
    #[inline(always)]
    pub fn node(&self, first: u32, count: u32) -> Node {
        Node {
            min: self.min(),
            first,
            max: self.max(),
            count,
        }
    }
}

/// Half areas of eight boxes, from `rows[at]` on.
#[inline(always)]
pub fn half_areas<L: Lanes>(rows: &[[f32; 8]], at: usize) -> L {
    let [x, y, z, _, u, v, w, _] = L::load_transposed([
        &rows[at],
        &rows[at + 1],
        &rows[at + 2],
        &rows[at + 3],
        &rows[at + 4],
        &rows[at + 5],
        &rows[at + 6],
        &rows[at + 7],
    ]);
    let (x, y, z) = (x + u, y + v, z + w);
    x * y + y * z + z * x
}
