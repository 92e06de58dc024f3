//! Regions of a hash grid, in a table of bounded size.

use crate::GuidingError;
use crate::error::check_option;
use crate::partition::Partition;
use glam::Vec3;
use lightshed_spatial::{
    Bounds, CellKey, CellTable, HashGridError, LevelGrid, LevelGridOptions, Occupancy, SurfaceSite,
};

/// The size of cells, and how many there may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct HashCellsOptions {
    /// Largest cells along the longest side of the box, 1 to 1,024.
    pub cells: u32,
    /// Number of times that a cell's side may be halved, at most 8; 0 if all cells have one size.
    pub levels: u32,
    /// Most cells, at least 32 and at most 2²⁸; rounded down to a power of two. See
    /// [`HashCells::slots_within`].
    pub slots: usize,
}

impl Default for HashCellsOptions {
    fn default() -> Self {
        Self {
            cells: 4,
            levels: 8,
            slots: 1 << 15,
        }
    }
}

/// A [`Partition`] into cubic cells of a hash grid, which has a record only where samples are.
///
/// A cell opens when a sample comes that has none. In cells with too many samples of an update,
/// cells of half the side open where the samples are, with the record of the larger cell. That
/// stays, and is used where no smaller one has opened. So regions follow the samples like those of
/// an octree, and what they take is bounded from the start: a full table opens no more cells, and a
/// sample without a cell is outside. From seven eighths on, cells are given up that 64 passes of
/// updates have not used.
///
/// The content of the table does not depend on the order of samples, see
/// [`CellTable`](lightshed_spatial::CellTable). `collapse_below` and `max_regions` of
/// [`FieldOptions`](crate::FieldOptions) mean nothing here.
#[derive(Clone, Debug)]
pub struct HashCells {
    bounds: Bounds,
    options: HashCellsOptions,
    /// Where the grid begins. Walls along the box's sides are not the borders of cells.
    corner: Vec3,
    grid: LevelGrid,
    table: CellTable,
    /// Whether cells of half the side were opened in the cell of each slot.
    divided: Vec<bool>,
    /// The slot before of each slot.
    origins: Vec<u32>,
    /// The level of the cells that most samples were in.
    usual: u32,
}

/// No slot.
const NOWHERE: u32 = u32::MAX;
/// Where the box begins in the first cell, in sides of it: no border of smaller cells.
const MARGIN: Vec3 = Vec3::new(0.071, 0.113, 0.157);
/// Passes without a sample after which a cell may be given up.
const UNUSED: u32 = 64;
/// Slots that a table has at least.
const LEAST_SLOTS: usize = 32;

impl HashCells {
    /// Over this box, without any cell.
    ///
    /// # Errors
    /// [`GuidingError::Bounds`], [`GuidingError::Option`].
    pub fn new(bounds: Bounds, options: HashCellsOptions) -> Result<Self, GuidingError> {
        let HashCellsOptions { cells, levels, slots } = options;
        check_option((1..=1024).contains(&cells), "cells", cells.into(), "1 to 1024")?;
        check_option(levels <= 8, "levels", levels.into(), "at most 8")?;
        let is_size = (LEAST_SLOTS..=1 << 28).contains(&slots);
        check_option(is_size, "slots", slots as f64, "32 to 2^28")?;
        let table = CellTable::new(1 << slots.ilog2()).map_err(|_| GuidingError::Bounds)?;
        Self::with_table(bounds, options, table)
    }

    fn with_table(bounds: Bounds, options: HashCellsOptions, table: CellTable) -> Result<Self, GuidingError> {
        let side = (bounds.max - bounds.min).max_element() / options.cells as f32;
        let is_box = bounds.min.cmple(bounds.max).all() && bounds.min.is_finite() && bounds.max.is_finite();
        if !(is_box && side.is_normal()) {
            return Err(GuidingError::Bounds);
        }
        let grid = LevelGrid::new(LevelGridOptions {
            faces: false,
            ..LevelGridOptions::new(side)
        });
        let grid = grid.map_err(|_| GuidingError::Bounds)?;
        Ok(Self {
            bounds,
            options,
            corner: bounds.min - side * MARGIN,
            grid: grid.with_finer_levels(options.levels),
            divided: vec![false; table.slots()],
            origins: (0..table.slots() as u32).collect(),
            usual: options.levels,
            table,
        })
    }

    /// Most slots of a table whose cells, with `region_bytes` for each
    /// ([`GuidingField::region_bytes`](crate::GuidingField::region_bytes)), fit into so many bytes;
    /// at least 32.
    pub fn slots_within(bytes: usize, region_bytes: usize) -> usize {
        // The table has twelve for each slot.
        let own = 12 + size_of::<bool>() + size_of::<u32>();
        let slots = (bytes / (region_bytes + own)).clamp(LEAST_SLOTS, 1 << 28);
        1 << slots.ilog2()
    }

    /// How full the table is.
    pub fn occupancy(&self) -> Occupancy {
        self.table.occupancy()
    }

    /// The cell of a position at a level, counted from the finest.
    #[inline(always)]
    fn key(&self, position: Vec3, level: u32) -> Option<CellKey> {
        let site = SurfaceSite::new(position - self.corner, Vec3::ZERO);
        let key = self.grid.at_level(&site, level)?;
        (key.level() == level).then_some(key)
    }

    /// The slot of the smallest cell of a position, and its level. The search begins at `level`: as
    /// all larger cells of a cell are in the table, the result does not depend on it.
    #[inline(always)]
    fn descend(&self, position: Vec3, level: u32) -> Option<(u32, u32)> {
        let find = |level| self.table.find(self.key(position, level)?);
        let mut level = level;
        let mut slot = loop {
            match find(level) {
                Some(slot) => break slot,
                None if level < self.options.levels => level += 1,
                None => return None,
            }
        };
        while level > 0 && self.divided[slot as usize] {
            match find(level - 1) {
                Some(part) => (slot, level) = (part, level - 1),
                None => break,
            }
        }
        Some((slot, level))
    }

