//! Reservoirs in cells of space.

use super::super::option::{MethodOption, MethodValues, any, one_of, within};
use crate::WorldReuse;

/// Where reservoirs are.
pub const RESERVOIRS: MethodOption = MethodOption::new(
    "reservoirs",
    "WHERE",
    "screen",
    |text| one_of(text, &["screen", "world", "both"]),
    "Where reservoirs are that pixels reuse from: screen (neighbours and the frame before), world (cells of space, which \
     stay when the camera moves) or both",
);

/// Size of cells.
pub const WORLD_CELLS: MethodOption = MethodOption::new(
    "world-cells",
    "PIXELS",
    "16",
    any::<f32>,
    "Side of the cells of --reservoirs world, in pixels of the middle of the image, rounded down to a power of two times \
     the finest",
);

/// How far cells are trusted.
pub const WORLD_CAP: MethodOption = MethodOption::new(
    "world-cap",
    "M",
    "320",
    any::<f32>,
    "Most confidence of what a cell holds, in candidates of a pixel and frame",
);

/// Pixels that bring something to a cell.
pub const WORLD_BRING: MethodOption = MethodOption::new(
    "world-bring",
    "N",
    "16",
    any::<u32>,
    "Most pixels of a frame whose candidates a cell takes",
);

/// Reservoirs that a pixel reads.
pub const WORLD_READS: MethodOption = MethodOption::new(
    "world-reads",
    "N",
    "2",
    |text| within(text, 1..=lightshed_caching::MAX_READS),
    "Reservoirs of cells that a pixel reads in a frame",
);

impl MethodValues {
    /// Reservoirs in cells of space, if there are any, and whether reuse among pixels goes on
    /// beside them.
    pub fn world_reuse(&self) -> Option<(WorldReuse, bool)> {
        let both = match self.get::<String>(&RESERVOIRS).as_deref() {
            Some("world") => false,
            Some("both") => true,
            _ => return None,
        };
        let mut reuse = WorldReuse::default();
        reuse.cell_pixels = self.get(&WORLD_CELLS).unwrap_or(reuse.cell_pixels);
        reuse.reads = self.get(&WORLD_READS).unwrap_or(reuse.reads);
        reuse.contributors = self.get(&WORLD_BRING).unwrap_or(reuse.contributors);
        reuse.confidence_cap = self.get(&WORLD_CAP).unwrap_or(reuse.confidence_cap);
        Some((reuse, both))
    }
}
