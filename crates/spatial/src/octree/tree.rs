//! The tree and its traversals.

use super::augmented::{Augmented, Correspondence};
use super::error::OctreeError;
use super::node::{MAX_OCTREE_DEPTH, OctreeNode};
use crate::{Bounds, SpatialIndex, SurfaceSite};
use glam::Vec3;

/// Cells an axis at the largest depth.
const UNITS: u32 = 1 << MAX_OCTREE_DEPTH;

/// An octree over a cube, whose leaves are split and joined by the number of samples that fall into
/// them (Dittebrandt 2025 §5.6).
///
/// A leaf is identified by its *slot*: 8 times the number of its parent plus its position there. To
/// keep records for leaves, keep an array for each kind of data (structure of arrays) of
/// [`slot_count`](Self::slot_count) elements; at most one in eight is at the slot of an inner node
/// and means nothing. [`adapt`](Self::adapt) changes the tree. [`populate`](Self::populate) then
/// moves such arrays from the slots of the previous tree to those of the new one.
///
/// As a [`SpatialIndex`] it returns the slot of the leaf that contains a position; positions
/// outside the cube have none.
///
/// ```
/// use lightshed_spatial::glam::Vec3;
/// use lightshed_spatial::{AdaptiveOctree, Bounds, OctreeOptions};
///
/// let mut tree = AdaptiveOctree::new(Bounds { min: Vec3::ZERO, max: Vec3::ONE })?;
/// let options = OctreeOptions { split_above: 100, collapse_below: 50, ..OctreeOptions::default() };
/// let positions: Vec<Vec3> = (0..1000).map(|i| Vec3::new(i as f32 / 1000.0, 0.1, 0.1)).collect();
/// for _frame in 0..3 {
///     let mut counts = vec![0; tree.slot_count()];
///     for slot in positions.iter().filter_map(|&position| tree.slot(position)) {
///         counts[slot as usize] += 1;
///     }
///     tree.adapt(&counts, &options)?;
/// }
/// // Leaves of 1/16 of the side where the samples are, of 1/2 where there are none.
/// let depth = |position| tree.cell(tree.slot(position).unwrap()).depth;
/// assert_eq!((depth(Vec3::new(0.3, 0.1, 0.1)), depth(Vec3::ONE)), (4, 1));
/// # Ok::<(), lightshed_spatial::OctreeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct AdaptiveOctree {
    min: Vec3,
    side: f32,
    per_length: f32,
    pub(super) nodes: Vec<OctreeNode>,
    pub(super) augmented: Augmented,
}

/// The cube of a leaf: `[coordinates, coordinates + 1) · side · 2^−depth` from the least corner
/// of the tree's cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OctreeCell {
    /// Depth of the leaf, from 1.
    pub depth: u32,
    /// Whole numbers from 0 to `2^depth − 1`.
    pub coordinates: [u32; 3],
}

impl AdaptiveOctree {
    /// Eight leaves over the cube with the least corner and the longest side of `bounds`, made
    /// larger by a thousandth on all sides, so that rounding leaves nothing outside.
    ///
    /// # Errors
    /// [`OctreeError::Bounds`].
    pub fn new(bounds: Bounds) -> Result<Self, OctreeError> {
        let extent = (bounds.max - bounds.min).max_element();
        let margin = extent * 1e-3;
        let (min, side) = (bounds.min - margin, extent + 2.0 * margin);
        let per_length = UNITS as f32 / side;
        let is_sound = bounds.min.cmple(bounds.max).all() && min.is_finite() && (min + side).is_finite();
        if !(is_sound && side > 0.0 && per_length.is_normal()) {
            return Err(OctreeError::Bounds);
        }
        let nodes = vec![OctreeNode::LEAVES];
        let augmented = Augmented::of_root();
        Ok(Self {
            min,
            side,
            per_length,
            nodes,
            augmented,
        })
    }

    /// A tree of the same cube with these nodes in breadth-first order, as saved before; each leaf
    /// corresponds to itself.
    ///
    /// # Errors
    /// [`OctreeError::Damaged`] if they do not form a tree.
    pub fn with_nodes(&self, nodes: &[OctreeNode]) -> Result<Self, OctreeError> {
        let augmented = Augmented::of_nodes(nodes).ok_or(OctreeError::Damaged)?;
        Ok(Self {
            nodes: nodes.to_vec(),
            augmented,
            ..self.clone()
        })
    }

