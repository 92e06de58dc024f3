//! What an update did.

use lightshed_spatial::Occupancy;

/// What [`WorldReservoirs::update`](crate::WorldReservoirs::update) did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct WorldReport {
    /// Cells that were visited.
    pub visited: usize,
    /// Cells whose site is another than before, new ones among them.
    pub moved: usize,
    /// Fresh reservoirs that were merged.
    pub contributors: usize,
    /// Reservoirs with a sample, in the cells that were visited.
    pub held: usize,
    /// Different samples among them, cell by cell.
    pub distinct: usize,
    /// How full the table is; [`Occupancy::refused`] cells have no reservoirs because it is full.
    pub occupancy: Occupancy,
}
