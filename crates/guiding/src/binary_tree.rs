//! A binary tree of space that only grows (Müller 2017 §3.1).

use crate::GuidingError;
use crate::partition::Partition;
use glam::Vec3;
use lightshed_spatial::Bounds;

/// Halves boxes with many samples at their middle, along x, y and z in turn: the spatial tree of
/// the SD-tree of Müller 2017 (*Practical Path Guiding for Efficient Light-Transport Simulation*,
/// §3.1). Regions are never joined again.
#[derive(Clone, Debug)]
pub struct BinaryTree {
    bounds: Bounds,
    /// Children of inner nodes: the number of an inner node, or [`LEAF`] and a slot.
    nodes: Vec<[u32; 2]>,
    /// For each slot its box, its depth and its origin.
    leaves: Vec<Leaf>,
}

#[derive(Clone, Copy, Debug)]
struct Leaf {
    bounds: Bounds,
    depth: u32,
    origin: u32,
}

/// Marks children that are leaves.
const LEAF: u32 = 1 << 31;
/// Largest depth of a leaf: twenty halvings of each axis.
const MAX_DEPTH: u32 = 60;

impl BinaryTree {
    /// The half of a box that contains a position, and its box.
    #[inline(always)]
    fn half(bounds: &mut Bounds, axis: usize, position: Vec3) -> usize {
        let middle = 0.5 * (bounds.min[axis] + bounds.max[axis]);
        if position[axis] < middle {
            bounds.max[axis] = middle;
            0
        } else {
            bounds.min[axis] = middle;
            1
        }
    }

    /// The box's half, lower or upper.
    fn halved(bounds: Bounds, axis: usize, half: usize) -> Bounds {
        let mut bounds = bounds;
        let middle = 0.5 * (bounds.min[axis] + bounds.max[axis]);
        match half {
            0 => bounds.max[axis] = middle,
            _ => bounds.min[axis] = middle,
        }
        bounds
    }

    /// Boxes, depths and origins of the leaves of valid nodes; `None` for other nodes.
    fn leaves_of(bounds: Bounds, nodes: &[[u32; 2]]) -> Option<Vec<Leaf>> {
        let mut leaves = vec![None; nodes.len() + 1];
        let mut visited = 0;
        let mut stack = vec![(0u32, 0u32, bounds)];
        while let Some((node, depth, bounds)) = stack.pop() {
            visited += 1;
            if visited > nodes.len() || depth >= MAX_DEPTH {
                return None;
            }
            for (half, &child) in nodes.get(node as usize)?.iter().enumerate() {
                let bounds = Self::halved(bounds, depth as usize % 3, half);
                if child & LEAF == 0 {
                    stack.push((child, depth + 1, bounds));
                    continue;
                }
                let slot = child & !LEAF;
                let place = leaves.get_mut(slot as usize)?;
                let leaf = Leaf {
                    bounds,
                    depth: depth + 1,
                    origin: slot,
                };
                if place.replace(leaf).is_some() {
                    return None;
                }
            }
        }
        leaves.into_iter().collect()
    }
}

impl Partition for BinaryTree {
    fn over(bounds: Bounds) -> Result<Self, GuidingError> {
        let margin = 1e-3 * (bounds.max - bounds.min).max_element();
        let is_sound = bounds.min.cmple(bounds.max).all() && margin > 0.0;
        let bounds = Bounds {
            min: bounds.min - margin,
            max: bounds.max + margin,
        };
        if !(is_sound && bounds.min.is_finite() && bounds.max.is_finite()) {
            return Err(GuidingError::Bounds);
        }
        let nodes = vec![[LEAF, LEAF | 1]];
        let leaves = Self::leaves_of(bounds, &nodes).ok_or(GuidingError::Bounds)?;
        Ok(Self {
            bounds,
            nodes,
            leaves,
        })
    }

    fn slot_count(&self) -> usize {
        self.leaves.len()
    }

    #[inline]
    fn slot(&self, position: Vec3) -> Option<u32> {
        let Bounds { min, max } = self.bounds;
        // NaN fails the comparisons.
        if !(position.cmpge(min).all() && position.cmple(max).all()) {
            return None;
        }
        let (mut node, mut axis, mut bounds) = (0, 0, self.bounds);
        loop {
            let child = self.nodes[node as usize][Self::half(&mut bounds, axis, position)];
            if child & LEAF != 0 {
                return Some(child & !LEAF);
            }
            (node, axis) = (child, if axis == 2 { 0 } else { axis + 1 });
        }
    }

    fn bounds(&self, slot: u32) -> Bounds {
        self.leaves[slot as usize].bounds
    }

    fn extent(&self, slot: u32) -> Vec3 {
        let Bounds { min, max } = self.bounds(slot);
        max - min
    }

    fn adapt(
        &mut self,
        counts: &[u32],
        split_above: u32,
        _: u32,
        max_regions: usize,
    ) -> Result<bool, GuidingError> {
        let is_split = |slot: usize, leaf: &Leaf| counts[slot] > split_above && leaf.depth < MAX_DEPTH;
        let splits = self
            .leaves
            .iter()
            .enumerate()
            .filter(|(slot, leaf)| is_split(*slot, leaf))
            .count();
        if self.leaves.len() + splits > max_regions {
            return Err(GuidingError::TooManyRegions(max_regions));
        }
        for (slot, leaf) in (0u32..).zip(&mut self.leaves) {
            leaf.origin = slot;
        }
        let nodes = self.nodes.len();
        for node in 0..nodes {
            for half in 0..2 {
                let slot = (self.nodes[node][half] & !LEAF) as usize;
                if self.nodes[node][half] & LEAF == 0 || !is_split(slot, &self.leaves[slot]) {
                    continue;
                }
                let leaf = self.leaves[slot];
                let other = self.leaves.len() as u32;
                self.nodes[node][half] = self.nodes.len() as u32;
                self.nodes.push([LEAF | slot as u32, LEAF | other]);
                let part = |half| Leaf {
                    bounds: Self::halved(leaf.bounds, leaf.depth as usize % 3, half),
                    depth: leaf.depth + 1,
                    ..leaf
                };
                self.leaves[slot] = part(0);
                self.leaves.push(part(1));
            }
        }
        Ok(splits > 0)
    }

    fn origin(&self, slot: u32) -> Option<u32> {
        self.leaves.get(slot as usize).map(|leaf| leaf.origin)
    }

    fn save(&self) -> Vec<u32> {
        self.nodes.concat()
    }

    fn load(&self, saved: &[u32]) -> Result<Self, GuidingError> {
        let nodes: Vec<[u32; 2]> = saved.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        let leaves = Self::leaves_of(self.bounds, &nodes).filter(|_| saved.len() == 2 * nodes.len());
        let leaves = leaves.ok_or(GuidingError::Damaged("the nodes are not those of a binary tree"))?;
        Ok(Self {
            nodes,
            leaves,
            ..*self
        })
    }
}