    /// The inner nodes, breadth first; the root is the first.
    pub fn nodes(&self) -> &[OctreeNode] {
        &self.nodes
    }

    /// Least corner of the cube.
    pub fn min(&self) -> Vec3 {
        self.min
    }

    /// Side of the cube.
    pub fn side(&self) -> f32 {
        self.side
    }

    /// Number of slots of leaves and inner nodes: eight for each inner node.
    pub fn slot_count(&self) -> usize {
        8 * self.nodes.len()
    }

    /// Leaves.
    pub fn leaf_count(&self) -> usize {
        7 * self.nodes.len() + 1
    }

    /// Whether a slot is that of a leaf.
    pub fn is_leaf(&self, slot: u32) -> bool {
        let node = self.nodes.get(slot as usize / 8);
        node.is_some_and(|node| node.is_leaf(slot % 8))
    }

    /// Slots of all leaves, in order.
    pub fn leaves(&self) -> impl Iterator<Item = u32> {
        (0u32..).zip(&self.nodes).flat_map(|(index, node)| {
            let children = (0..8).filter(|&child| node.is_leaf(child));
            children.map(move |child| 8 * index + child)
        })
    }

    /// Coordinates in units of the finest cells; `None` outside the cube.
    #[inline(always)]
    fn units(&self, position: Vec3) -> Option<[u32; 3]> {
        let units = (position - self.min) * self.per_length;
        let end = Vec3::splat(UNITS as f32);
        // NaN fails the comparisons.
        let inside = units.cmpge(Vec3::ZERO).all() && units.cmplt(end).all();
        inside.then(|| units.to_array().map(|u| u as u32))
    }

    /// Child of a node at `depth` that contains the finest cell `units`.
    #[inline(always)]
    fn child(units: [u32; 3], depth: u32) -> u32 {
        let bit = |u: u32| u >> (MAX_OCTREE_DEPTH - 1 - depth) & 1;
        bit(units[0]) | bit(units[1]) << 1 | bit(units[2]) << 2
    }

    /// Descends from a node at `depth`.
    #[inline(always)]
    fn descend(&self, mut node: u32, mut depth: u32, units: [u32; 3]) -> u32 {
        loop {
            let (inner, child) = (self.nodes[node as usize], Self::child(units, depth));
            if inner.is_leaf(child) {
                return 8 * node + child;
            }
            node = inner.inner(child);
            depth += 1;
        }
    }

    /// Slot of the leaf that `position` is in; `None` outside the cube.
    #[inline]
    pub fn slot(&self, position: Vec3) -> Option<u32> {
        Some(self.descend(0, 0, self.units(position)?))
    }

    /// The slot of `position`, and that of the point `offset` away from it, in sides of the first
    /// slot's leaf; `None` where they are outside the cube. The nodes that both lie in are walked
    /// once.
    #[inline]
    pub fn slot_moved(&self, position: Vec3, offset: Vec3) -> Option<(u32, Option<u32>)> {
        let units = self.units(position)?;
        // The nodes from the root down.
        let mut nodes = [0; MAX_OCTREE_DEPTH as usize];
        let (mut node, mut depth) = (0, 0);
        let slot = loop {
            let (inner, child) = (self.nodes[node as usize], Self::child(units, depth));
            nodes[depth as usize % nodes.len()] = node;
            if inner.is_leaf(child) {
                break 8 * node + child;
            }
            node = inner.inner(child);
            depth += 1;
        };
        let moved = self
            .units(position + self.side_at(depth + 1) * offset)
            .map(|moved| {
                let differing = (units[0] ^ moved[0]) | (units[1] ^ moved[1]) | (units[2] ^ moved[2]);
                let common = differing.leading_zeros() - (u32::BITS - MAX_OCTREE_DEPTH);
                // In the same leaf or below the last node that both lie in.
                if common > depth {
                    slot
                } else {
                    self.descend(nodes[common as usize % nodes.len()], common, moved)
                }
            });
        Some((slot, moved))
    }

