//! Interpolation of voxels.

/// How a grid's voxels make a density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// Voxel `i` fills `[i, i+1)`: piecewise constant.
    Nearest,
    /// Voxel `i` is centred at `i + ½`. Between centres the density is linear along each axis;
    /// beyond the outermost centres it is that of the nearest.
    #[default]
    Trilinear,
}
