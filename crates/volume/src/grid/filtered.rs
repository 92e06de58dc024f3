//! A grid through another filter.

use super::{BrickAccessor, BrickGrid, BrickStorage};
use crate::Filter;
use crate::{DensityField, DensityRange, FieldBounds, VoxelGrid};
use glam::Vec3;

/// The voxels of a [`BrickGrid`] under another filter: the same memory serves as a piecewise
/// constant proposal and as the trilinear truth.
#[derive(Clone, Copy, Debug)]
pub struct FilteredGrid<'a, S> {
    grid: &'a BrickGrid<S>,
    filter: Filter,
}

impl<'a, S: BrickStorage> FilteredGrid<'a, S> {
    pub(super) fn new(grid: &'a BrickGrid<S>, filter: Filter) -> Self {
        Self { grid, filter }
    }

    /// As [`DensityField::accessor`], for as long as the grid lives.
    #[inline]
    pub fn into_accessor(self) -> BrickAccessor<'a, S> {
        self.grid.access(self.filter)
    }
}

impl<S: BrickStorage> DensityField for FilteredGrid<'_, S> {
    type Accessor<'b>
        = BrickAccessor<'b, S>
    where
        Self: 'b;

    fn bounds(&self) -> FieldBounds {
        self.grid.bounds()
    }

    #[inline]
    fn accessor(&self) -> BrickAccessor<'_, S> {
        self.grid.access(self.filter)
    }

    fn range(&self, low: Vec3, high: Vec3) -> DensityRange {
        self.grid.range_by(self.filter, low, high)
    }
}

impl<S: BrickStorage> VoxelGrid for FilteredGrid<'_, S> {
    #[inline]
    fn size(&self) -> [u32; 3] {
        self.grid.size()
    }

    #[inline]
    fn filter(&self) -> Filter {
        self.filter
    }

    #[inline]
    fn voxel(&self, voxel: [u32; 3]) -> f32 {
        self.grid.voxel(voxel)
    }

    #[inline]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        self.grid.corners(cell)
    }
}
