//! Cells of a cache, some of which are split.

use super::error::CachingError;
use super::options::RadianceCacheOptions;
use lightshed_spatial::{CellKey, CellTable, LevelGrid, SpatialIndex, SurfaceSite};

/// Cells with their slots. A cell may be split: sites in it then belong to one of the eight cells
/// of half its side, which may be split again.
pub(crate) struct CacheGrid {
    pub cells: LevelGrid,
    pub table: CellTable,
    /// Whether the cell of each slot is split; nothing without refinement.
    split: Vec<bool>,
    /// How often cells may be split.
    finer: u32,
}

/// Where a site belongs.
#[derive(Clone, Copy)]
pub(crate) struct Leaf {
    /// Its cell, which is not split.
    pub key: CellKey,
    /// The level of that cell.
    pub level: u32,
    /// Its slot, if it has one.
    pub slot: Option<u32>,
    /// How often the cell may still be split.
    pub left: u32,
}

impl CacheGrid {
    /// Without any cell.
    ///
    /// # Errors
    /// Options out of range.
    pub fn new(options: &RadianceCacheOptions) -> Result<Self, CachingError> {
        let cells = LevelGrid::new(options.cells)?;
        let table = CellTable::new(options.slots)?;
        Ok(match options.refinement {
            None => Self {
                cells,
                table,
                split: Vec::new(),
                finer: 0,
            },
            Some(refinement) => Self {
                cells: cells.with_finer_levels(refinement.levels),
                split: vec![false; table.slots()],
                table,
                finer: refinement.levels,
            },
        })
    }

    /// Whether the cell of a slot is split.
    #[inline]
    pub fn is_split(&self, slot: u32) -> bool {
        self.split.get(slot as usize) == Some(&true)
    }

    /// Splits the cell of a slot, or makes it whole.
    pub fn set_split(&mut self, slot: u32, is_split: bool) {
        if let Some(split) = self.split.get_mut(slot as usize) {
            *split = is_split;
        }
    }

    /// The cell of a site that is not split; tells `visit` the slots of those around it that are,
    /// the largest first.
    #[inline]
    pub fn leaf(&self, site: &SurfaceSite, mut visit: impl FnMut(u32)) -> Option<Leaf> {
        let (mut level, mut left) = (self.cells.level(site.eye_distance), self.finer);
        let mut key = self.cells.at_level(site, level)?;
        let mut slot = self.table.find(key);
        while let Some(whole) = slot.filter(|&slot| left > 0 && self.is_split(slot)) {
            visit(whole);
            (level, left) = (level - 1, left - 1);
            key = self.cells.at_level(site, level)?;
            slot = self.table.find(key);
        }
        Some(Leaf {
            key,
            level,
            slot,
            left,
        })
    }

    /// The slot of the cell that is not split.
    #[inline]
    pub fn locate(&self, site: &SurfaceSite) -> Option<u32> {
        if self.finer == 0 {
            return self.table.find(self.cells.locate(site)?);
        }
        self.leaf(site, |_| ())?.slot
    }

    /// Asks for a slot for the cell of a site; those around it stay in use.
    pub fn claim(&self, site: &SurfaceSite) {
        if let Some(leaf) = self.leaf(site, |slot| self.table.touch(slot)) {
            self.table.claim(leaf.key);
        }
    }

    /// The answer of the smallest cell around a site that has one.
    #[inline]
    pub fn answer<T>(&self, site: &SurfaceSite, mut answer: impl FnMut(u32) -> Option<T>) -> Option<T> {
        if self.finer == 0 {
            return answer(self.table.find(self.cells.locate(site)?)?);
        }
        let mut around = None;
        let leaf = self.leaf(site, |slot| around = answer(slot).or(around.take()))?;
        leaf.slot.and_then(answer).or(around)
    }

    /// A site that is moved at random by up to half of its cell.
    #[inline]
    pub fn jittered(&self, site: &SurfaceSite, u: [f32; 2]) -> SurfaceSite {
        if self.finer == 0 {
            return self.cells.jittered(site, u);
        }
        match self.leaf(site, |_| ()) {
            Some(leaf) => self.cells.jittered_at(site, leaf.level, u),
            None => *site,
        }
    }
}
