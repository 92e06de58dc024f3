//! How bricks keep their values.

use std::fmt::Debug;

/// A form in which a [`BrickGrid`](super::BrickGrid) keeps its values. Implemented by this crate's
/// forms only.
pub trait BrickStorage: Debug + Sync + sealed::Bricks {}

impl<S: Debug + Sync + sealed::Bricks> BrickStorage for S {}

pub(super) mod sealed {
    use lightshed_lanes::{LANES, LaneWords, Lanes};

    /// What lookups ask of bricks.
    pub trait Bricks {
        /// The value at a corner of a brick's cells.
        fn corner(&self, brick: usize, corner: usize) -> f32;
        /// The values at the eight corners of the cell whose first corner is given, x fastest.
        fn cell(&self, brick: usize, first: usize) -> [f32; 8];
        /// [`Bricks::corner`] of eight places.
        #[inline(always)]
        fn corners<L: Lanes>(&self, brick: L::Words, corner: L::Words) -> L {
            let (brick, corner) = (brick.store(), corner.store());
            let mut values = [0.0; LANES];
            for lane in 0..LANES {
                values[lane] = self.corner(brick[lane] as usize, corner[lane] as usize);
            }
            L::load(&values)
        }
        /// [`Bricks::cell`] of eight places, by corner.
        #[inline(always)]
        fn cells<L: Lanes>(&self, brick: L::Words, first: L::Words) -> [L; 8] {
            let (brick, first) = (brick.store(), first.store());
            let mut rows = [[0.0; 8]; LANES];
            for lane in 0..LANES {
                rows[lane] = self.cell(brick[lane] as usize, first[lane] as usize);
            }
            let [a, b, c, d, e, f, g, h] = &rows;
            L::load_transposed([a, b, c, d, e, f, g, h])
        }
        /// Bytes of all bricks.
        fn bytes(&self) -> usize;
    }
}
