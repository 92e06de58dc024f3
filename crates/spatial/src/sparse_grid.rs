//! Sparse grids: the occupied places of a cube, row by row.

use crate::ensure_capacity;
use glam::DVec3;
use std::ops::Range;

/// The occupied places `(x, y, z)` of a cube of `side`³, numbered in the order of z, then y, then
/// x. `side` is at most 1,025: the vertices of 1,024 cells.
///
/// A look-up is two binary searches in one row. A run along x is a range of numbers, so data stored
/// by number is read in order.
#[derive(Clone, Debug, Default)]
pub struct SparseGrid {
    side: u32,
    /// `side² + 1` places in `x`.
    starts: Vec<u32>,
    x: Vec<u16>,
}

/// Words of a row's bitmap: 1,025 places at most.
const WORDS: usize = 17;

/// A row along x as it is being collected.
pub struct SparseRow([u64; WORDS]);

impl SparseRow {
    /// Marks place `x` as occupied.
    #[inline(always)]
    pub fn set(&mut self, x: u32) {
        self.0[x as usize / 64 % WORDS] |= 1 << (x % 64);
    }
}

/// Places that are inserted in any order.
pub(crate) struct Placing<'a>(&'a mut [u16]);

impl Placing<'_> {
    /// Inserts the `x` of place number `number`.
    #[inline(always)]
    pub fn put(&mut self, place: usize, x: u32) {
        self.0[place] = x as u16;
    }
}

impl SparseGrid {
    /// Collects a cube of `side`³ again, reusing memory; `mark(y, z, row)` sets the occupied
    /// places of each row.
    pub fn collect(&mut self, side: u32, mut mark: impl FnMut(u32, u32, &mut SparseRow)) {
        self.side = side;
        self.starts.clear();
        self.x.clear();
        for z in 0..side {
            for y in 0..side {
                self.starts.push(self.x.len() as u32);
                let mut row = SparseRow([0; WORDS]);
                mark(y, z, &mut row);
                for (word, &bits) in row.0.iter().enumerate() {
                    let mut bits = bits;
                    while bits != 0 {
                        self.x.push((word * 64) as u16 + bits.trailing_zeros() as u16);
                        bits &= bits - 1;
                    }
                }
            }
        }
        self.starts.push(self.x.len() as u32);
    }

    /// Starts a cube of `side`³ with rows given by `starts`, whose `count` places are inserted in
    /// any order.
    pub(crate) fn begin(&mut self, side: u32, starts: &[u32], count: usize) -> Placing<'_> {
        self.side = side;
        self.starts.clear();
        self.starts.extend_from_slice(starts);
        self.x.clear();
        self.x.resize(count, 0);
        Placing(&mut self.x)
    }

    /// `[y, z]` of the row that contains place number `number`.
    #[inline]
    pub fn row_of(&self, place: usize) -> [u32; 2] {
        let row = self
            .starts
            .partition_point(|&start| start as usize <= place)
            .saturating_sub(1) as u32;
        [row % self.side, row / self.side]
    }

    /// Reserves room so that later collections of about as many places allocate nothing. Returns
    /// the number of places: a sixteenth more than now.
    pub fn reserve(&mut self) -> usize {
        let count = self.x.len() + self.x.len() / 16 + 16;
        ensure_capacity(&mut self.x, count);
        count
    }

    /// Places along each axis.
    #[inline]
    pub fn side(&self) -> u32 {
        self.side
    }

    /// Number of occupied places.
    #[inline]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether no place is occupied.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// The x of every occupied place.
    #[inline]
    pub fn x(&self) -> &[u16] {
        &self.x
    }

    /// All occupied places, `[x, y, z]`.
    pub fn places(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let rows = (0..self.side).flat_map(|z| (0..self.side).map(move |y| (y, z)));
        rows.flat_map(move |(y, z)| self.row(y, z).map(move |place| [u32::from(self.x[place]), y, z]))
    }

    /// Numbers of the places of row `(y, z)`; none outside the cube.
    #[inline(always)]
    pub fn row(&self, y: u32, z: u32) -> Range<usize> {
        if y >= self.side || z >= self.side {
            return 0..0;
        }
        let row = (z * self.side + y) as usize;
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    /// Numbers of the places of row `(y, z)` whose x is in `first..=last`.
    #[inline(always)]
    pub fn range(&self, first: u32, last: u32, y: u32, z: u32) -> Range<usize> {
        let row = self.row(y, z);
        let xs = &self.x[row.clone()];
        let start = xs.partition_point(|&x| u32::from(x) < first);
        let length = xs[start..].partition_point(|&x| u32::from(x) <= last);
        row.start + start..row.start + start + length
    }

    /// The number of `(x, y, z)`, if it is occupied.
    #[inline(always)]
    pub fn find(&self, [x, y, z]: [u32; 3]) -> Option<usize> {
        let range = self.range(x, x, y, z);
        (!range.is_empty()).then_some(range.start)
    }

    /// The first number of the rows of `z`; if `z` is the side, the number of places.
    #[inline]
    pub fn slab_start(&self, z: u32) -> usize {
        self.starts[(z * self.side) as usize] as usize
    }
}

