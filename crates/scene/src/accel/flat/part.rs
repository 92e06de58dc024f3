//! Things that stand apart from the rest: only rays that enter the box around one are tested
//! against it, moved side by side.

use super::Quad;
use crate::accel::wide::FAR_WIDENING;
use crate::accel::{HitBatch, RayBatch};
use glam::Vec3;
use lightshed_lanes::{AnyLanes, Lanes, Vec3Lanes};

/// Most of these in a scene.
pub const MAX_PARTS: usize = 4;
/// Fewer triangles are tested as fast as a box.
pub const MIN_TRIANGLES: usize = 8;

/// Triangles that hang together.
#[derive(Clone, Debug)]
pub struct Part {
    /// Distinct corners, as in [`Flat`](super::Flat).
    pub vertices: Vec<[f32; 4]>,
    /// Quads of these corners; numbers are those of the order given.
    pub quads: Vec<Quad>,
    /// A box around them with some room, for the rounding error of the test of a triangle.
    pub bounds: [Vec3; 2],
}

impl Part {
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(&self.vertices[..]) + size_of_val(&self.quads[..])
    }

    /// Which rays enter the box before `t_max`, given one over the coordinates of the direction.
    #[inline(always)]
    pub fn is_entered<L: AnyLanes>(&self, origin: Vec3Lanes<L>, inverse: Vec3Lanes<L>, t_max: L) -> L::Mask {
        let [least, most] = self.bounds.map(|corner| Vec3Lanes::<L>::splat(corner.to_array()));
        let one = least - origin;
        let other = most - origin;
        let (x, y, z) = (
            [one.x * inverse.x, other.x * inverse.x],
            [one.y * inverse.y, other.y * inverse.y],
            [one.z * inverse.z, other.z * inverse.z],
        );
        // Zero by infinity is NaN where a ray runs in a face, and such a face has room: any answer
        // will do. What may be NaN comes first, see `Lanes`.
        let zero = L::splat(0.0);
        let near = x[0].min(x[1]).max(y[0].min(y[1]).max(z[0].min(z[1]).max(zero)));
        let far = x[0].max(x[1]).min(y[0].max(y[1]).min(z[0].max(z[1]).min(t_max)));
        near.less_equal(far * L::splat(FAR_WIDENING))
    }
}

/// Rays of a batch, side by side, and their hits.
pub struct Gathered {
    pub rays: RayBatch,
    pub count: usize,
    pub hits: HitBatch,
}

impl Gathered {
    pub const NONE: Self = Self {
        rays: RayBatch::NOWHERE,
        count: 0,
        hits: HitBatch::NONE,
    };

    /// The rays of the set bits of `mask`, in their order.
    #[inline(always)]
    pub fn take<L: Lanes>(&mut self, from: &RayBatch, mask: u64) {
        self.count = 0;
        let mut place = 0;
        while place < RayBatch::CAPACITY {
            let bits = (mask >> place) as u32 & 0xff;
            if bits != 0 {
                let [origin, direction] = from.load::<L>(place);
                let t_max = from.t_max.load(place);
                self.rays
                    .store_compressed(self.count, origin, direction, t_max, bits);
                self.count += bits.count_ones() as usize;
            }
            place += 8;
        }
    }
}
