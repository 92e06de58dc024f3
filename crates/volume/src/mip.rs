//! Coarser versions of a grid.
//!
//! Level `l` has a voxel for each cube of `2^l` voxels of the grid: with its mean for cheap
//! transmittances (Lin 2022 §5.5.1: shadow segments at level 2, reuse at level 1) and as proposal
//! for distances (§5.4.1), and with bounds for majorants.

use crate::{DenseGrid, DensityRange, FieldRay, Filter, GridError, MajorantError, MajorantGrid, VoxelGrid};
use glam::Vec3;
use std::fmt;

/// Most levels of a [`MipPyramid`].
pub const MAX_MIP_LEVELS: u32 = 14;

/// Why a [`MipPyramid`] is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MipError {
    /// The number of levels is 0 or above [`MAX_MIP_LEVELS`].
    Levels(u32),
    /// The bounds of a level.
    Majorants(MajorantError),
    /// The voxels of a level.
    Grid(GridError),
}

impl fmt::Display for MipError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Levels(levels) => write!(f, "{levels} levels; there must be 1 to {MAX_MIP_LEVELS}"),
            Self::Majorants(_) => write!(f, "the bounds of a level"),
            Self::Grid(_) => write!(f, "the voxels of a level"),
        }
    }
}

impl std::error::Error for MipError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Levels(_) => None,
            Self::Majorants(error) => Some(error),
            Self::Grid(error) => Some(error),
        }
    }
}

/// One coarser version of a grid.
#[derive(Clone, Debug)]
pub struct MipLevel {
    density: DenseGrid,
    majorants: MajorantGrid,
    scale: f32,
}

impl MipLevel {
    /// The means, in a space of the level's own ([`MipLevel::ray`]), piecewise constant;
    /// [`DenseGrid::filtered`] shows them trilinear.
    ///
    /// As a piecewise constant density they are positive wherever the grid's density is: a voxel of
    /// mean 0 next to a positive one, into which interpolation reaches, has the mean of itself and
    /// its surroundings instead (Lin 2022 §5.4.1). So a proposal by
    /// [`regular_flight`](crate::regular_flight) misses nothing.
    pub fn density(&self) -> &DenseGrid {
        &self.density
    }

    /// Bounds of the grid's own density, for each voxel of this level, in the grid's space: least
    /// and greatest, with the apron that interpolation reads.
    pub fn majorants(&self) -> &MajorantGrid {
        &self.majorants
    }

    /// A ray of the grid's space in the space of this level; `t` is unchanged.
    #[inline]
    pub fn ray(&self, ray: &FieldRay) -> FieldRay {
        FieldRay::new(ray.origin * self.scale, ray.direction * self.scale)
    }
}

/// Coarser versions of a grid, each of half the resolution of the one before.
#[derive(Clone, Debug)]
pub struct MipPyramid {
    levels: Vec<MipLevel>,
}

impl MipPyramid {
    /// Levels 1 to `levels` of a grid.
    ///
    /// # Errors
    /// [`MipError`].
    pub fn new<G: VoxelGrid + Sync>(grid: &G, levels: u32) -> Result<Self, MipError> {
        if !(1..=MAX_MIP_LEVELS).contains(&levels) {
            return Err(MipError::Levels(levels));
        }
        let size = grid.size();
        let mut means = Means::of(grid);
        let mut built = Vec::with_capacity(levels as usize);
        for level in 1..=levels {
            means = means.halved(size, level);
            let edge = (1u32 << level) as f32;
            let majorants = MajorantGrid::new(grid, edge).map_err(MipError::Majorants)?;
            let values: Vec<f32> = means
                .values
                .iter()
                .enumerate()
                .map(|(index, &mean)| {
                    let reached = majorants.range_of(index).max > 0.0;
                    let mean = if mean > 0.0 || !reached {
                        mean
                    } else {
                        means.around(index)
                    };
                    // Means of the least values round to 0, but positive ones must stay positive.
                    if reached {
                        (mean as f32).max(f32::from_bits(1))
                    } else {
                        mean as f32
                    }
                })
                .collect();
            let density = DenseGrid::new(means.size, &values, Filter::Nearest).map_err(MipError::Grid)?;
            built.push(MipLevel {
                density: density.with_extent(Vec3::from_array(size.map(|n| n as f32)) / edge),
                majorants,
                scale: edge.recip(),
            });
        }
        Ok(Self { levels: built })
    }

    /// Level `level`, from 1 on; `None` beyond the last and for 0, which is the grid itself.
    pub fn level(&self, level: u32) -> Option<&MipLevel> {
        self.levels.get((level as usize).checked_sub(1)?)
    }
}

/// Means over cubes, in `f64`.
struct Means {
    size: [u32; 3],
    values: Vec<f64>,
}

impl Means {
    fn of(grid: &impl VoxelGrid) -> Self {
        let size = grid.size();
        let [nx, ny, nz] = size;
        let mut values = Vec::with_capacity(nx as usize * ny as usize * nz as usize);
        for z in 0..nz {
            for y in 0..ny {
                values.extend((0..nx).map(|x| f64::from(grid.voxel([x, y, z]))));
            }
        }
        Self { size, values }
    }

    fn at(&self, [x, y, z]: [u32; 3]) -> f64 {
        let [nx, ny, _] = self.size.map(|n| n as usize);
        self.values[(z as usize * ny + y as usize) * nx + x as usize]
    }

    fn position(&self, index: usize) -> [u32; 3] {
        let [nx, ny, _] = self.size.map(|n| n as usize);
        [index % nx, index / nx % ny, index / (nx * ny)].map(|i| i as u32)
    }

    /// Level `level` from the previous one; a grid of `whole` voxels may end within a cube, which
    /// has the mean of the voxels inside.
    fn halved(&self, whole: [u32; 3], level: u32) -> Self {
        // Voxels of the grid in voxel `i` of the level before, along an axis.
        let covered = |i: u32, axis: usize| {
            let edge = 1u32 << (level - 1);
            f64::from((whole[axis] - i * edge).min(edge))
        };
        let mut halved = Self {
            size: self.size.map(|n| n.div_ceil(2)),
            values: Vec::new(),
        };
        let [nx, ny, nz] = halved.size.map(|n| n as usize);
        halved.values = (0..nx * ny * nz)
            .map(|index| {
                let cube = halved.position(index);
                let (mut sum, mut volume) = (0.0, 0.0);
                for child in 0..8 {
                    let child = core::array::from_fn(|a| 2 * cube[a] + (child >> a & 1));
                    if (0..3).all(|a| child[a] < self.size[a]) {
                        let weight: f64 = (0..3).map(|a| covered(child[a], a)).product();
                        sum += weight * self.at(child);
                        volume += weight;
                    }
                }
                sum / volume
            })
            .collect();
        halved
    }

    /// The mean of a voxel and those that touch it.
    fn around(&self, index: usize) -> f64 {
        let center = self.position(index);
        let low = center.map(|c| c.saturating_sub(1));
        let high: [u32; 3] = core::array::from_fn(|a| (center[a] + 1).min(self.size[a] - 1));
        let (mut sum, mut count) = (0.0, 0.0);
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    sum += self.at([x, y, z]);
                    count += 1.0;
                }
            }
        }
        sum / count
    }
}

impl MajorantGrid {
    /// The bounds of super-voxel `index`, x fastest.
    fn range_of(&self, index: usize) -> DensityRange {
        self.ranges()[index]
    }
}

#[cfg(test)]
mod tests;
