//! The cells of the finest level and the lights in them.

use super::level::ensure;
use super::rows::Rows;
use super::sort::key_of;
use glam::{DVec3, Vec3};
use lightshed_sampling::{morton30_decode, morton30_encode};
use std::ops::Range;

/// Bits an axis of the keys that lights are sorted by.
pub(super) const KEY_BITS: u32 = 10;

/// Where a grid of cubic cells lies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Frame {
    pub origin: DVec3,
    /// Side of a cell.
    pub cell: f64,
    per_length: f64,
}

impl Frame {
    pub fn new(origin: DVec3, cell: f64) -> Self {
        Self {
            origin,
            cell,
            per_length: 1.0 / cell,
        }
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
}

/// The key of a light: the Morton code of its cell in a grid of `2^10` cells an axis, of which `finest` is the frame. Codes of
/// coarser cells are its leading bits, since halving coordinates is exact.
#[inline(always)]
pub(super) fn key(position: Vec3, finest: &Frame) -> u32 {
    let last = f64::from((1u32 << KEY_BITS) - 1);
    let cell = finest.in_cells(position).clamp(DVec3::ZERO, DVec3::splat(last));
    morton30_encode([cell.x as u32, cell.y as u32, cell.z as u32])
}

/// The occupied cells of a grid.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells {
    pub rows: Rows,
    /// First of each cell's lights and the one past the last.
    ranges: Vec<[u32; 2]>,
    /// Row, column and lights of the cells in the order of their codes.
    unordered: Vec<(u32, u32, [u32; 2])>,
    places: Vec<u32>,
}

impl Cells {
    /// Collects the cells of `2^bits` an axis from the sorted pairs of key and index.
    pub fn collect(&mut self, pairs: &[u64], bits: u32) {
        let shift = 3 * (KEY_BITS - bits);
        let side = 1u32 << bits;
        self.unordered.clear();
        let mut start = 0;
        for group in pairs.chunk_by(|&a, &b| key_of(a) >> shift == key_of(b) >> shift) {
            let [x, y, z] = morton30_decode(key_of(group[0]) >> shift);
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
        let mut x = self.rows.begin(side, &self.places, self.unordered.len());
        for &(row, column, range) in &self.unordered {
            let place = &mut self.places[row as usize];
            x.put(*place as usize, column);
            self.ranges[*place as usize] = range;
            *place += 1;
        }
    }

    /// Places of the lights of cell number `cell`.
    #[inline(always)]
    pub fn lights(&self, cell: usize) -> Range<usize> {
        let [start, end] = self.ranges[cell];
        start as usize..end as usize
    }

    /// Makes room for a few more cells than there are now.
    pub fn reserve(&mut self) {
        let count = self.rows.reserve();
        ensure(&mut self.ranges, count);
        ensure(&mut self.unordered, count);
    }
}

/// Bits an axis of the finest grid that has fewer than `limit` occupied cells.
pub(super) fn finest_bits_below(pairs: &[u64], limit: usize) -> u32 {
    // How many neighbours in the order part at each number of bits.
    let mut parted = [0usize; KEY_BITS as usize + 1];
    for pair in pairs.windows(2) {
        let differing = key_of(pair[0]) ^ key_of(pair[1]);
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
