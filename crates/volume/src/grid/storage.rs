//! How bricks keep their values.

use std::fmt::Debug;

/// A form in which a [`BrickGrid`](super::BrickGrid) keeps its values. Implemented by this crate's forms only.
pub trait BrickStorage: Debug + Sync + sealed::Bricks {}

impl<S: Debug + Sync + sealed::Bricks> BrickStorage for S {}

pub(super) mod sealed {
    /// What lookups ask of bricks.
    pub trait Bricks {
        /// The value at a corner of a brick's cells.
        fn corner(&self, brick: usize, corner: usize) -> f32;
        /// The values at the eight corners of the cell whose first corner is given, x fastest.
        fn cell(&self, brick: usize, first: usize) -> [f32; 8];
        /// Asks for the memory of a cell.
        fn prefetch(&self, brick: usize, first: usize);
        /// Bytes of all bricks.
        fn bytes(&self) -> usize;
    }
}
