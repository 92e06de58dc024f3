//! Nodes of the eight-wide tree.

use glam::Vec3;
use lightshed_lanes::{LaneMask, Lanes};

/// Reference to a child: a node, a block of triangles, a sphere, an instance, or nothing.
///
/// The two top bits are the kind, the others an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Child(pub u32);

/// What a [`Child`] refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChildKind {
    Node,
    Triangles,
    Sphere,
    Instance,
}

impl Child {
    const KIND_SHIFT: u32 = 30;
    const INDEX_MASK: u32 = (1 << Self::KIND_SHIFT) - 1;
    /// An unused slot. Its box is empty, so that no ray reaches it.
    pub const EMPTY: Self = Self(u32::MAX);
    /// The largest index that fits.
    pub const MAX_INDEX: usize = Self::INDEX_MASK as usize - 1;

    #[inline(always)]
    pub fn new(kind: ChildKind, index: usize) -> Self {
        debug_assert!(index <= Self::MAX_INDEX);
        let kind = match kind {
            ChildKind::Node => 0,
            ChildKind::Triangles => 1,
            ChildKind::Sphere => 2,
            ChildKind::Instance => 3,
        };
        Self(kind << Self::KIND_SHIFT | index as u32)
    }

    #[inline(always)]
    pub fn kind(self) -> ChildKind {
        match self.0 >> Self::KIND_SHIFT {
            0 => ChildKind::Node,
            1 => ChildKind::Triangles,
            2 | 3 if cfg!(lightshed_without = "spheres") => ChildKind::Triangles,
            2 => ChildKind::Sphere,
            _ if cfg!(lightshed_without = "instances") => ChildKind::Sphere,
            _ => ChildKind::Instance,
        }
    }

    /// Which of a node's children, read as values, are blocks of triangles: as values those are at
    /// least 2 (or NaN, beyond a thousand million blocks), nodes less, and others negative or NaN.
    #[inline(always)]
    pub fn blocks<L: Lanes>(children: L) -> u32 {
        L::splat(2.0).less_equal(children).bits()
    }

    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & Self::INDEX_MASK) as usize
    }
}

/// Eight children with their boxes, laid out so that bit `a` of a child's slot says whether it lies
/// towards the positive side of axis `a`, as far as the children can be told apart so; a ray then
/// meets them about in the order of their slots, exclusive-or the octant of its direction (Ylitie,
/// Karras and Laine 2017 §3.2). One row of eight a bound: `bounds[axis]` has the least and the
/// greatest coordinates.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct Node {
    pub bounds: [[[f32; 8]; 2]; 3],
    pub children: [Child; 8],
}

const _: () = assert!(size_of::<Node>() == 224);

impl Node {
    /// A node without children.
    pub fn empty() -> Self {
        Self {
            bounds: [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3],
            children: [Child::EMPTY; 8],
        }
    }

    /// Sets child `slot` with its box.
    pub fn set(&mut self, slot: usize, min: Vec3, max: Vec3, child: Child) {
        for axis in 0..3 {
            self.bounds[axis][0][slot] = min[axis];
            self.bounds[axis][1][slot] = max[axis];
        }
        self.children[slot] = child;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_lanes::{ArrayLanes, Lanes};

    #[test]
    fn blocks_are_told_by_their_values() {
        let kinds = [
            Child::new(ChildKind::Node, 0),
            Child::new(ChildKind::Triangles, 0),
            Child::new(ChildKind::Node, Child::MAX_INDEX),
            Child::new(ChildKind::Triangles, 57_000_000),
            Child::new(ChildKind::Sphere, 1),
            Child::new(ChildKind::Instance, 3),
            Child::EMPTY,
            Child::new(ChildKind::Node, 5),
        ];
        let children = ArrayLanes::load(bytemuck::cast_ref(&kinds));
        assert_eq!(Child::blocks(children), 0b0000_1010);
    }
}
