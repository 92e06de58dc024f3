//! Cells of surface sites in a table of bounded size.

mod error;
mod grid;
mod key;
mod level_grid;
mod occupancy;
mod table;

pub use error::HashGridError;
pub use grid::HashGrid;
pub use key::CellKey;
pub use level_grid::{LevelGrid, LevelGridOptions};
pub use occupancy::Occupancy;
pub use table::CellTable;
