//! Triangles as corners: corner `c` belongs to triangle `c / 3`. The edge opposite to it joins it
//! to the corner across.

use super::{Fault, INVALID};

/// No corner.
pub(super) const NONE: u32 = u32::MAX;

/// The next corner of the triangle.
pub(super) fn next(corner: u32) -> u32 {
    if corner % 3 == 2 { corner - 2 } else { corner + 1 }
}

/// The corner before.
pub(super) fn previous(corner: u32) -> u32 {
    if corner.is_multiple_of(3) {
        corner + 2
    } else {
        corner - 1
    }
}

/// Corners with their vertices and with those across their opposite edges.
#[derive(Clone, Default)]
pub(super) struct Corners {
    /// By corner, [`NONE`] at boundaries.
    pub(super) opposite: Vec<u32>,
    /// By corner.
    pub(super) vertex: Vec<u32>,
    /// By vertex the corner from which turning left ends, [`NONE`] for vertices without triangles.
    pub(super) leftmost: Vec<u32>,
}

impl Corners {
    /// Of so many triangles, none of them joined.
    pub(super) fn of_triangles(count: usize) -> Self {
        Self {
            opposite: vec![NONE; 3 * count],
            vertex: vec![NONE; 3 * count],
            leftmost: Vec::new(),
        }
    }

    pub(super) fn triangle_count(&self) -> usize {
        self.opposite.len() / 3
    }

    /// A new vertex at this corner.
    pub(super) fn add_vertex(&mut self, corner: u32) -> u32 {
        let vertex = self.leftmost.len() as u32;
        self.vertex[corner as usize] = vertex;
        self.leftmost.push(corner);
        vertex
    }

    pub(super) fn vertex(&self, corner: u32) -> u32 {
        self.vertex[corner as usize]
    }

    /// Joins two edges, of which neither is joined: so turning about a vertex comes back to its
    /// start or ends at a boundary.
    pub(super) fn join(&mut self, a: u32, b: u32) -> Result<(), Fault> {
        let [a_index, b_index] = [a, b].map(|corner| corner as usize);
        if a == b || self.opposite.get(a_index) != Some(&NONE) || self.opposite.get(b_index) != Some(&NONE) {
            return Err(INVALID.into());
        }
        self.opposite[a_index] = b;
        self.opposite[b_index] = a;
        Ok(())
    }

    /// The corner across the edge opposite to this corner.
    pub(super) fn across(&self, corner: u32) -> Option<u32> {
        Some(self.opposite[corner as usize]).filter(|&corner| corner != NONE)
    }

    /// The corner of the same vertex in the triangle to the left.
    pub(super) fn left(&self, corner: u32) -> Option<u32> {
        self.across(next(corner)).map(next)
    }

    /// The corner of the same vertex in the triangle to the right.
    pub(super) fn right(&self, corner: u32) -> Option<u32> {
        self.across(previous(corner)).map(previous)
    }

    /// All corners of a corner's vertex: it, those to the left, and if a boundary ends these, those
    /// to the right.
    pub(super) fn around(&self, start: u32) -> impl Iterator<Item = u32> {
        let (mut corner, mut leftwards) = (Some(start), true);
        std::iter::from_fn(move || {
            let found = corner?;
            corner = if leftwards {
                self.left(found)
            } else {
                self.right(found)
            };
            if leftwards && corner.is_none() {
                leftwards = false;
                corner = self.right(start);
            } else if corner == Some(start) {
                corner = None;
            }
            Some(found)
        })
    }

    /// Whether a vertex lies at a boundary.
    pub(super) fn is_at_boundary(&self, vertex: u32) -> bool {
        let corner = self.leftmost[vertex as usize];
        corner == NONE || self.left(corner).is_none()
    }

    /// These triangles cut along the edges opposite to the marked corners, with new vertices where
    /// cuts divide old ones.
    pub(super) fn cut(&self, is_cut: &[bool]) -> Self {
        let mut cut = Self {
            opposite: self.opposite.clone(),
            vertex: vec![NONE; self.vertex.len()],
            leftmost: Vec::with_capacity(self.leftmost.len()),
        };
        for (corner, _) in is_cut.iter().enumerate().filter(|(_, is_cut)| **is_cut) {
            cut.opposite[corner] = NONE;
        }
        for &leftmost in self.leftmost.iter().filter(|&&corner| corner != NONE) {
            // The first corner to the right of a cut, if there is one.
            let mut first = leftmost;
            while let Some(left) = cut.left(first).filter(|&left| left != leftmost) {
                first = left;
            }
            if cut.left(first) == Some(leftmost) {
                first = leftmost;
            }
            let mut vertex = cut.add_vertex(first);
            let mut corner = self.right(first);
            while let Some(here) = corner.filter(|&corner| corner != first) {
                if cut.left(here).is_none() {
                    vertex = cut.add_vertex(here);
                }
                cut.vertex[here as usize] = vertex;
                corner = self.right(here);
            }
        }
        cut
    }
}
