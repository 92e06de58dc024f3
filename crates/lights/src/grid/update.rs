//! Changing a few lights of a hierarchy.

use super::hierarchy::LightingGrid;
use super::level::{Level, moments_of_finer, moments_of_lights};
use super::scratch::{UpdateScratch, sort_unique, vertex};
use super::{GridError, PointLight};
use lightshed_spatial::{KEY_BITS, KeyedIndex, ensure_capacity, morton30_decode};

/// A change of a light: moved, brighter, off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridChange {
    /// Index of the light.
    pub index: u32,
    /// What it becomes.
    pub light: PointLight,
}

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UpdateReport {
    /// Lights that moved into another cell of the finest grid.
    pub moved: usize,
    /// Vertices, of all levels, whose sums were recomputed.
    pub refreshed: usize,
    /// Whether a light left the grid's box, so that everything was rebuilt around another box.
    pub rebuilt: bool,
}

/// If more than one in this many lights change, all sums are recomputed.
const MANY: usize = 64;

impl LightingGrid {
    /// Changes some lights. The result has the bits of [`LightingGrid::rebuild`] with all lights,
    /// over the same box and with the same number of levels. The work is that of the vertices
    /// around the changed lights and, if some moved to other cells, a copy of the rest. Of several
    /// changes of one light the last counts.
    ///
    /// # Errors
    ///
    /// A light that does not exist, or that construction would refuse; nothing has changed then.
    pub fn update(&mut self, changes: &[GridChange]) -> Result<UpdateReport, GridError> {
        for change in changes {
            if change.index as usize >= self.lights.len() {
                return Err(GridError::NoSuchLight(change.index));
            }
            change.light.check(change.index as usize)?;
        }
        if changes
            .iter()
            .any(|change| !self.bounds.contains(change.light.position))
        {
            for change in changes {
                self.lights[change.index as usize] = change.light;
            }
            self.rebuild_own()?;
            return Ok(UpdateReport {
                moved: 0,
                refreshed: self.vertex_count(),
                rebuilt: true,
            });
        }
        let mut scratch = std::mem::take(&mut self.update);
        let moved = self.apply(changes, &mut scratch);
        if scratch.indices.len() > self.lights.len() / MANY {
            // So many changes that it is cheaper to recompute all sums.
            self.update = scratch;
            self.sort_lights();
            self.cells.collect(&self.pairs, self.level_count - 1);
            self.levels[0].collect_from_cells(&self.cells);
            self.build_levels();
            return Ok(UpdateReport {
                moved,
                refreshed: self.vertex_count(),
                rebuilt: false,
            });
        }
        if moved == 0 {
            self.resort_cells(&scratch);
        } else {
            self.merge_lights(&mut scratch);
        }
        let refreshed = self.refresh(&mut scratch, moved > 0);
        self.update = scratch;
        Ok(UpdateReport {
            moved,
            refreshed,
            rebuilt: false,
        })
    }

    fn vertex_count(&self) -> usize {
        let levels = &self.levels[..self.level_count as usize];
        levels.iter().map(|level| level.rows.len()).sum()
    }

    /// Applies the changes; lists changed lights and the cells that they are or were in. Returns
    /// how many changed cells.
    fn apply(&mut self, changes: &[GridChange], scratch: &mut UpdateScratch) -> usize {
        let (frame, shift) = (self.key_frame(), self.cell_shift());
        let UpdateScratch { indices, cells, .. } = scratch;
        indices.clear();
        ensure_capacity(indices, changes.len());
        indices.extend(changes.iter().map(|change| change.index));
        sort_unique(indices);
        cells.clear();
        ensure_capacity(cells, 2 * indices.len());
        let cell_of = |light: &PointLight| frame.key(light.position) >> shift;
        cells.extend(indices.iter().map(|&index| cell_of(&self.lights[index as usize])));
        for change in changes {
            self.lights[change.index as usize] = change.light;
        }
        let mut moved = 0;
        for (place, &index) in indices.iter().enumerate() {
            let cell = cell_of(&self.lights[index as usize]);
            if cell != cells[place] {
                moved += 1;
                cells.push(cell);
            }
        }
        sort_unique(cells);
        moved
    }

