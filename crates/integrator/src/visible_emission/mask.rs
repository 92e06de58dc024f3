//! The cells of a pixel.

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

    /// The share of the pixel's area.
    #[inline]
    pub fn share(self) -> f32 {
        self.0.count_ones() as f32 / CELLS as f32
    }

    /// The cells one by one.
    pub fn cells(self) -> CellList {
        let mut list = CellList {
            cells: [0; CELLS],
            count: 0,
        };
        let mut left = self.0;
        while left != 0 {
            list.cells[list.count] = left.trailing_zeros() as u8;
            list.count += 1;
            left &= left - 1;
        }
        list
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

/// Cells in their order.
pub struct CellList {
    cells: [u8; CELLS],
    count: usize,
}

impl CellList {
    /// A place in the pixel, uniform over the cells for uniform `u`; the pixel's corner without any.
    #[inline]
    pub fn place(&self, u: [f32; 2]) -> Vec2 {
        let along = u[0] * self.count as f32;
        let index = (along as usize).min(self.count.saturating_sub(1));
        let cell = self.cells[index];
        let axis = |from: u8| {
            let bit = |i: u8| (cell >> (2 * i + from) & 1) << i;
            f32::from(bit(0) | bit(1) | bit(2))
        };
        Vec2::new(axis(0) + (along - index as f32), axis(1) + u[1]) / SIDE as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 64 × 64 stratified places over the cells of a mask, each cell has its share, and no other
    /// cell any.
    #[test]
    fn places_are_uniform_over_the_cells() {
        for (row, first, last) in [(0, 0, 7), (5, 2, 5), (7, 6, 6)] {
            let mut mask = CellMask::of_row(row, first, last);
            mask.add(CellMask::of_row(3, 1, 1));
            let (list, mut found) = (mask.cells(), [0; CELLS]);
            for index in 0..64 * 64 {
                let u = [index % 64, index / 64].map(|i| (i as f32 + 0.5) / 64.0);
                let place = list.place(u);
                assert!(mask.contains(place), "{place} of {mask:?}");
                let [column, row] = place.to_array().map(|x| (x * SIDE as f32) as usize);
                found[row * SIDE + column] += 1;
            }
            let expected = 64.0 * 64.0 / (64.0 * mask.share());
            let all = found.iter().filter(|&&count| count > 0);
            assert_eq!(all.clone().count() as f32, 64.0 * mask.share());
            all.for_each(|&count| assert!((count as f32 - expected).abs() <= 64.0));
        }
        assert_eq!(CellMask::FULL.share(), 1.0);
    }
}
