//! Symbols of Edgebreaker.

/// How a triangle is attached to the active edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Symbol {
    /// It closes the fan around a vertex.
    Close,
    /// It joins two active edges.
    Split,
    /// It has a new vertex, and the edge to the left is the next active one.
    Left,
    /// It has a new vertex, and the edge to the right is the next active one.
    Right,
    /// It begins a new part.
    End,
}
