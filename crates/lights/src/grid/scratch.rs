//! Memory of an update, and the lists of the sums to recompute.

use super::level::Level;
use super::light::PointLight;
use lightshed_spatial::{KeyedIndex, ensure_capacity, morton30_decode};

/// Memory that updates keep.
#[derive(Clone, Debug, Default)]
pub(super) struct UpdateScratch {
    /// Indices of changed lights, in order.
    pub indices: Vec<u32>,
    /// Codes of the finest cells that a changed light is or was in.
    pub cells: Vec<u32>,
    /// Numbers of vertices whose sums change, in order; those of the next level.
    pub dirty: Vec<u32>,
    pub next: Vec<u32>,
    pub pairs: Vec<KeyedIndex>,
    pub changed: Vec<u64>,
    pub sorted: Vec<PointLight>,
    pub levels: Vec<Level>,
}

/// A vertex as one number, in the order of places.
#[inline(always)]
fn number([x, y, z]: [u32; 3], side: u32) -> u32 {
    (z * side + y) * side + x
}

pub(super) fn vertex(number: u32, side: u32) -> [u32; 3] {
    [number % side, number / side % side, number / side / side]
}

pub(super) fn sort_unique(numbers: &mut Vec<u32>) {
    numbers.sort_unstable();
    numbers.dedup();
}

impl UpdateScratch {
    /// Lists the corners of the changed cells, as numbers of vertices of level 1.
    pub fn list_corners(&mut self, side: u32) {
        self.dirty.clear();
        ensure_capacity(&mut self.dirty, 8 * self.cells.len());
        for &cell in &self.cells {
            let [x, y, z] = morton30_decode(cell);
            for corner in 0..8 {
                let at = [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)];
                self.dirty.push(number(at, side));
            }
        }
        sort_unique(&mut self.dirty);
    }

    /// From listed vertices of a level with `side` to those of the next coarser level that depend
    /// on them.
    pub fn list_coarser(&mut self, side: u32) {
        let coarser_side = side / 2 + 1;
        self.next.clear();
        // The two exchange places, so both get the room.
        let count = 8 * self.dirty.len();
        ensure_capacity(&mut self.next, count);
        ensure_capacity(&mut self.dirty, count);
        for &finer in &self.dirty {
            let [x, y, z] = vertex(finer, side);
            for z in z / 2..=z.div_ceil(2) {
                for y in y / 2..=y.div_ceil(2) {
                    for x in x / 2..=x.div_ceil(2) {
                        self.next.push(number([x, y, z], coarser_side));
                    }
                }
            }
        }
        sort_unique(&mut self.next);
        std::mem::swap(&mut self.dirty, &mut self.next);
    }
}
