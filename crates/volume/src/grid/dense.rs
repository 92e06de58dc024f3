//! All bricks, in full.

use super::brick::{self, Brick, Layout, VALUES};
use super::storage::sealed::Bricks;
use super::{BrickGrid, DenseGrid, GridError};
use crate::DensityRange;
use crate::Filter;
use lightshed_lanes::{LANES, LaneWords, Lanes};
use lightshed_sampling::parallel::for_each_chunk;

/// The values of a [`DenseGrid`], all of them.
#[derive(Clone, Debug)]
pub struct DenseBricks(pub(super) Vec<Brick>);

impl Bricks for DenseBricks {
    #[inline(always)]
    fn corner(&self, brick: usize, corner: usize) -> f32 {
        self.0[brick][corner]
    }

    #[inline(always)]
    fn cell(&self, brick: usize, first: usize) -> [f32; 8] {
        let brick = &self.0[brick];
        brick::CELL_CORNERS.map(|offset| brick[first + offset])
    }

    #[inline(always)]
    fn cells<L: Lanes>(&self, brick: L::Words, first: L::Words) -> [L; 8] {
        let brick = brick.store();
        let mut bricks = [&self.0[0]; LANES];
        for lane in 0..LANES {
            bricks[lane] = &self.0[brick[lane] as usize];
        }
        brick::cells_of(bricks, first.store())
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}

/// The range of values, if all are finite and not negative.
pub(super) fn check_values(values: &[f32], first: u64) -> Result<DensityRange, GridError> {
    let mut whole = DensityRange::EMPTY;
    for (index, &value) in (first..).zip(values) {
        if !(0.0..=f32::MAX).contains(&value) {
            return Err(GridError::Value(index));
        }
        whole = whole.union(DensityRange {
            min: value,
            max: value,
        });
    }
    Ok(whole)
}

impl DenseGrid {
    /// From `nx · ny · nz` values, x fastest, then y, then z: voxel `(x, y, z)` is
    /// `values[(z · ny + y) · nx + x]`, the order of Mitsuba's `.vol` files.
    ///
    /// # Errors
    /// [`GridError`] for sizes out of range and values that are negative or not finite.
    pub fn new(size: [u32; 3], values: &[f32], filter: Filter) -> Result<Self, GridError> {
        let layout = Layout::new(size).ok_or(GridError::Size(size))?;
        let expected = size.iter().map(|&n| u64::from(n)).product();
        let found = values.len() as u64;
        if found != expected {
            return Err(GridError::Count { expected, found });
        }
        let whole = check_values(values, 0)?;
        let mut bricks = vec![[0.0; VALUES]; layout.bricks()];
        for_each_chunk(&mut bricks, 64, |start, chunk| {
            for (index, brick) in (start..).zip(chunk) {
                layout.fill(index, brick, |[x, y, z]| {
                    values[(z as usize * size[1] as usize + y as usize) * size[0] as usize + x as usize]
                });
            }
        });
        Ok(BrickGrid {
            layout,
            storage: DenseBricks(bricks),
            filter,
            whole,
        })
    }

    /// From a function of the voxel's indices `[x, y, z]`.
    ///
    /// # Errors
    /// As [`DenseGrid::new`].
    pub fn from_fn(
        size: [u32; 3],
        filter: Filter,
        mut value: impl FnMut([u32; 3]) -> f32,
    ) -> Result<Self, GridError> {
        Layout::new(size).ok_or(GridError::Size(size))?;
        let [nx, ny, nz] = size;
        let mut values = Vec::with_capacity(nx as usize * ny as usize * nz as usize);
        for z in 0..nz {
            for y in 0..ny {
                values.extend((0..nx).map(|x| value([x, y, z])));
            }
        }
        Self::new(size, &values, filter)
    }

    /// The same with bounds that end within the last voxels, at `extent`.
    pub(crate) fn with_extent(mut self, extent: glam::Vec3) -> Self {
        self.layout.extent = extent;
        self
    }
}