    fn side(&self, level: u32) -> f32 {
        self.grid.side(level) as f32
    }

    /// Slots know whether they are divided from the cells that there are.
    fn find_divided(&mut self) {
        self.divided.fill(false);
        for slot in 0..self.table.slots() as u32 {
            let key = self
                .table
                .key(slot)
                .filter(|key| key.level() < self.options.levels);
            if let Some(parent) = key.and_then(|key| self.table.find(key.parent())) {
                self.divided[parent as usize] = true;
            }
        }
    }
}

impl Partition for HashCells {
    fn over(bounds: Bounds) -> Result<Self, GuidingError> {
        Self::new(bounds, HashCellsOptions::default())
    }

    fn slot_count(&self) -> usize {
        self.table.slots()
    }

    #[inline]
    fn slot(&self, position: Vec3) -> Option<u32> {
        self.descend(position, self.usual).map(|(slot, _)| slot)
    }

    #[inline]
    fn slot_moved(&self, position: Vec3, offset: Vec3) -> Option<(u32, Option<u32>)> {
        let (slot, level) = self.descend(position, self.usual)?;
        let moved = self.descend(position + offset * self.side(level), level);
        Some((slot, moved.map(|(slot, _)| slot)))
    }

    /// Of a slot without a cell it is the whole box.
    fn bounds(&self, slot: u32) -> Bounds {
        let Some(key) = self.table.key(slot) else {
            return self.bounds;
        };
        let side = self.side(key.level());
        let min = self.corner + Vec3::from(key.coordinates().map(|c| c as f32)) * side;
        Bounds { min, max: min + side }
    }

    #[inline]
    fn extent(&self, slot: u32) -> Vec3 {
        let key = self.table.key(slot);
        Vec3::splat(self.side(key.map_or(0, CellKey::level)))
    }

    fn claim(&mut self, positions: impl Iterator<Item = Vec3>, counts: &[u32], split_above: u32) {
        for position in positions {
            let mut level = self.options.levels;
            while let Some(key) = self.key(position, level) {
                let Some(slot) = self.table.find(key) else {
                    self.table.claim(key);
                    break;
                };
                self.table.touch(slot);
                let is_crowded = counts
                    .get(slot as usize)
                    .is_some_and(|count| *count > split_above);
                if level == 0 || !(self.divided[slot as usize] || is_crowded) {
                    break;
                }
                level -= 1;
            }
        }
    }

    fn adapt(&mut self, counts: &[u32], _: u32, _: u32, _: usize) -> Result<bool, GuidingError> {
        let mut of_level = [0u64; 16];
        for (slot, count) in (0..).zip(counts).filter(|(_, count)| **count > 0) {
            let level = self.table.key(slot).map_or(self.options.levels, CellKey::level);
            of_level[level as usize % 16] += u64::from(*count);
        }
        let levels = 0..=self.options.levels;
        let usual = levels.max_by_key(|level| of_level[*level as usize]);
        self.usual = usual.unwrap_or(self.options.levels);
        for (slot, origin) in (0..).zip(&mut self.origins) {
            *origin = slot;
        }
        let mut opened = Vec::new();
        self.table.settle(|slot| opened.push(slot));
        for &slot in &opened {
            let key = self
                .table
                .key(slot)
                .filter(|key| key.level() < self.options.levels);
            let parent = key.and_then(|key| self.table.find(key.parent()));
            // The parent may have opened in the same pass only if it is no origin itself.
            let parent = parent.filter(|parent| opened.binary_search(parent).is_err());
            self.origins[slot as usize] = parent.unwrap_or(NOWHERE);
        }
        let mut closed = false;
        let occupancy = self.table.occupancy();
        if occupancy.occupied > occupancy.slots / 8 * 7 {
            let origins = &mut self.origins;
            self.table.evict(UNUSED, |slot| {
                origins[slot as usize] = NOWHERE;
                closed = true;
            });
        }
        if closed || !opened.is_empty() {
            self.find_divided();
        }
        Ok(closed || !opened.is_empty())
    }

    #[inline]
    fn origin(&self, slot: u32) -> Option<u32> {
        let origin = self.origins[slot as usize];
        (origin != NOWHERE && self.table.is_occupied(slot)).then_some(origin)
    }

    fn save(&self) -> Vec<u32> {
        let words = self.table.words();
        let halves = words.flat_map(|word| [word as u32, (word >> 32) as u32]);
        [self.options.cells, self.options.levels]
            .into_iter()
            .chain(halves)
            .collect()
    }

    fn load(&self, saved: &[u32]) -> Result<Self, GuidingError> {
        let damaged = |_: HashGridError| GuidingError::Damaged("the cells are not those of a table");
        let [cells, levels, ref words @ ..] = *saved else {
            return Err(GuidingError::Damaged("the cells are missing"));
        };
        let whole = |pair: &[u32]| u64::from(pair[0]) | u64::from(pair[1]) << 32;
        let words: Vec<u64> = words.chunks_exact(2).map(whole).collect();
        let table = CellTable::from_words(&words).map_err(damaged)?;
        if !(1..=1024).contains(&cells) || levels > 8 || !saved.len().is_multiple_of(2) {
            return Err(GuidingError::Damaged("the size of the cells makes no sense"));
        }
        let slots = table.slots();
        let options = HashCellsOptions { cells, levels, slots };
        let mut loaded = Self::with_table(self.bounds, options, table)?;
        loaded.find_divided();
        Ok(loaded)
    }
}
