//! Grids of voxels.

mod brick;
mod dense;
mod filtered;
mod quantized;
mod sparse;
mod storage;
#[cfg(test)]
mod tests;

pub use dense::DenseBricks;
pub use filtered::FilteredGrid;
pub use quantized::QuantizedBricks;
pub use sparse::{SparseBricks, VoxelBlock};
pub use storage::BrickStorage;

use crate::{DensityAccessor, DensityField, DensityRange, FieldBounds, FieldRay, Filter, VoxelGrid};
use brick::Layout;
use glam::Vec3;
use lightshed_lanes::{LaneWords, Lanes, Vec3Lanes};
use std::fmt;

/// Most voxels along an axis.
pub const MAX_VOXELS_PER_AXIS: u32 = 1 << 14;

/// Most voxels of a grid.
pub const MAX_VOXELS: u64 = 1 << 32;

/// Why a grid is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GridError {
    /// An axis has no voxels or more than [`MAX_VOXELS_PER_AXIS`], or there are more than
    /// [`MAX_VOXELS`].
    Size([u32; 3]),
    /// The number of values is not that of voxels.
    Count {
        /// Voxels.
        expected: u64,
        /// Values.
        found: u64,
    },
    /// The value at this index is negative or not finite; of a block, the index counts all values
    /// of the blocks before.
    Value(u64),
    /// A block does not lie on the lattice of blocks, or lies outside of the grid, or two have the
    /// same place. The index of the block.
    Block(usize),
}

impl fmt::Display for GridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size([x, y, z]) => write!(
                f,
                "a grid of {x} by {y} by {z} voxels; each axis must have 1 to {MAX_VOXELS_PER_AXIS}, all together at most {MAX_VOXELS}"
            ),
            Self::Count { expected, found } => write!(f, "{found} values for {expected} voxels"),
            Self::Value(index) => write!(f, "value {index} of the grid is negative or not finite"),
            Self::Block(index) => write!(
                f,
                "block {index} is not at a multiple of 8 within the grid, or at the place of another"
            ),
        }
    }
}

impl std::error::Error for GridError {}

/// A grid of `nx × ny × nz` voxels of density, filling `[0, nx] × [0, ny] × [0, nz]`: its space
/// counts voxels.
///
/// Outside of this box there is no medium; up to its faces a trilinear density keeps the value of
/// the outermost centres, as Mitsuba's `gridvolume` does with its wrap mode `clamp`.
///
/// Its voxels are kept in one of several forms `S`: [`DenseGrid`], [`SparseGrid`], [`Grid8`],
/// [`Grid4`].
///
/// # Performance
/// All have bricks of 8³ cells with the 9³ voxels at their corners: the eight voxels of a lookup
/// are always in the same brick, for 1.42 times as many values as voxels (more for grids of less
/// than 8 voxels along an axis).
#[derive(Clone, Debug)]
pub struct BrickGrid<S> {
    layout: Layout,
    storage: S,
    filter: Filter,
    whole: DensityRange,
}

/// A grid with all its voxels in 32 bits each: 5.7 bytes a voxel.
pub type DenseGrid = BrickGrid<DenseBricks>;

/// A grid without memory for bricks in which everything is 0: 5.7 bytes a voxel of the others.
pub type SparseGrid = BrickGrid<SparseBricks>;

/// A grid of 8 bits a value, 1.44 bytes a voxel; see [`QuantizedBricks`].
pub type Grid8 = BrickGrid<QuantizedBricks<8, 729>>;

/// A grid of 4 bits a value, 0.73 bytes a voxel; see [`QuantizedBricks`].
pub type Grid4 = BrickGrid<QuantizedBricks<4, 365>>;

/// Looks up a [`DenseGrid`].
pub type DenseAccessor<'a> = BrickAccessor<'a, DenseBricks>;

impl<S: BrickStorage> BrickGrid<S> {
    /// The same voxels under another filter.
    #[must_use]
    pub fn with_filter(mut self, filter: Filter) -> Self {
        self.filter = filter;
        self
    }

