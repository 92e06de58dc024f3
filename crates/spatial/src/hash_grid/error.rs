//! Errors of a hash grid.

use std::fmt;

/// Why a hash grid cannot be made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum HashGridError {
    /// The side of the finest cells is not positive and finite.
    Cell(f32),
    /// The growth of cells with distance is negative or not finite.
    Growth(f32),
    /// The number of slots is not in 1 to 2²⁸.
    Slots(usize),
    /// Words that no table has.
    Words,
}

impl fmt::Display for HashGridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cell(side) => write!(f, "cells of side {side}: it must be positive and finite"),
            Self::Growth(growth) => {
                write!(
                    f,
                    "cells that grow by {growth} of the distance: it must be finite and not negative"
                )
            }
            Self::Words => write!(f, "the words are not those of a table of cells"),
            Self::Slots(slots) => write!(f, "a table of {slots} slots: it must have 1 to 2^28"),
        }
    }
}

impl std::error::Error for HashGridError {}