    /// Slots of two positions at once, for example of a point in this frame and in the previous
    /// frame. Their common path from the root is walked once.
    #[inline]
    pub fn slots_of_pair(&self, now: Vec3, before: Vec3) -> [Option<u32>; 2] {
        let (Some(first), Some(second)) = (self.units(now), self.units(before)) else {
            return [self.slot(now), self.slot(before)];
        };
        let differing = (first[0] ^ second[0]) | (first[1] ^ second[1]) | (first[2] ^ second[2]);
        // Nodes down to this depth have the same child.
        let common = differing.leading_zeros() - (u32::BITS - MAX_OCTREE_DEPTH);
        let (mut node, mut depth) = (0, 0);
        while depth < common {
            let (inner, child) = (self.nodes[node as usize], Self::child(first, depth));
            if inner.is_leaf(child) {
                return [Some(8 * node + child); 2];
            }
            node = inner.inner(child);
            depth += 1;
        }
        [first, second].map(|units| Some(self.descend(node, depth, units)))
    }

    /// Depth of a leaf from its slot, from 1.
    #[inline(always)]
    pub fn depth(&self, slot: u32) -> u32 {
        u32::from(self.augmented.depths[slot as usize / 8]) + 1
    }

    /// Side of a leaf's cube.
    #[inline(always)]
    pub fn leaf_side(&self, slot: u32) -> f32 {
        self.side_at(self.depth(slot))
    }

    /// Side of cubes of a depth.
    #[inline(always)]
    fn side_at(&self, depth: u32) -> f32 {
        // A power of two from its exponent.
        self.side * f32::from_bits((127 - depth) << 23)
    }

    /// The cube of a leaf or inner node, found through its parents.
    pub fn cell(&self, slot: u32) -> OctreeCell {
        let (depth, mut coordinates, mut slot) = (self.depth(slot), [0; 3], slot);
        for level in 0..depth {
            for (axis, coordinate) in coordinates.iter_mut().enumerate() {
                *coordinate |= (slot >> axis & 1) << level;
            }
            slot = self.augmented.parents[slot as usize / 8];
        }
        OctreeCell { depth, coordinates }
    }

    /// The box of a leaf or inner node, rounded.
    pub fn bounds(&self, slot: u32) -> Bounds {
        let OctreeCell { depth, coordinates } = self.cell(slot);
        let side = f64::from(self.side) / f64::from(1u32 << depth);
        let corner = |offset: u32| {
            let units = glam::DVec3::from(coordinates.map(|c| f64::from(c + offset)));
            (self.min.as_dvec3() + units * side).as_vec3()
        };
        Bounds {
            min: corner(0),
            max: corner(1),
        }
    }

    /// Descends to the node or leaf that contains the cube `cell`, at most to its depth. Returns
    /// the slot, and whether it is a leaf.
    pub(super) fn slot_of_cell(&self, cell: OctreeCell) -> (u32, bool) {
        let units = cell
            .coordinates
            .map(|coordinate| coordinate << (MAX_OCTREE_DEPTH - cell.depth));
        let (mut node, mut depth) = (0, 0);
        loop {
            let (inner, child) = (self.nodes[node as usize], Self::child(units, depth));
            let slot = 8 * node + child;
            depth += 1;
            if inner.is_leaf(child) || depth == cell.depth {
                return (slot, inner.is_leaf(child));
            }
            node = inner.inner(child);
        }
    }

    /// The state of a slot in the tree before the last [`adapt`](Self::adapt); `None` for slots of
    /// inner nodes.
    #[inline]
    pub fn correspondence(&self, slot: u32) -> Option<Correspondence> {
        let code = self.augmented.correspondences.get(slot as usize)?;
        Correspondence::decode(*code)
    }

    /// Moves an array of leaf data from the slots of the previous tree to those of this one. A part
    /// of a split leaf gets the data of the whole; a joined leaf gets the data of the part with
    /// most samples.
    pub fn populate<T: Clone + Default>(&self, before: &[T]) -> Vec<T> {
        let of = |slot| {
            let from = self.correspondence(slot).map(Correspondence::slot);
            from.and_then(|slot| before.get(slot as usize))
                .cloned()
                .unwrap_or_default()
        };
        (0..self.slot_count() as u32).map(of).collect()
    }
}

impl SpatialIndex for AdaptiveOctree {
    type Cell = u32;

    #[inline]
    fn locate(&self, site: &SurfaceSite) -> Option<u32> {
        self.slot(site.position)
    }
}
