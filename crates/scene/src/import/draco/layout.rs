//! Where the values of an attribute lie.

use super::corners::Corners;
use super::order::Order;

/// The triangles that a group of attributes belongs to, and the order of its values.
pub(super) struct Layout<'a> {
    pub(super) corners: &'a Corners,
    pub(super) order: Order,
}

impl Layout<'_> {
    /// The value at a corner.
    pub(super) fn value(&self, corner: u32) -> usize {
        self.order.values[self.corners.vertex(corner) as usize] as usize
    }
}

/// Positions as integers, from which other attributes are predicted.
pub(super) struct Positions {
    /// By corner.
    value_of_corner: Vec<u32>,
    values: Vec<i32>,
}

impl Positions {
    /// The values of an attribute with this layout.
    pub(super) fn new(layout: &Layout, values: Vec<i32>) -> Self {
        let corners = 0..layout.corners.vertex.len() as u32;
        Self {
            value_of_corner: corners.map(|corner| layout.value(corner) as u32).collect(),
            values,
        }
    }

    pub(super) fn at(&self, corner: u32) -> [i64; 3] {
        let first = 3 * self.value_of_corner[corner as usize] as usize;
        std::array::from_fn(|i| i64::from(self.values[first + i]))
    }
}
