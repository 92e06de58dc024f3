//! The cells of a pixel.

#[cfg(test)]
use lightshed_scene::glam::Vec2;

/// Cells in a row or column of a pixel.
pub const SIDE: usize = 8;

/// Cells of a pixel.
pub const CELLS: usize = SIDE * SIDE;

/// A set of cells of a pixel, in the order of a Z-shaped curve, so that cells with near numbers are
/// near: bit `2 i` of a cell's number is bit `i` of its column, bit `2 i + 1` that of its row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellMask(u64);

/// Numbers of the cells of the first row.
const OF_COLUMN: [u32; SIDE] = [0, 1, 4, 5, 16, 17, 20, 21];

impl CellMask {
    pub const FULL: Self = Self(u64::MAX);

    /// The cells of a row from column `first` to `last`, which are below [`SIDE`].
    #[inline]
    pub fn of_row(row: usize, first: usize, last: usize) -> Self {
        let cells: u64 = OF_COLUMN[first..=last].iter().map(|cell| 1 << cell).sum();
        Self(cells << (2 * OF_COLUMN[row]))
    }

    #[inline]
    pub fn add(&mut self, other: Self) {
        self.0 |= other.0;
    }

    #[inline]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The number of cells.
    #[inline]
    pub fn count(self) -> u32 {
        self.0.count_ones()
    }

    /// The numbers of the cells in their order, and how many there are.
    pub fn cells(self) -> ([u8; CELLS], usize) {
        let (mut cells, mut count, mut left) = ([0; CELLS], 0, self.0);
        while left != 0 {
            cells[count] = left.trailing_zeros() as u8;
            count += 1;
            left &= left - 1;
        }
        (cells, count)
    }

    /// Whether a place in the pixel, `[0, 1)²`, lies in one of the cells.
    #[cfg(test)]
    pub fn contains(self, place: Vec2) -> bool {
        let [column, row] = place
            .to_array()
            .map(|x| ((x * SIDE as f32) as usize).min(SIDE - 1));
        self.0 & Self::of_row(row, column, column).0 != 0
    }
}

/// Column and row of the cell of this number.
#[inline]
pub fn place_of(cell: u8) -> [u8; 2] {
    [0, 1].map(|axis| {
        let bit = |i: u8| (cell >> (2 * i + axis) & 1) << i;
        bit(0) | bit(1) | bit(2)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows and numbers name the same cells.
    #[test]
    fn cells_have_their_places() {
        for row in 0..SIDE {
            for (first, last) in [(0, 7), (2, 5), (6, 6)] {
                let mask = CellMask::of_row(row, first, last);
                let (cells, count) = mask.cells();
                let mut columns: Vec<_> = cells[..count].iter().map(|&cell| place_of(cell)).collect();
                columns.sort_unstable();
                let expected: Vec<_> = (first..=last).map(|x| [x as u8, row as u8]).collect();
                assert_eq!(columns, expected);
                assert_eq!(mask.count() as usize, count);
            }
        }
        assert_eq!(CellMask::FULL.count() as usize, CELLS);
    }
}
