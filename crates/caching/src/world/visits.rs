//! Who comes to which cell.

use std::ops::Range;

/// Who visits which cell in a frame, and who of them brings something.
///
/// Made by [`WorldReservoirs::visit`](crate::WorldReservoirs::visit) of places and random numbers
/// alone.
#[derive(Clone, Debug, Default)]
pub struct WorldVisits {
    /// Cell, rank and index of each visitor, in this order.
    visitors: Vec<(u32, u32, u32)>,
    /// Cells, each with where its visitors stand.
    cells: Vec<(u32, Range<usize>)>,
    /// Most of a cell's visitors that bring something.
    most: usize,
}

impl WorldVisits {
    /// Of visitors with their cell and rank.
    pub(super) fn new(mut visitors: Vec<(u32, u32, u32)>, most: usize) -> Self {
        visitors.sort_unstable();
        let mut cells: Vec<(u32, Range<usize>)> = Vec::new();
        for (place, &(slot, ..)) in visitors.iter().enumerate() {
            match cells.last_mut() {
                Some((last, range)) if *last == slot => range.end = place + 1,
                _ => cells.push((slot, place..place + 1)),
            }
        }
        Self {
            visitors,
            cells,
            most,
        }
    }

    /// Cells that are visited, by slot.
    pub(super) fn cells(&self) -> &[(u32, Range<usize>)] {
        &self.cells
    }

    /// Those of a cell's visitors that bring something, in random order.
    pub(super) fn bringing(&self, visitors: &Range<usize>) -> impl Iterator<Item = usize> + '_ {
        let visitors = &self.visitors[visitors.clone()];
        visitors.iter().take(self.most).map(|&(.., index)| index as usize)
    }

    /// Visitors whose fresh reservoirs [`update`](crate::WorldReservoirs::update) will merge.
    /// Others need none, if nobody else asks for them.
    pub fn contributors(&self) -> impl Iterator<Item = usize> + '_ {
        self.cells
            .iter()
            .flat_map(|(_, visitors)| self.bringing(visitors))
    }
}
