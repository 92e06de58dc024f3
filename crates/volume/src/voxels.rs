//! The interface between regular tracking and a grid.

use crate::{DensityField, Filter};

/// A density made of voxels: `n_x × n_y × n_z` values in a space that counts voxels, from 0 to
/// `n` along each axis.
pub trait VoxelGrid: DensityField {
    /// Voxels along each axis.
    fn size(&self) -> [u32; 3];

    /// How voxels make a density.
    fn filter(&self) -> Filter;

    /// The value of the voxel `[x, y, z]`; of the nearest voxel for indices out of range.
    fn voxel(&self, voxel: [u32; 3]) -> f32;

    /// The eight voxels around cell `[x, y, z]`, x fastest: along each axis cell `c ≤ n` lies
    /// between the centres of voxels `c − 1` and `c`, of which the one beyond the grid repeats
    /// the other.
    fn corners(&self, cell: [u32; 3]) -> [f32; 8];
}
