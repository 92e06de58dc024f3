//! Bricks that are not empty.

use super::brick::{self, Brick, CELLS, Layout, VALUES};
use super::dense::check_values;
use super::storage::sealed::Bricks;
use super::{BrickGrid, Filter, GridError, SparseGrid};
use crate::DensityRange;
use lightshed_lanes::{LANES, LaneWords, Lanes};

/// The values of a [`SparseGrid`]: of the bricks in which anything is positive, and one brick of
/// zeros for all others.
#[derive(Clone, Debug)]
pub struct SparseBricks {
    /// Where a brick's values are.
    table: Vec<u32>,
    /// The first is that of zeros.
    bricks: Vec<Brick>,
}

impl Bricks for SparseBricks {
    #[inline(always)]
    fn corner(&self, brick: usize, corner: usize) -> f32 {
        self.bricks[self.table[brick] as usize][corner]
    }

    #[inline(always)]
    fn cell(&self, brick: usize, first: usize) -> [f32; 8] {
        let brick = &self.bricks[self.table[brick] as usize];
        brick::CELL_CORNERS.map(|offset| brick[first + offset])
    }

    #[inline(always)]
    fn cells<L: Lanes>(&self, brick: L::Words, first: L::Words) -> [L; 8] {
        let brick = brick.store();
        let mut bricks = [&self.bricks[0]; LANES];
        for lane in 0..LANES {
            bricks[lane] = &self.bricks[self.table[brick[lane] as usize] as usize];
        }
        brick::cells_of(bricks, first.store())
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.table) + size_of_val(&*self.bricks)
    }
}

/// A cube of 8³ voxels of a sparse grid.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelBlock {
    /// Its least voxel; multiples of 8.
    pub origin: [u32; 3],
    /// The values, x fastest, then y, then z. Those of voxels beyond the grid are ignored.
    pub values: [f32; 512],
}

impl SparseGrid {
    /// From the `blocks` that are not empty; everywhere else the density is 0.
    ///
    /// # Errors
    /// [`GridError`] for sizes out of range, values that are negative or not finite, and blocks out
    /// of place.
    pub fn from_blocks(size: [u32; 3], blocks: &[VoxelBlock], filter: Filter) -> Result<Self, GridError> {
        let layout = Layout::new(size).ok_or(GridError::Size(size))?;
        let counts = size.map(|n| n.div_ceil(CELLS as u32));
        let place = |[x, y, z]: [u32; 3]| {
            (z as usize * counts[1] as usize + y as usize) * counts[0] as usize + x as usize
        };
        let mut at = vec![u32::MAX; counts.iter().map(|&n| n as usize).product()];
        let mut whole = DensityRange::EMPTY;
        for (index, block) in blocks.iter().enumerate() {
            let inside =
                (0..3).all(|a| block.origin[a] < size[a] && block.origin[a].is_multiple_of(CELLS as u32));
            if !inside {
                return Err(GridError::Block(index));
            }
            let slot = &mut at[place(block.origin.map(|x| x / CELLS as u32))];
            if *slot != u32::MAX {
                return Err(GridError::Block(index));
            }
            *slot = index as u32;
            whole = whole.union(check_values(&block.values, 512 * index as u64)?);
        }
        if blocks.len() < at.len() {
            whole = whole.union(DensityRange { min: 0.0, max: 0.0 });
        }
        let voxel = |voxel: [u32; 3]| {
            let index = at[place(voxel.map(|x| x / CELLS as u32))];
            let [x, y, z] = voxel.map(|x| x as usize % CELLS);
            blocks
                .get(index as usize)
                .map_or(0.0, |block| block.values[(z * CELLS + y) * CELLS + x])
        };
        let mut storage = SparseBricks {
            table: vec![0; layout.bricks()],
            bricks: vec![[0.0; VALUES]],
        };
        let mut brick = [0.0; VALUES];
        for index in 0..layout.bricks() {
            // A brick reads its own block and those before it along each axis.
            let own = layout.brick_position(index);
            let touched = (0..8).any(|corner| {
                let block =
                    core::array::from_fn(|a| own[a].saturating_sub(corner >> a & 1).min(counts[a] - 1));
                at[place(block)] != u32::MAX
            });
            if !touched {
                continue;
            }
            layout.fill(index, &mut brick, voxel);
            if brick.iter().any(|&value| value > 0.0) {
                storage.table[index] = storage.bricks.len() as u32;
                storage.bricks.push(brick);
            }
        }
        Ok(BrickGrid {
            layout,
            storage,
            filter,
            whole,
        })
    }
}
