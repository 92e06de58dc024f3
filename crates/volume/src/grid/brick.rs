//! Bricks of 8³ cells with the 9³ voxels at their corners.
//!
//! Cell `c` of an axis lies between the centres of voxels `c − 1` and `c`, `0 ≤ c ≤ n`.
//! Beyond the first and last centre their voxels repeat, so a look-up needs no test for the grid's
//! edge.

use super::{MAX_VOXELS, MAX_VOXELS_PER_AXIS};
use glam::Vec3;
use lightshed_lanes::{LANES, LaneWords, Lanes};

/// Cells of a brick along an axis.
pub(super) const CELLS: usize = 8;
/// Corners of a brick's cells along an axis.
const CORNERS: usize = CELLS + 1;
/// Values of a brick.
pub(super) const VALUES: usize = CORNERS * CORNERS * CORNERS;
/// From a cell's first corner to its last.
pub(super) const LAST_CORNER: usize = 1 + CORNERS + CORNERS * CORNERS;

/// Values at the corners of a brick's cells, x fastest.
pub(super) type Brick = [f32; VALUES];

/// The arrangement of bricks, and the voxels of each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// Voxels.
    pub size: [u32; 3],
    /// The greatest corner of the medium, at most `size`.
    pub extent: Vec3,
    /// Bricks.
    counts: [u32; 3],
}

impl Layout {
    pub fn new(size: [u32; 3]) -> Option<Self> {
        let voxels: u64 = size.iter().map(|&n| u64::from(n)).product();
        let valid = size.iter().all(|&n| (1..=MAX_VOXELS_PER_AXIS).contains(&n)) && voxels <= MAX_VOXELS;
        valid.then(|| Self {
            size,
            extent: Vec3::from_array(size.map(|n| n as f32)),
            // n + 1 cells.
            counts: size.map(|n| n / CELLS as u32 + 1),
        })
    }

    pub fn bricks(&self) -> usize {
        self.counts.iter().map(|&n| n as usize).product()
    }

    /// The brick of a cell and the place of the cell's first corner in it.
    #[inline(always)]
    pub fn locate(&self, cell: [u32; 3]) -> (usize, usize) {
        const MASK: usize = CELLS - 1;
        let [x, y, z] = cell.map(|c| c as usize);
        let [nx, ny, _] = self.counts.map(|n| n as usize);
        let brick = (z / CELLS * ny + y / CELLS) * nx + x / CELLS;
        (brick, ((z & MASK) * CORNERS + (y & MASK)) * CORNERS + (x & MASK))
    }

    /// [`Layout::locate`] of eight cells.
    #[inline(always)]
    pub fn locate_lanes<L: Lanes>(&self, cell: [L::Words; 3]) -> (L::Words, L::Words) {
        const { assert!(CELLS == 8) };
        let mask = L::Words::splat(CELLS as u32 - 1);
        let corners = L::Words::splat(CORNERS as u32);
        let [nx, ny, _] = self.counts.map(L::Words::splat);
        let [x, y, z] = cell;
        let brick = (z.shift_right::<3>() * ny + y.shift_right::<3>()) * nx + x.shift_right::<3>();
        (brick, ((z & mask) * corners + (y & mask)) * corners + (x & mask))
    }

    /// Where brick number `index` is among the bricks.
    pub fn brick_position(&self, index: usize) -> [u32; 3] {
        let [nx, ny, _] = self.counts.map(|n| n as usize);
        [index % nx, index / nx % ny, index / (nx * ny)].map(|b| b as u32)
    }

    /// Every corner of the cells from `first` to `last`, by the brick of each cell.
    pub fn for_each_corner(&self, first: [u32; 3], last: [u32; 3], mut visit: impl FnMut(usize, usize)) {
        const EDGE: u32 = CELLS as u32;
        // Bricks along an axis, and in each the corners of its cells among those asked for.
        let along = |axis: usize| {
            (first[axis] / EDGE..=last[axis] / EDGE).map(move |brick| {
                let from = first[axis].max(brick * EDGE) - brick * EDGE;
                let to = last[axis].min(brick * EDGE + EDGE - 1) - brick * EDGE + 1;
                (brick as usize, from as usize..=to as usize)
            })
        };
        let [nx, ny, _] = self.counts.map(|n| n as usize);
        for (bz, zs) in along(2) {
            for (by, ys) in along(1) {
                for (bx, xs) in along(0) {
                    let brick = (bz * ny + by) * nx + bx;
                    for z in zs.clone() {
                        for y in ys.clone() {
                            for x in xs.clone() {
                                visit(brick, (z * CORNERS + y) * CORNERS + x);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Fills brick number `index`.
    pub fn fill(&self, index: usize, brick: &mut Brick, voxel: impl Fn([u32; 3]) -> f32) {
        let first = self.brick_position(index).map(|b| b as usize * CELLS);
        for (i, value) in brick.iter_mut().enumerate() {
            let corner = [i % CORNERS, i / CORNERS % CORNERS, i / (CORNERS * CORNERS)];
            *value = voxel(core::array::from_fn(|a| {
                ((first[a] + corner[a]).saturating_sub(1) as u32).min(self.size[a] - 1)
            }));
        }
    }
}

/// From a cell's first corner to all of them, x fastest.
pub(super) const CELL_CORNERS: [usize; 8] = {
    const Y: usize = CORNERS;
    const Z: usize = CORNERS * CORNERS;
    [0, 1, Y, Y + 1, Z, Z + 1, Z + Y, Z + Y + 1]
};

/// The corners of eight cells, by corner, each from a brick of its own.
#[inline(always)]
pub(super) fn cells_of<L: Lanes>(bricks: [&Brick; LANES], first: [u32; LANES]) -> [L; 8] {
    // Pairs along x: near and far along y, and both again behind.
    let (mut near, mut far) = ([&[0.0; 2]; LANES], [&[0.0; 2]; LANES]);
    let (mut near_behind, mut far_behind) = (near, far);
    for lane in 0..LANES {
        // No cell begins later; this helps the compiler.
        let first = (first[lane] as usize).min(VALUES - 1 - LAST_CORNER);
        let brick = bricks[lane];
        near[lane] = pair(brick, first);
        far[lane] = pair(brick, first + CELL_CORNERS[2]);
        near_behind[lane] = pair(brick, first + CELL_CORNERS[4]);
        far_behind[lane] = pair(brick, first + CELL_CORNERS[6]);
    }
    let [c0, c1] = L::load_pairs(near);
    let [c2, c3] = L::load_pairs(far);
    let [c4, c5] = L::load_pairs(near_behind);
    let [c6, c7] = L::load_pairs(far_behind);
    [c0, c1, c2, c3, c4, c5, c6, c7]
}

/// The values at a place and the next.
#[inline(always)]
fn pair(brick: &Brick, place: usize) -> &[f32; 2] {
    brick[place..].first_chunk().unwrap_or(&[0.0; 2])
}
