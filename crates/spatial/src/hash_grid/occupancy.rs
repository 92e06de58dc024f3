//! How full a table is.

/// How full a [`CellTable`](crate::CellTable) is, and how many cells it refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Occupancy {
    /// Slots there are.
    pub slots: usize,
    /// Slots in use.
    pub occupied: usize,
    /// Occupied slots, by how many lines of eight slots a look-up reads to find them: one, two,
    /// three, four.
    pub lines: [usize; 4],
    /// Cells that were opened by the last [`settle`](crate::CellTable::settle).
    pub opened: usize,
    /// Cells that were given up by the last [`evict`](crate::CellTable::evict).
    pub evicted: usize,
    /// Cells for which the last [`settle`](crate::CellTable::settle) found no slot. Exact if 0.
    /// Otherwise counted by bits of a hash (linear counting), which is off by some per cent up to a
    /// hundred thousand cells and reports at most about 700,000.
    pub refused: usize,
}

impl Occupancy {
    /// Share of the slots in use.
    pub fn load(&self) -> f64 {
        self.occupied as f64 / self.slots.max(1) as f64
    }
}