    /// These voxels seen through another filter, without a copy.
    pub fn filtered(&self, filter: Filter) -> FilteredGrid<'_, S> {
        FilteredGrid::new(self, filter)
    }

    /// Voxels along each axis.
    pub fn size(&self) -> [u32; 3] {
        self.layout.size
    }

    /// The least and greatest voxel.
    pub fn value_range(&self) -> DensityRange {
        self.whole
    }

    /// Bytes of all voxels.
    pub fn bytes(&self) -> usize {
        self.storage.bytes()
    }

    fn access(&self, filter: Filter) -> BrickAccessor<'_, S> {
        BrickAccessor {
            grid: self,
            limit: Vec3::from_array(self.layout.size.map(|n| n as f32)),
            filter,
        }
    }

    /// As [`DensityField::range`], under `filter`.
    fn range_by(&self, filter: Filter, low: Vec3, high: Vec3) -> DensityRange {
        let size = self.layout.size;
        let mut range = DensityRange::EMPTY;
        let mut add = |value: f32| {
            range = range.union(DensityRange {
                min: value,
                max: value,
            });
        };
        match filter {
            Filter::Nearest => {
                let first: [u32; 3] = core::array::from_fn(|a| (low[a] as u32).min(size[a] - 1));
                let last: [u32; 3] = core::array::from_fn(|a| (high[a] as u32).min(size[a] - 1));
                for z in first[2]..=last[2] {
                    for y in first[1]..=last[1] {
                        for x in first[0]..=last[0] {
                            add(self.voxel([x, y, z]));
                        }
                    }
                }
            }
            // All corners of the cells that the box touches, each from the brick that holds the
            // cell: bricks may differ in what they keep of a voxel they share.
            Filter::Trilinear => {
                let first: [u32; 3] = core::array::from_fn(|a| ((low[a] + 0.5) as u32).min(size[a]));
                let last: [u32; 3] = core::array::from_fn(|a| ((high[a] + 0.5) as u32).min(size[a]));
                self.layout.for_each_corner(first, last, |brick, corner| {
                    add(self.storage.corner(brick, corner));
                });
            }
        }
        range
    }
}

impl<S: BrickStorage> DensityField for BrickGrid<S> {
    type Accessor<'a>
        = BrickAccessor<'a, S>
    where
        S: 'a;

    fn bounds(&self) -> FieldBounds {
        FieldBounds::new(Vec3::ZERO, self.layout.extent).unwrap_or(FieldBounds::ALL)
    }

    #[inline]
    fn accessor(&self) -> BrickAccessor<'_, S> {
        self.access(self.filter)
    }

    fn range(&self, low: Vec3, high: Vec3) -> DensityRange {
        self.range_by(self.filter, low, high)
    }
}

impl<S: BrickStorage> VoxelGrid for BrickGrid<S> {
    #[inline]
    fn size(&self) -> [u32; 3] {
        self.layout.size
    }

    #[inline]
    fn filter(&self) -> Filter {
        self.filter
    }

    #[inline]
    fn voxel(&self, voxel: [u32; 3]) -> f32 {
        // A voxel is the last corner of the cell with its own index.
        let last = self.layout.size.map(|n| n - 1);
        let cell = core::array::from_fn(|a| voxel[a].min(last[a]));
        let (brick, corner) = self.layout.locate(cell);
        self.storage.corner(brick, corner + brick::LAST_CORNER)
    }

    #[inline]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        let cell = core::array::from_fn(|a| cell[a].min(self.layout.size[a]));
        let (brick, corner) = self.layout.locate(cell);
        self.storage.cell(brick, corner)
    }
}

/// Looks up a [`BrickGrid`]. It keeps only a reference to the grid: testing whether the cell is
/// still the same costs more than reading its eight voxels.
#[derive(Clone, Debug)]
pub struct BrickAccessor<'a, S> {
    grid: &'a BrickGrid<S>,
    limit: Vec3,
    filter: Filter,
}

