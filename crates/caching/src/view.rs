//! A read-only view of a cache.

use super::grid::CacheGrid;
use super::published::CachedRadiance;
use lightshed_spatial::{LevelGrid, SurfaceSite};

/// The answers of a cache while its records may be changing: those of the last complete pass.
#[derive(Clone, Copy)]
pub struct CacheView<'a> {
    pub(crate) grid: &'a CacheGrid,
    pub(crate) published: &'a [CachedRadiance],
}

impl<'a> CacheView<'a> {
    /// The record of a site, of the smallest cell that answers; `None` if it has none, or one with
    /// too little information: paths continue there.
    #[inline]
    pub fn query(&self, site: &SurfaceSite) -> Option<&'a CachedRadiance> {
        self.grid.answer(site, |slot| {
            let record = self.published.get(slot as usize)?;
            (record.passes > 0.0).then_some(record)
        })
    }

    /// The record of a site that is moved at random by up to half a cell, given by `u` in
    /// `[0, 1)²`: in the mean over `u` this interpolates between cells (§7.4). If the moved site
    /// has no record, that of the site itself.
    #[inline]
    pub fn query_jittered(&self, site: &SurfaceSite, u: [f32; 2]) -> Option<&'a CachedRadiance> {
        self.query(&self.grid.jittered(site, u))
            .or_else(|| self.query(site))
    }

    /// Which cell a site is in.
    pub fn cells(&self) -> &'a LevelGrid {
        &self.grid.cells
    }

    /// The words of the table's slots ([`CellTable::words`](lightshed_spatial::CellTable::words)).
    /// With these, the [cells](Self::cells) and the [records](Self::records) a device answers as
    /// this view does.
    pub fn words(&self) -> impl Iterator<Item = u64> + 'a {
        self.grid.table.words()
    }

    /// What is published in each slot of the table.
    pub fn records(&self) -> &'a [CachedRadiance] {
        self.published
    }
}
