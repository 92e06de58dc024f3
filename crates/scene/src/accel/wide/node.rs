//! Nodes of the wide tree.

use super::row::Row;
use glam::Vec3;
use lightshed_lanes::{AnyLanes, LaneMask};

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
    pub fn blocks<M: AnyLanes>(children: M) -> u32 {
        M::splat(2.0).less_equal(children).bits()
    }

    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & Self::INDEX_MASK) as usize
    }
}

/// Children with their boxes, as many as a row is long, laid out so that the bits of a child's slot
/// say on which sides of the node it lies, as far as the children can be told apart so; a ray then
/// meets them about in the order of their slots, exclusive-or [`Row::flip`] of its direction
/// (Ylitie, Karras and Laine 2017 §3.2). One row a bound: `bounds[axis]` has the least and the
/// greatest coordinates.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct Node<R> {
    bounds: [[R; 2]; 3],
    /// Each a [`Child`].
    children: R,
}

impl<R: Row> Node<R> {
    /// A node without children.
    pub fn empty() -> Self {
        let [nowhere_from, nowhere_to] =
            [f32::INFINITY, f32::NEG_INFINITY].map(|end| R::splat(end.to_bits()));
        Self {
            bounds: [[nowhere_from, nowhere_to]; 3],
            children: R::splat(Child::EMPTY.0),
        }
    }

    /// Sets child `slot` with its box.
    pub fn set(&mut self, slot: usize, min: Vec3, max: Vec3, child: Child) {
        for axis in 0..3 {
            self.bounds[axis][0].words_mut()[slot] = min[axis].to_bits();
            self.bounds[axis][1].words_mut()[slot] = max[axis].to_bits();
        }
        self.children.words_mut()[slot] = child.0;
    }

    /// The child in a slot, taken modulo the number of slots.
    #[inline(always)]
    pub fn child(&self, slot: u32) -> Child {
        Child(self.children.words()[slot as usize % R::COUNT])
    }

    /// All children, as bits.
    #[inline(always)]
    pub fn children<M: AnyLanes>(&self) -> M {
        M::read(self.children.words())
    }

    /// A coordinate of all boxes: the greatest if `end` is 1, the least if it is 0.
    #[inline(always)]
    pub fn bound<M: AnyLanes>(&self, axis: usize, end: usize) -> M {
        M::read(self.bounds[axis][end].words())
    }

    /// The same of the box in a slot, taken modulo the number of slots.
    #[inline(always)]
    pub fn bound_of(&self, axis: usize, end: usize, slot: u32) -> f32 {
        f32::from_bits(self.bounds[axis][end].words()[slot as usize % R::COUNT])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_lanes::ArrayLanes;

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
        let children = ArrayLanes::read(bytemuck::cast_slice(&kinds));
        assert_eq!(Child::blocks(children), 0b0000_1010);
    }
}
