//! Majorants along eight rays at once.

use super::MajorantGrid;
use lightshed_lanes::{LANES, LaneMask, LaneWords, Lanes, Vec3Lanes};

impl MajorantGrid {
    /// Of eight rays, one a lane, from points in the field: the majorants' optical depth
    /// `∫ ρ̄ dt` up to where they leave the field, but no further than `t_max`, and that end.
    /// It is the sum over [`segments`](Self::segments), but for rounding of `f32`. `along` is the
    /// movement per unit of `t`. Values of rays that are not finite are unspecified.
    ///
    /// For [lane kernels](lightshed_lanes::LaneKernel).
    #[inline(always)]
    pub fn depths<L: Lanes>(&self, from: Vec3Lanes<L>, along: Vec3Lanes<L>, t_max: L) -> [L; 2] {
        let lattice = &self.lattice;
        let (scale, zero) = (lattice.scale as f32, L::splat(0.0));
        let extent = (self.bounds.max() - self.bounds.min()) * scale;
        let place = (from - Vec3Lanes::splat(self.bounds.min().to_array())) * L::splat(scale);
        let (place, along) = ([place.x, place.y, place.z], [along.x, along.y, along.z]);
        let [nx, ny, _] = lattice.counts;
        let strides = [1.0, nx as f32, nx as f32 * ny as f32];
        let (mut index, mut end) = (zero, t_max);
        // Where each ray leaves its super-voxel, from there to the next plane, and how the index
        // changes there.
        let (mut next, mut delta, mut stride) = ([zero; 3], [zero; 3], [zero; 3]);
        for axis in 0..3 {
            let movement = along[axis] * L::splat(scale);
            let inverse = L::splat(1.0) / movement;
            let last = L::splat((lattice.counts[axis] - 1) as f32);
            let cell = L::from_integers(place[axis].max(zero).min(last).to_integers());
            index = index + cell * L::splat(strides[axis]);
            let (forward, moves) = (zero.less(movement), zero.less(movement.abs()));
            let step = L::splat(1.0).select(forward, zero);
            let endless = L::splat(f32::INFINITY);
            next[axis] = ((cell + step - place[axis]) * inverse).select(moves, endless);
            delta[axis] = inverse.abs();
            stride[axis] = L::splat(strides[axis]).select(forward, L::splat(-strides[axis]));
            let face = L::splat(extent[axis]).select(forward, zero);
            let leaves = ((face - place[axis]) * inverse).select(moves, endless);
            end = end.min(leaves);
        }
        let most = L::splat((self.ranges.len() - 1) as f32);
        let (mut now, mut depth) = (zero, zero);
        let [nx, ny, nz] = lattice.counts;
        // Each plane is passed once.
        for _ in 0..nx.saturating_add(ny).saturating_add(nz) {
            let nearest = next[0].min(next[1].min(next[2]));
            let until = nearest.min(end);
            let cells = index.max(zero).min(most).to_integers();
            depth = depth + self.majorants_of_cells::<L>(cells) * (until - now).max(zero);
            now = until.max(now);
            if nearest.less(end).bits() == 0 {
                break;
            }
            for axis in 0..3 {
                let passes = next[axis].less_equal(nearest);
                index = index + stride[axis].select(passes, zero);
                next[axis] = (next[axis] + delta[axis]).select(passes, next[axis]);
            }
        }
        [depth, end]
    }

    /// The majorants `ρ̄` at eight points, one a lane: those of the super-voxels that they are in,
    /// or, of points outside, of ones nearby.
    ///
    /// For [lane kernels](lightshed_lanes::LaneKernel).
    #[inline(always)]
    pub fn majorants_at<L: Lanes>(&self, points: Vec3Lanes<L>) -> L {
        let lattice = &self.lattice;
        let place =
            (points - Vec3Lanes::splat(self.bounds.min().to_array())) * L::splat(lattice.scale as f32);
        let [nx, ny, nz] = lattice.counts;
        let cell = |place: L, count: u32| {
            let last = L::splat((count - 1) as f32);
            L::from_integers(place.max(L::splat(0.0)).min(last).to_integers())
        };
        let (x, y, z) = (cell(place.x, nx), cell(place.y, ny), cell(place.z, nz));
        let index = x + (y + z * L::splat(ny as f32)) * L::splat(nx as f32);
        self.majorants_of_cells::<L>(index.to_integers())
    }

    /// Whether [`depths`](Self::depths) and [`majorants_at`](Self::majorants_at) can count the
    /// super-voxels: there are at most 2²⁴.
    pub fn fits_lanes(&self) -> bool {
        self.ranges.len() <= 1 << 24
    }

    #[inline(always)]
    fn majorants_of_cells<L: Lanes>(&self, cells: L::Words) -> L {
        let cells = cells.store();
        let mut values = [0.0; LANES];
        for lane in 0..LANES {
            values[lane] = self
                .ranges
                .get(cells[lane] as usize)
                .map_or(0.0, |range| range.max);
        }
        L::load(&values)
    }
}
