//! Which items are in which cell of a grid.

use crate::{KEY_BITS, KeyedIndex, SparseGrid, ensure_capacity, morton30_decode};
use std::ops::Range;

/// The occupied cells of a grid, and for each the range of its items among all items sorted by
/// [key](crate::CubicGrid::key).
#[derive(Clone, Debug, Default)]
pub struct CellRanges {
    grid: SparseGrid,
    /// First of each cell's items and the one past the last.
    ranges: Vec<[u32; 2]>,
    /// Row, column and items of the cells in the order of their codes.
    unordered: Vec<(u32, u32, [u32; 2])>,
    places: Vec<u32>,
}

impl CellRanges {
    /// The occupied ones among `2^bits` cells an axis.
    #[inline(always)]
    pub fn grid(&self) -> &SparseGrid {
        &self.grid
    }

    /// Collects the cells of `2^bits` an axis, `bits` at most [`KEY_BITS`], from the sorted pairs
    /// of key and index.
    pub fn collect(&mut self, pairs: &[KeyedIndex], bits: u32) {
        let bits = bits.min(KEY_BITS);
        let shift = 3 * (KEY_BITS - bits);
        let side = 1u32 << bits;
        self.unordered.clear();
        let mut start = 0;
        for group in pairs.chunk_by(|a, b| a.key() >> shift == b.key() >> shift) {
            let [x, y, z] = morton30_decode(group[0].key() >> shift);
            let end = start + group.len() as u32;
            self.unordered.push((z * side + y, x, [start, end]));
            start = end;
        }
        // By row. Within a row the codes are in the order of x already.
        let rows = side as usize * side as usize;
        self.places.clear();
        self.places.resize(rows + 1, 0);
        for &(row, ..) in &self.unordered {
            self.places[row as usize + 1] += 1;
        }
        for row in 0..rows {
            self.places[row + 1] += self.places[row];
        }
        self.ranges.clear();
        self.ranges.resize(self.unordered.len(), [0; 2]);
        let mut x = self.grid.begin(side, &self.places, self.unordered.len());
        for &(row, column, range) in &self.unordered {
            let place = &mut self.places[row as usize];
            x.put(*place as usize, column);
            self.ranges[*place as usize] = range;
            *place += 1;
        }
    }

    /// Positions of the items of cell number `cell` among the sorted items.
    #[inline(always)]
    pub fn items(&self, cell: usize) -> Range<usize> {
        let [start, end] = self.ranges[cell];
        start as usize..end as usize
    }

    /// Reserves room for a few more cells than there are now, so that later collections of about as
    /// many allocate nothing.
    pub fn reserve(&mut self) {
        let count = self.grid.reserve();
        ensure_capacity(&mut self.ranges, count);
        ensure_capacity(&mut self.unordered, count);
    }
}

/// Bits an axis of the finest grid that has fewer than `limit` occupied cells; 0 if none has.
pub fn finest_bits_below(pairs: &[KeyedIndex], limit: usize) -> u32 {
    // For each number of bits, how many neighbours in the order are in different cells.
    let mut parted = [0usize; KEY_BITS as usize + 1];
    for pair in pairs.windows(2) {
        let differing = pair[0].key() ^ pair[1].key();
        if differing != 0 {
            parted[(KEY_BITS - differing.ilog2() / 3) as usize] += 1;
        }
    }
    let mut cells = 1;
    for bits in 0..=KEY_BITS {
        cells += parted[bits as usize];
        if cells >= limit {
            return bits.saturating_sub(1);
        }
    }
    KEY_BITS
}