/// Calls `row(y, z, first, last)` for the rows of places in a cube of `side`³ that may contain
/// something within `radius` of `center`, if the data of a place may be off it by up to `slack`
/// along each axis. Lengths are in units of cells. [`SparseGrid::range`] returns the occupied
/// places of such a row.
#[inline(always)]
pub fn for_each_row_within(
    center: DVec3,
    radius: f64,
    slack: f64,
    side: u32,
    mut row: impl FnMut(u32, u32, u32, u32),
) {
    // Rounding of positions must not lose anything at the border.
    let slack = slack + 1e-3;
    let last = f64::from(side) - 1.0;
    // Inclusive; empty where first > last. The casts saturate.
    let span = |center: f64, reach: f64| {
        let (first, end) = (
            (center - reach).ceil().max(0.0),
            (center + reach).floor().min(last),
        );
        (first as u32, if end < first { None } else { Some(end as u32) })
    };
    let (first_z, Some(last_z)) = span(center.z, radius + slack) else {
        return;
    };
    for z in first_z..=last_z {
        let dz = ((center.z - f64::from(z)).abs() - slack).max(0.0);
        let left = radius * radius - dz * dz;
        if left < 0.0 {
            continue;
        }
        let (first_y, Some(last_y)) = span(center.y, left.sqrt() + slack) else {
            continue;
        };
        for y in first_y..=last_y {
            let dy = ((center.y - f64::from(y)).abs() - slack).max(0.0);
            let left = left - dy * dy;
            if left < 0.0 {
                continue;
            }
            let (first_x, Some(last_x)) = span(center.x, left.sqrt() + slack) else {
                continue;
            };
            row(y, z, first_x, last_x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_as_in_a_dense_cube() {
        let occupied = |x: u32, y: u32, z: u32| (x * 7 + y * 13 + z * 29).is_multiple_of(5) && y != 3;
        let side = 67;
        let mut rows = SparseGrid::default();
        rows.collect(side, |y, z, row| {
            (0..side).filter(|&x| occupied(x, y, z)).for_each(|x| row.set(x))
        });
        let mut place = 0;
        for z in 0..side {
            assert_eq!(rows.slab_start(z), place);
            for y in 0..side {
                for x in 0..side {
                    assert_eq!(rows.find([x, y, z]), occupied(x, y, z).then_some(place));
                    if occupied(x, y, z) {
                        assert_eq!(rows.row_of(place), [y, z]);
                    }
                    place += usize::from(occupied(x, y, z));
                }
                let expected = (5..=20).filter(|&x| occupied(x, y, z)).count();
                assert_eq!(rows.range(5, 20, y, z).len(), expected);
            }
        }
        assert_eq!((rows.len(), rows.slab_start(side)), (place, place));
        for (place, vertex) in rows.places().enumerate() {
            assert_eq!(rows.find(vertex), Some(place));
        }
        assert_eq!(rows.places().count(), place);
        assert!(rows.row(side, 0).is_empty() && rows.find([side, 0, 0]).is_none());
    }
}