    /// Bits of a light's key below those of its cell.
    fn cell_shift(&self) -> u32 {
        3 * (KEY_BITS - (self.level_count - 1))
    }

    /// Sorts the lights of the changed cells again; none has entered or left.
    fn resort_cells(&mut self, scratch: &UpdateScratch) {
        let frame = self.key_frame();
        for &cell in &scratch.cells {
            let Some(cell) = self.cells.grid().find(morton30_decode(cell)) else {
                continue;
            };
            let range = self.cells.items(cell);
            let pairs = &mut self.pairs[range.clone()];
            for pair in pairs.iter_mut() {
                let index = pair.index();
                *pair = KeyedIndex::new(frame.key(self.lights[index as usize].position), index);
            }
            pairs.sort_unstable();
            for (light, pair) in self.sorted[range].iter_mut().zip(pairs.iter()) {
                *light = self.lights[pair.index() as usize];
            }
        }
    }

    /// Removes the changed lights from the order and inserts them at their new positions.
    fn merge_lights(&mut self, scratch: &mut UpdateScratch) {
        let frame = self.key_frame();
        let UpdateScratch {
            indices,
            pairs: incoming,
            changed,
            sorted: merged_lights,
            ..
        } = scratch;
        changed.clear();
        changed.resize(self.lights.len().div_ceil(64), 0);
        incoming.clear();
        ensure_capacity(incoming, indices.len());
        for &index in indices.iter() {
            changed[index as usize / 64] |= 1 << (index % 64);
            incoming.push(KeyedIndex::new(
                frame.key(self.lights[index as usize].position),
                index,
            ));
        }
        incoming.sort_unstable();
        let merged = &mut self.scratch;
        merged.clear();
        merged_lights.clear();
        let mut incoming = incoming.iter().peekable();
        for (&pair, light) in self.pairs.iter().zip(&self.sorted) {
            let index = pair.index() as usize;
            if changed[index / 64] >> (index % 64) & 1 == 1 {
                continue;
            }
            while let Some(&new) = incoming.next_if(|&&new| new < pair) {
                merged.push(new);
                merged_lights.push(self.lights[new.index() as usize]);
            }
            merged.push(pair);
            merged_lights.push(*light);
        }
        for &new in incoming {
            merged.push(new);
            merged_lights.push(self.lights[new.index() as usize]);
        }
        std::mem::swap(&mut self.pairs, merged);
        std::mem::swap(&mut self.sorted, merged_lights);
        let bits = self.level_count - 1;
        self.cells.collect(&self.pairs, bits);
    }

    /// Recomputes sums around changed lights, level by level. With `structure`, vertices may have
    /// been added or removed, and unchanged ones are copied. Returns how many were summed.
    fn refresh(&mut self, scratch: &mut UpdateScratch, structure: bool) -> usize {
        let mut refreshed = 0;
        while scratch.levels.len() < self.level_count as usize {
            scratch.levels.push(Level::default());
        }
        for level in 1..=self.level_count {
            let frame = self.frame(level);
            let (finer, rest) = self.levels.split_at_mut(level as usize - 1);
            let (finer, current) = (finer.last(), &mut rest[0]);
            let side = current.rows.side();
            match finer {
                None => scratch.list_corners(side),
                Some(finer) => scratch.list_coarser(finer.rows.side()),
            }
            if structure {
                let spare = &mut scratch.levels[level as usize - 1];
                match finer {
                    None => spare.collect_from_cells(&self.cells),
                    Some(finer) => spare.collect_from_finer(&finer.rows),
                }
                spare.reserve();
                spare.copy_common(current);
                std::mem::swap(current, spare);
            }
            for &dirty in &scratch.dirty {
                let vertex = vertex(dirty, side);
                let Some(place) = current.rows.find(vertex) else {
                    continue;
                };
                let moments = match finer {
                    None => moments_of_lights(vertex, &self.cells, &self.sorted, &frame),
                    Some(finer) => moments_of_finer(vertex, finer),
                };
                current.set(place, vertex, moments, &frame);
                refreshed += 1;
            }
        }
        refreshed
    }
}
