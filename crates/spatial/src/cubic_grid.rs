//! Grids of cubic cells.

use crate::{SpatialIndex, SurfaceSite, morton30_encode};
use glam::{DVec3, Vec3};

/// Bits an axis of [`CubicGrid::key`].
pub const KEY_BITS: u32 = 10;

/// An unbounded grid of cubic cells: cell `⌊(p − origin) / cell⌋` along each axis, in `f64`.
///
/// As a [`SpatialIndex`] it names cells by three `i32`. Positions that are not finite or are
/// farther out have no cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CubicGrid {
    origin: DVec3,
    cell: f64,
    per_length: f64,
}

impl CubicGrid {
    /// The grid with a vertex at `origin` and cells of side `cell`, which must be positive and
    /// finite: otherwise no position has a cell.
    #[inline(always)]
    pub fn new(origin: DVec3, cell: f64) -> Self {
        Self {
            origin,
            cell,
            // Of NaN nothing has a cell.
            per_length: if cell > 0.0 { 1.0 / cell } else { f64::NAN },
        }
    }

    /// Side of a cell.
    #[inline(always)]
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// `position` in units of cells from the origin.
    #[inline(always)]
    pub fn in_cells(&self, position: Vec3) -> DVec3 {
        (position.as_dvec3() - self.origin) * self.per_length
    }

    /// Position of a vertex.
    #[inline(always)]
    pub fn vertex(&self, vertex: [u32; 3]) -> DVec3 {
        self.origin + DVec3::from(vertex.map(f64::from)) * self.cell
    }

    /// The Morton code of the cell of `position` among the 2¹⁰ cells an axis from the origin on.
    /// Positions outside count to the nearest of these cells. With cells twice as large the code
    /// has three bits less: halving coordinates is exact, so the cells of all coarser grids are the
    /// leading bits of one key.
    #[inline(always)]
    pub fn key(&self, position: Vec3) -> u32 {
        let last = f64::from((1u32 << KEY_BITS) - 1);
        let cell = self.in_cells(position).clamp(DVec3::ZERO, DVec3::splat(last));
        morton30_encode([cell.x as u32, cell.y as u32, cell.z as u32])
    }
}

impl SpatialIndex for CubicGrid {
    type Cell = [i32; 3];

    #[inline]
    fn locate(&self, site: &SurfaceSite) -> Option<[i32; 3]> {
        let cell = self.in_cells(site.position).floor();
        // NaN fails the comparisons.
        let within = |c: f64| c >= f64::from(i32::MIN) && c <= f64::from(i32::MAX);
        let [x, y, z] = cell.to_array();
        (within(x) && within(y) && within(z)).then_some([x as i32, y as i32, z as i32])
    }
}
