//! Collapsing a binary tree into one with eight children a node, at the least expected cost.
//!
//! The surface area heuristic's cost of a subtree `n`, when it is to become at most `i` children of some node:
//!
//! ```text
//! C(n, 1) = min( A(n) · c_leaf            if n has at most 8 triangles,
//!                A(n) · c_node + D(n, 8) )
//! C(n, i) = min( D(n, i), C(n, i−1) )
//! D(n, j) = min over 0 < k < j of C(left, k) + C(right, j−k)
//! ```
//!
//! with `A` the surface area of the box: the dynamic programme of Ylitie, Karras and Laine 2017, *Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, §3.1, with this tree's own leaf costs.

use super::node::{Child, ChildKind, Node};
use super::{Primitives, WideBvh};
use crate::accel::block::TriangleBlock;
use crate::accel::stack::STACK_CAPACITY;
use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

/// Cost of testing eight boxes, and of testing a block of eight triangles or a sphere; only their ratio counts.
const COST_NODE: f32 = 1.0;
const COST_LEAF: f32 = 1.2;

/// Triangles in a block.
const LEAF_TRIANGLES: usize = 8;

/// Deepest tree that the traversal's stack can hold: each level leaves at most seven siblings behind.
const MAX_DEPTH: usize = (STACK_CAPACITY - 1) / 7;

/// A binary tree over primitives, in the form that the collapse works on: parents before children.
struct Binary {
    nodes: Vec<BinaryNode>,
    /// Primitives in the order of the tree's leaves.
    primitives: Vec<u32>,
}

#[derive(Clone, Copy)]
struct BinaryNode {
    bounds: Aabb,
    /// Children, or `None` for a leaf.
    children: Option<[u32; 2]>,
    /// Range of `Binary::primitives` below this node.
    first: u32,
    count: u32,
}

impl Binary {
    /// Re-lays an obvhs tree in depth-first order, so that every subtree's primitives are contiguous.
    fn from_bvh2(bvh: &Bvh2) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(bvh.nodes.len()),
            primitives: Vec::new(),
        };
        // (index in obvhs, slot to patch in the parent)
        let mut stack = vec![(0usize, None::<(u32, usize)>)];
        while let Some((source, parent)) = stack.pop() {
            let node = &bvh.nodes[source];
            let index = tree.nodes.len() as u32;
            if let Some((parent, side)) = parent {
                tree.nodes[parent as usize].children.get_or_insert([0; 2])[side] = index;
            }
            let first = tree.primitives.len() as u32;
            if node.is_leaf() {
                let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                tree.primitives.extend_from_slice(&bvh.primitive_indices[range]);
            } else {
                let left = node.first_index as usize;
                stack.push((left + 1, Some((index, 1))));
                stack.push((left, Some((index, 0))));
            }
            tree.nodes.push(BinaryNode {
                bounds: *node.aabb(),
                children: None,
                first,
                count: node.prim_count,
            });
        }
        tree.sum_counts();
        tree
    }

    /// A balanced tree over primitives in the order of their indices' positions along the longest axis: for input on
    /// which the heuristic's tree degenerates (a million equal triangles, say) and would be too deep to traverse.
    fn balanced(boxes: &[Aabb]) -> Self {
        let mut primitives: Vec<u32> = (0..boxes.len() as u32).collect();
        let all = union(boxes.iter());
        let axis = (all.max - all.min).max_position();
        let key = |i: u32| boxes[i as usize].min[axis] + boxes[i as usize].max[axis];
        primitives.sort_by(|&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        let mut tree = Self {
            nodes: Vec::new(),
            primitives,
        };
        let mut stack = vec![(0u32, boxes.len() as u32, None::<(u32, usize)>)];
        while let Some((first, count, parent)) = stack.pop() {
            let index = tree.nodes.len() as u32;
            if let Some((parent, side)) = parent {
                tree.nodes[parent as usize].children.get_or_insert([0; 2])[side] = index;
            }
            if count > 1 {
                stack.push((first + count / 2, count - count / 2, Some((index, 1))));
                stack.push((first, count / 2, Some((index, 0))));
            }
            let range = first as usize..(first + count) as usize;
            let bounds = union(tree.primitives[range].iter().map(|&i| &boxes[i as usize]));
            tree.nodes.push(BinaryNode {
                bounds,
                children: None,
                first,
                count,
            });
        }
        tree
    }

    /// Fills in the counts of inner nodes from those of leaves.
    fn sum_counts(&mut self) {
        for i in (0..self.nodes.len()).rev() {
            if let Some([l, r]) = self.nodes[i].children {
                self.nodes[i].count = self.nodes[l as usize].count + self.nodes[r as usize].count;
            }
        }
    }
}

