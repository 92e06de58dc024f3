//! How cells keep reservoirs.

use crate::error::{CachingError, check_option};
use lightshed_spatial::LevelGridOptions;

/// Most reservoirs of a cell.
pub const MAX_CELL_RESERVOIRS: u32 = 64;

/// How [`WorldReservoirs`](crate::WorldReservoirs) are kept.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WorldReservoirOptions {
    /// The cells.
    pub cells: LevelGridOptions,
    /// Most cells.
    pub slots: usize,
    /// Reservoirs of a cell, `K`; 1 to 64.
    pub reservoirs: u32,
    /// Most fresh reservoirs that a cell takes in a frame; at least 1. They are chosen at random
    /// among its visitors.
    pub contributors: u32,
    /// Frames after which a cell goes that nobody has visited.
    pub max_age: u32,
    /// A visited cell moves its site to one of its visitors once in so many frames, in the mean; at
    /// least 1.
    pub renewal: u32,
}

impl WorldReservoirOptions {
    /// 2¹⁶ cells of 8 reservoirs; 16 contributors; sites stay for 32 frames, cells for 64.
    pub fn new(cells: LevelGridOptions) -> Self {
        Self {
            cells,
            slots: 1 << 16,
            reservoirs: 8,
            contributors: 16,
            max_age: 64,
            renewal: 32,
        }
    }

    /// Whether reservoirs can be kept so, but for cells and slots.
    pub(super) fn check(&self) -> Result<(), CachingError> {
        let count = f64::from(self.reservoirs);
        let fits = (1..=MAX_CELL_RESERVOIRS).contains(&self.reservoirs);
        check_option(fits, "reservoirs", count, "from 1 to 64")?;
        let counts = [
            ("contributors", self.contributors),
            ("max_age", self.max_age),
            ("renewal", self.renewal),
        ];
        counts
            .into_iter()
            .try_for_each(|(name, value)| check_option(value > 0, name, f64::from(value), "positive"))
    }
}
