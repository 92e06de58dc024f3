//! Points near a point.

use crate::{
    Bounds, CellRanges, CubicGrid, KEY_BITS, KeyedIndex, SpatialIndex, SurfaceSite, for_each_row_within,
    morton30_decode, sort_by_key,
};
use glam::{DVec3, Vec3};
use lightshed_sampling::parallel::fill;
use std::fmt;
use std::ops::Range;

/// Points sorted into the cubic cells of a grid around them. Finds the points within a radius, and
/// numbers the occupied cells, so that storing data by cell needs no hash map.
///
/// The same points give the same grid for any number of threads. Memory and time to build are
/// `O(n)`. A search reads the cells that the ball touches, so cells about as large as the radius
/// are best. As a [`SpatialIndex`] it returns the number of the occupied cell that contains a
/// position. No method of this project stores points. The grid is for records that are looked up by
/// position, where a lighting grid does more than is needed.
///
/// ```
/// use lightshed_spatial::PointGrid;
/// use lightshed_spatial::glam::Vec3;
///
/// let points: Vec<Vec3> = (0..100).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect();
/// let grid = PointGrid::new(&points, 2.0)?;
/// let mut near = Vec::new();
/// grid.for_each_within(Vec3::new(41.6, 1.0, 0.0), 2.0, |index, _| near.push(index));
/// assert_eq!(near, [40, 41, 42, 43]);
/// # Ok::<(), lightshed_spatial::PointGridError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct PointGrid {
    /// The occupied cells' grid, `2^bits` cells an axis.
    grid: CubicGrid,
    bits: u32,
    cells: CellRanges,
    /// Points and their indices, cell by cell.
    points: Vec<Vec3>,
    pairs: Vec<KeyedIndex>,
    scratch: Vec<KeyedIndex>,
}

/// Why points are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PointGridError {
    /// This point is NaN or infinite.
    Position(usize),
    /// The side of a cell is not positive and finite.
    Cell(f32),
    /// More than `u32::MAX` points.
    TooMany(usize),
}

impl fmt::Display for PointGridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Position(point) => write!(f, "point {point} is not finite"),
            Self::Cell(cell) => write!(f, "cells of side {cell}: it must be positive and finite"),
            Self::TooMany(count) => write!(f, "{count} points are more than 2^32 - 1"),
        }
    }
}

impl std::error::Error for PointGridError {}

impl PointGrid {
    /// Sorts `points` into cells of side `cell`, or twice, four times, … as large where there
    /// would be more than 1,024 along an axis or many more rows of cells than points.
    ///
    /// # Errors
    ///
    /// See [`PointGridError`].
    pub fn new(points: &[Vec3], cell: f32) -> Result<Self, PointGridError> {
        let mut grid = Self::default();
        grid.rebuild(points, cell)?;
        Ok(grid)
    }

    /// As [`PointGrid::new`], reusing this grid's memory.
    ///
    /// # Errors
    ///
    /// See [`PointGridError`]; the grid is then unchanged.
    pub fn rebuild(&mut self, points: &[Vec3], cell: f32) -> Result<(), PointGridError> {
        // NaN fails the comparison.
        if !(cell > 0.0 && cell.is_finite()) {
            return Err(PointGridError::Cell(cell));
        }
        if u32::try_from(points.len()).is_err() {
            return Err(PointGridError::TooMany(points.len()));
        }
        if let Some(index) = points.iter().position(|point| !point.is_finite()) {
            return Err(PointGridError::Position(index));
        }
        let bounds = Bounds::of_points(points.iter().copied());
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let extent = (max - min).max_element().max(0.0);
        let (mut bits, mut side) = (0, f64::from(cell));
        // Halving the number of rows doubles the side; both lose a bit.
        let most = (points.len() / 8 + 8).ilog2().div_ceil(2).min(KEY_BITS);
        while side * f64::from(1u32 << bits) < extent {
            if bits < most {
                bits += 1;
            } else {
                side *= 2.0;
            }
        }
        let origin = if points.is_empty() { DVec3::ZERO } else { min };
        self.grid = CubicGrid::new(origin, side);
        self.bits = bits;
        // The same grid with 2¹⁰ cells an axis, of which those of `grid` are the leading bits.
        let finest = CubicGrid::new(origin, side / f64::from(1u32 << (KEY_BITS - bits)));
        self.pairs.resize(points.len(), KeyedIndex::default());
        fill(&mut self.pairs, |i| {
            KeyedIndex::new(finest.key(points[i]), i as u32)
        });
        sort_by_key(&mut self.pairs, &mut self.scratch);
        self.cells.collect(&self.pairs, bits);
        self.points.clear();
        self.points
            .extend(self.pairs.iter().map(|pair| points[pair.index() as usize]));
        Ok(())
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Side of a cell.
    pub fn cell_side(&self) -> f64 {
        self.grid.cell()
    }

    /// How many cells hold a point. Cells are numbered from 0.
    pub fn cell_count(&self) -> usize {
        self.cells.grid().len()
    }

    /// Indices of the points in cell number `cell`; none beyond the last cell.
    pub fn points_of(&self, cell: u32) -> impl ExactSizeIterator<Item = u32> {
        let range = match cell as usize {
            cell if cell < self.cell_count() => self.cells.items(cell),
            _ => 0..0,
        };
        self.pairs[range].iter().map(|pair| pair.index())
    }

    /// Calls `visit(index, distance²)` for every point at most `radius` from `center`, in the
    /// order of cells. Distances are compared in `f64`. A centre or a radius that is NaN finds
    /// nothing.
    pub fn for_each_within(&self, center: Vec3, radius: f32, mut visit: impl FnMut(u32, f64)) {
        let radius = f64::from(radius);
        if self.points.is_empty() || radius.is_nan() || radius < 0.0 {
            return;
        }
        let middle = self.grid.in_cells(center);
        let in_cells = radius / self.grid.cell();
        let mut visit_range = |range: Range<usize>| {
            for place in range {
                let distance_squared = (self.points[place].as_dvec3() - center.as_dvec3()).length_squared();
                if distance_squared <= radius * radius {
                    visit(self.pairs[place].index(), distance_squared);
                }
            }
        };
        let places = self.cells.grid();
        // A cell extends half a side to each side of its middle.
        for_each_row_within(middle - 0.5, in_cells, 0.5, places.side(), |y, z, first, last| {
            // The cells of a row are not consecutive among the sorted points.
            for cell in places.range(first, last, y, z) {
                visit_range(self.cells.items(cell));
            }
        });
    }
}

impl SpatialIndex for PointGrid {
    type Cell = u32;

    /// The number of the occupied cell of the site's position; `None` in a cell without points.
    fn locate(&self, site: &SurfaceSite) -> Option<u32> {
        let at = self.grid.in_cells(site.position);
        let side = DVec3::splat(f64::from(1u32 << self.bits));
        // The last cell holds the far face. NaN fails the comparisons.
        if self.points.is_empty() || !(at.cmpge(DVec3::ZERO) & at.cmple(side)).all() {
            return None;
        }
        let finest = self.grid.key(site.position);
        let last = (1u32 << self.bits) - 1;
        let cell = morton30_decode(finest).map(|c| c.min(last));
        self.cells.grid().find(cell).map(|cell| cell as u32)
    }
}