fn union<'a>(boxes: impl Iterator<Item = &'a Aabb>) -> Aabb {
    boxes.fold(Aabb::INVALID, |a, b| a.union(b))
}

/// How a subtree is best turned into at most `i + 1` children, `i` the index.
#[derive(Clone, Copy, Default)]
struct Plan {
    cost: [f32; 7],
    /// Children given to the left subtree; 0 where one child fewer is as good; for `i = 0`: 0 for a leaf, else the
    /// left's share of the eight.
    left_share: [u8; 7],
}

fn plan(tree: &Binary, primitives: &Primitives) -> Vec<Plan> {
    let mut plans = vec![Plan::default(); tree.nodes.len()];
    for i in (0..tree.nodes.len()).rev() {
        let node = &tree.nodes[i];
        let area = node.bounds.half_area();
        let leaf = if can_be_leaf(tree, node, primitives) {
            area * COST_LEAF
        } else {
            f32::INFINITY
        };
        let Some([left, right]) = node.children else {
            plans[i] = Plan {
                cost: [leaf; 7],
                left_share: [0; 7],
            };
            continue;
        };
        let (left, right) = (plans[left as usize], plans[right as usize]);
        // Cost and left share of the best split of `children` between the two subtrees.
        let split = |children: usize| {
            let mut best = (f32::INFINITY, 1u8);
            for share in children.saturating_sub(7).max(1)..=(children - 1).min(7) {
                let cost = left.cost[share - 1] + right.cost[children - share - 1];
                if cost < best.0 {
                    best = (cost, share as u8);
                }
            }
            best
        };
        let mut plan = Plan::default();
        let (inner, share) = split(8);
        let inner = inner + area * COST_NODE;
        (plan.cost[0], plan.left_share[0]) = if leaf <= inner { (leaf, 0) } else { (inner, share) };
        for children in 2..=7 {
            let (cost, share) = split(children);
            let fewer = plan.cost[children - 2];
            (plan.cost[children - 1], plan.left_share[children - 1]) =
                if fewer <= cost { (fewer, 0) } else { (cost, share) };
        }
        plans[i] = plan;
    }
    plans
}

fn can_be_leaf(tree: &Binary, node: &BinaryNode, primitives: &Primitives) -> bool {
    let count = node.count as usize;
    if count == 1 {
        return true;
    }
    let range = node.first as usize..node.first as usize + count;
    count <= LEAF_TRIANGLES
        && tree.primitives[range]
            .iter()
            .all(|&i| (i as usize) < primitives.triangles.len())
}

/// Turns the planned tree into nodes and leaves.
struct Emitter<'a> {
    tree: &'a Binary,
    plans: &'a [Plan],
    primitives: &'a Primitives<'a>,
    nodes: Vec<Node>,
    blocks: Vec<TriangleBlock>,
    depth: usize,
}