impl<S: BrickStorage> DensityAccessor for BrickAccessor<'_, S> {
    #[inline(always)]
    fn density(&mut self, position: Vec3) -> f32 {
        let layout = &self.grid.layout;
        match self.filter {
            Filter::Nearest => {
                let p = position.max(Vec3::ZERO).min(self.limit - Vec3::ONE);
                let cell = [p.x as u32, p.y as u32, p.z as u32];
                let (brick, corner) = layout.locate(cell);
                self.grid.storage.corner(brick, corner + brick::LAST_CORNER)
            }
            Filter::Trilinear => {
                // Cell c lies between the centres of voxels c − 1 and c.
                let p = (position + Vec3::splat(0.5)).max(Vec3::ZERO).min(self.limit);
                let cell = [p.x as u32, p.y as u32, p.z as u32];
                let (brick, corner) = layout.locate(cell);
                let corners = self.grid.storage.cell(brick, corner);
                let [fx, fy, fz] = [p.x - cell[0] as f32, p.y - cell[1] as f32, p.z - cell[2] as f32];
                trilinear(&corners, fx, fy, fz)
            }
        }
    }
    #[inline(always)]
    fn densities<L: Lanes>(&mut self, ray: &FieldRay, t: L, _: usize) -> L {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        self.densities_of(Vec3Lanes::splat(origin) + Vec3Lanes::splat(direction) * t)
    }
    #[inline(always)]
    fn densities_of<L: Lanes>(&mut self, points: Vec3Lanes<L>) -> L {
        let layout = &self.grid.layout;
        let points = [points.x, points.y, points.z];
        let limit = self.limit.to_array();
        let trilinear = self.filter == Filter::Trilinear;
        let (shift, last) = if trilinear { (0.5, 0.0) } else { (0.0, 1.0) };
        let zero = L::splat(0.0);
        let mut p = [zero; 3];
        let mut cell = [L::Words::splat(0); 3];
        for axis in 0..3 {
            let mut x = points[axis];
            if trilinear {
                x = x + L::splat(shift);
            }
            p[axis] = x.max(zero).min(L::splat(limit[axis] - last));
            cell[axis] = p[axis].to_integers();
        }
        let (brick, corner) = layout.locate_lanes::<L>(cell);
        if !trilinear {
            let last = L::Words::splat(brick::LAST_CORNER as u32);
            return self.grid.storage.corners(brick, corner + last);
        }
        let mut fraction = [zero; 3];
        for axis in 0..3 {
            fraction[axis] = p[axis] - L::from_integers(cell[axis]);
        }
        let c = self.grid.storage.cells::<L>(brick, corner);
        let [fx, fy, fz] = fraction;
        let near = lerp_lanes(lerp_lanes(c[0], c[1], fx), lerp_lanes(c[2], c[3], fx), fy);
        let far = lerp_lanes(lerp_lanes(c[4], c[5], fx), lerp_lanes(c[6], c[7], fx), fy);
        lerp_lanes(near, far, fz).max(zero)
    }
}

/// `a` at 0, `b` at 1; equals both where they are equal.
#[inline(always)]
fn lerp(a: f32, b: f32, f: f32) -> f32 {
    a + f * (b - a)
}

/// The same of eight.
#[inline(always)]
fn lerp_lanes<L: Lanes>(a: L, b: L, f: L) -> L {
    a + f * (b - a)
}

/// Corners x fastest; fractions in [0, 1].
#[inline(always)]
fn trilinear(c: &[f32; 8], fx: f32, fy: f32, fz: f32) -> f32 {
    let near = lerp(lerp(c[0], c[1], fx), lerp(c[2], c[3], fx), fy);
    let far = lerp(lerp(c[4], c[5], fx), lerp(c[6], c[7], fx), fy);
    // Rounding may fall below zero between positive voxels.
    lerp(near, far, fz).max(0.0)
}
