//! A level grid with its table.

use super::error::HashGridError;
use super::level_grid::{LevelGrid, LevelGridOptions};
use super::table::CellTable;
use crate::{SpatialIndex, SurfaceSite};

/// A [`LevelGrid`] whose cells have slots in a [`CellTable`]: as a [`SpatialIndex`] it names the
/// slot of a site's cell, if it has one.
pub struct HashGrid {
    /// Which cell a site is in.
    pub cells: LevelGrid,
    /// Which slot a cell has.
    pub table: CellTable,
}

impl HashGrid {
    /// Without any cell.
    ///
    /// # Errors
    /// Options that [`LevelGrid::new`] or [`CellTable::new`] refuse.
    pub fn new(options: LevelGridOptions, slots: usize) -> Result<Self, HashGridError> {
        Ok(Self {
            cells: LevelGrid::new(options)?,
            table: CellTable::new(slots)?,
        })
    }

    /// [`CellTable::claim`] for the cell of a site. Returns false if the site has no cell.
    pub fn claim(&self, site: &SurfaceSite) -> bool {
        let key = self.cells.locate(site);
        if let Some(key) = key {
            self.table.claim(key);
        }
        key.is_some()
    }
}

impl SpatialIndex for HashGrid {
    type Cell = u32;

    #[inline]
    fn locate(&self, site: &SurfaceSite) -> Option<u32> {
        self.table.find(self.cells.locate(site)?)
    }
}