impl Emitter<'_> {
    /// The subtrees that become the children of the wide node for `root`.
    fn children_of(&self, root: u32) -> ([u32; 8], usize) {
        let (mut children, mut count) = ([0; 8], 0);
        let Some([left, right]) = self.tree.nodes[root as usize].children else {
            children[0] = root;
            return (children, 1);
        };
        let share = self.plans[root as usize].left_share[0] as usize;
        // A root that is best as one leaf still needs a node above it.
        if share == 0 {
            children[0] = root;
            return (children, 1);
        }
        let mut stack = vec![(right, 8 - share), (left, share)];
        while let Some((node, mut budget)) = stack.pop() {
            let plan = &self.plans[node as usize];
            while budget > 1 && plan.left_share[budget - 1] == 0 {
                budget -= 1;
            }
            match self.tree.nodes[node as usize].children {
                Some([left, right]) if budget > 1 => {
                    let share = plan.left_share[budget - 1] as usize;
                    stack.push((right, budget - share));
                    stack.push((left, share));
                }
                _ => {
                    children[count] = node;
                    count += 1;
                }
            }
        }
        (children, count)
    }

    /// A slot for each child by where it lies, see [`Node`]: the child that most wants a slot takes it first.
    fn slots(&self, root: u32, children: &[u32]) -> [usize; 8] {
        let center = |node: u32| {
            let Aabb { min, max } = self.tree.nodes[node as usize].bounds;
            min * 0.5 + max * 0.5
        };
        let middle = center(root);
        let mut slots = [0; 8];
        let (mut placed, mut taken) = ([false; 8], [false; 8]);
        for _ in children {
            let mut best = (f32::NEG_INFINITY, 0, 0);
            for (place, &child) in children.iter().enumerate().filter(|&(place, _)| !placed[place]) {
                let offset = center(child) - middle;
                for slot in (0..8).filter(|&slot| !taken[slot]) {
                    let towards = |axis: usize| {
                        if slot >> axis & 1 == 1 {
                            offset[axis]
                        } else {
                            -offset[axis]
                        }
                    };
                    let wish = towards(0) + towards(1) + towards(2);
                    // NaN cannot win; the first free slot is there if all wishes are lost to overflow.
                    if wish > best.0 || best.0 == f32::NEG_INFINITY {
                        best = (wish, place, slot);
                    }
                }
            }
            (placed[best.1], taken[best.2]) = (true, true);
            slots[best.1] = best.2;
        }
        slots
    }

    fn is_leaf(&self, node: u32) -> bool {
        self.tree.nodes[node as usize].children.is_none() || self.plans[node as usize].left_share[0] == 0
    }

    fn leaf(&mut self, node: u32) -> Child {
        let BinaryNode { first, count, .. } = self.tree.nodes[node as usize];
        let range = first as usize..(first + count) as usize;
        let members = &self.tree.primitives[range];
        let triangles = self.primitives.triangles;
        if let Some(sphere) = (members[0] as usize).checked_sub(triangles.len()) {
            return Child::new(ChildKind::Sphere, sphere);
        }
        self.blocks.push(TriangleBlock::new(
            members.iter().map(|&i| (i, triangles[i as usize])),
        ));
        Child::new(ChildKind::Triangles, self.blocks.len() - 1)
    }

    fn emit(&mut self) {
        self.nodes.push(Node::empty());
        // (binary subtree, its wide node, depth)
        let mut stack = vec![(0u32, 0usize, 1usize)];
        while let Some((root, index, depth)) = stack.pop() {
            self.depth = self.depth.max(depth);
            let (children, count) = self.children_of(root);
            let slots = self.slots(root, &children[..count]);
            for (&slot, &child) in slots.iter().zip(&children[..count]) {
                let Aabb { min, max } = self.tree.nodes[child as usize].bounds;
                let reference = if self.is_leaf(child) {
                    self.leaf(child)
                } else {
                    self.nodes.push(Node::empty());
                    stack.push((child, self.nodes.len() - 1, depth + 1));
                    Child::new(ChildKind::Node, self.nodes.len() - 1)
                };
                self.nodes[index].set(slot, Vec3::from(min), Vec3::from(max), reference);
            }
        }
    }
}

fn collapse<'a>(tree: &'a Binary, plans: &'a [Plan], primitives: &'a Primitives) -> Emitter<'a> {
    let mut emitter = Emitter {
        tree,
        plans,
        primitives,
        nodes: Vec::new(),
        blocks: Vec::new(),
        depth: 0,
    };
    emitter.emit();
    emitter
}

/// Collapses `bvh`, which was built over `boxes` (of the triangles, then the spheres, at least one).
pub fn build(bvh: &Bvh2, boxes: &[Aabb], primitives: &Primitives) -> WideBvh {
    let first_sphere = primitives.triangles.len() as u32;
    let tree = Binary::from_bvh2(bvh);
    let plans = plan(&tree, primitives);
    let emitted = collapse(&tree, &plans, primitives);
    if emitted.depth <= MAX_DEPTH {
        return WideBvh::from_parts(
            emitted.nodes,
            emitted.blocks,
            primitives.spheres.to_vec(),
            first_sphere,
        );
    }
    let tree = Binary::balanced(boxes);
    let plans = plan(&tree, primitives);
    let emitted = collapse(&tree, &plans, primitives);
    WideBvh::from_parts(
        emitted.nodes,
        emitted.blocks,
        primitives.spheres.to_vec(),
        first_sphere,
    )
}
