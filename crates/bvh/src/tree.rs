//! Binary trees.

use crate::node::Node;
use crate::primitive::Primitive;
use lightshed_spatial::Bounds;

/// A binary tree with one primitive in each leaf.
///
/// How many primitives a leaf of a traversed tree should have depends on how they are tested; a
/// program that lays out such a tree joins leaves by its own costs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bvh {
    /// In depth-first order; see [`Node`].
    pub(crate) nodes: Vec<Node>,
    /// Index of the primitive of each leaf, from the first leaf on.
    pub(crate) order: Vec<u32>,
}

/// What is wrong with a tree, by [`Bvh::check`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TreeFault {
    /// Nodes are not `2n − 1` in depth-first order: counts or ranges do not fit.
    #[error("node {0} does not fit in the order of nodes")]
    Layout(usize),
    /// A node's box does not contain what is below.
    #[error("the box of node {0} does not contain what is below it")]
    Bounds(usize),
    /// A primitive is in no leaf or in several.
    #[error("primitive {0} is not in exactly one leaf")]
    Leaf(u32),
}

impl Bvh {
    /// The nodes, in depth-first order; see [`Node`]. None over no primitives.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Index of the primitive of each leaf, from the first leaf on.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there are no primitives.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Children of node `index`, or `None` for a leaf.
    #[inline(always)]
    pub fn children(&self, index: usize) -> Option<[usize; 2]> {
        children(&self.nodes, index)
    }

    /// The box around everything; [`Bounds::EMPTY`] around nothing.
    pub fn bounds(&self) -> Bounds {
        self.nodes.first().map_or(Bounds::EMPTY, Node::bounds)
    }

    /// The cost by the surface area heuristic: `Σ A(N) / A(root)` over inner nodes times
    /// `traversal`, and over leaves times `intersection`. It is the expected cost of a line that
    /// hits the root's box, if testing a node's children costs `traversal` and a primitive
    /// `intersection`.
    pub fn sah_cost(&self, traversal: f64, intersection: f64) -> f64 {
        let area = |node: &Node| {
            let d = (node.max - node.min).as_dvec3();
            d.x * d.y + d.y * d.z + d.z * d.x
        };
        let (mut inner, mut leaves) = (0.0, 0.0);
        for node in &self.nodes {
            *if node.is_leaf() { &mut leaves } else { &mut inner } += area(node);
        }
        match self.nodes.first().map(area) {
            Some(root) if root > 0.0 => (traversal * inner + intersection * leaves) / root,
            _ => 0.0,
        }
    }

    /// Levels of nodes.
    pub fn depth(&self) -> usize {
        let mut deepest = 0;
        let mut waiting = Vec::new();
        if !self.is_empty() {
            waiting.push((0, 1));
        }
        while let Some((index, depth)) = waiting.pop() {
            deepest = deepest.max(depth);
            if let Some(children) = self.children(index) {
                waiting.extend(children.map(|child| (child, depth + 1)));
            }
        }
        deepest
    }

    /// Whether there are more levels than that.
    pub(crate) fn is_deeper_than(&self, levels: usize) -> bool {
        let mut waiting = Vec::new();
        if !self.is_empty() {
            waiting.push((0, 1));
        }
        while let Some((index, level)) = waiting.pop() {
            // What is below has no more levels than primitives.
            if self.nodes[index].count as usize + level <= levels + 1 {
                continue;
            }
            match self.children(index) {
                _ if level > levels => return true,
                Some(children) => waiting.extend(children.map(|child| (child, level + 1))),
                None => {}
            }
        }
        false
    }

    /// Checks that every primitive is in exactly one leaf, that boxes contain what is below, and
    /// that nodes lie as [`Node`] says.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check<P: Primitive>(&self, primitives: &[P]) -> Result<(), TreeFault> {
        let count = primitives.len();
        if self.order.len() != count || self.nodes.len() != (2 * count).saturating_sub(1) {
            return Err(TreeFault::Layout(0));
        }
        let mut seen = vec![false; count];
        for &index in &self.order {
            match seen.get_mut(index as usize) {
                Some(seen) if !*seen => *seen = true,
                _ => return Err(TreeFault::Leaf(index)),
            }
        }
        let mut waiting = Vec::new();
        if count > 0 {
            waiting.push((0, 0, count));
        }
        while let Some((index, first, count)) = waiting.pop() {
            let node = self.nodes[index];
            if node.first as usize != first || node.count as usize != count {
                return Err(TreeFault::Layout(index));
            }
            let contains = |inner: &Bounds| {
                let (min, max) = (inner.min.cmpge(node.min).all(), inner.max.cmple(node.max).all());
                min && max
            };
            if count == 1 {
                if !contains(&primitives[self.order[first] as usize].bounds()) {
                    return Err(TreeFault::Bounds(index));
                }
                continue;
            }
            let low = self.nodes[index + 1].count as usize;
            if low == 0 || low >= count {
                return Err(TreeFault::Layout(index));
            }
            for (child, first, count) in [
                (index + 1, first, low),
                (index + 2 * low, first + low, count - low),
            ] {
                if !contains(&self.nodes[child].bounds()) {
                    return Err(TreeFault::Bounds(index));
                }
                waiting.push((child, first, count));
            }
        }
        Ok(())
    }
}

/// Children of a node, or `None` for a leaf.
#[inline(always)]
pub(crate) fn children(nodes: &[Node], index: usize) -> Option<[usize; 2]> {
    (nodes[index].count > 1).then(|| [index + 1, index + 2 * nodes[index + 1].count as usize])
}

#[cfg(test)]
mod tests {
    use crate::{Bvh, Method};
    use glam::Vec3;
    use lightshed_spatial::Bounds;

    /// The answer is that of counting all levels, in trees of all shapes.
    #[test]
    fn deep_trees_are_noticed() {
        for count in [0u32, 1, 2, 3, 9, 60, 500] {
            // Each box holds those before it: chains.
            let nested: Vec<Bounds> = (0..count)
                .map(|i| Bounds::new(Vec3::ZERO, Vec3::splat(1.1f32.powi(i as i32 % 300))))
                .collect();
            let apart: Vec<Bounds> = (0..count).map(|i| Bounds::of_point(Vec3::X * i as f32)).collect();
            for boxes in [nested, apart] {
                for method in [Method::Agglomerative, Method::Ploc { radius: 4 }, Method::Binned] {
                    let tree = Bvh::build(&boxes, method).unwrap();
                    for levels in 0..tree.depth() + 2 {
                        let expected = tree.depth() > levels;
                        assert_eq!(tree.is_deeper_than(levels), expected, "{count}, {levels}");
                    }
                }
            }
        }
    }
}
