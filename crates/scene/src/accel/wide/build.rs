//! Collapses a binary tree into one with eight children a node, at the least expected cost.
//!
//! The surface area heuristic's cost of a subtree `n` if it becomes at most `i` children of some
//! node:
//!
//! ```text
//! C(n, 1) = min( A(n) · c_leaf            if n has at most 8 triangles,
//!                A(n) · c_node + D(n, 8) )
//! C(n, i) = min( D(n, i), C(n, i−1) )
//! D(n, j) = min over 0 < k < j of C(left, k) + C(right, j−k)
//! ```
//!
//! with `A` the surface area of the box: the dynamic programme of Ylitie, Karras and Laine 2017,
//! *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, §3.1, with this
//! tree's own leaf costs.

use super::node::{Child, ChildKind, Node};
use super::{Primitives, WideBvh};
use crate::accel::block::TriangleBlock;
use crate::accel::stack::STACK_CAPACITY;
use crate::accel::triangle::doubtful_reach;
use lightshed_bvh::{Bvh, Node as BinaryNode, Primitive};

/// Cost of testing eight boxes, and of testing a block of eight triangles or a sphere; only their
/// ratio counts.
const COST_NODE: f32 = 1.0;
const COST_LEAF: f32 = 1.2;

/// Triangles in a block.
const LEAF_TRIANGLES: usize = 8;

/// Deepest tree that the traversal's stack can hold: each level leaves at most seven siblings
/// behind.
const MAX_DEPTH: usize = (STACK_CAPACITY - 1) / 7;

/// Costs of a subtree that is to become at most `i + 1` children, `i` the index.
type Costs = [f32; 7];

/// How a subtree is best turned into at most `i` children: four bits for each number, which tell
/// how many of them are given to the left subtree. 0 where one child fewer is as good; for `i = 1`,
/// 0 for a leaf, else the left's share of the eight.
#[derive(Clone, Copy, Default)]
struct Shares(u32);

impl Shares {
    #[inline(always)]
    fn of(self, children: usize) -> usize {
        (self.0 >> (4 * children) & 15) as usize
    }

    #[inline(always)]
    fn set(&mut self, children: usize, share: u32) {
        self.0 |= share << (4 * children);
    }
}

fn plan(tree: &Bvh, primitives: &Primitives) -> Vec<Shares> {
    let mut plans = vec![Shares::default(); tree.nodes().len()];
    // From the last node to the first; the subtrees of a node are the last that were finished, the
    // left one on top.
    let mut finished: Vec<Costs> = Vec::new();
    for i in (0..plans.len()).rev() {
        let node = &tree.nodes()[i];
        let area = node.bounds().half_area();
        let can_be_leaf = can_be_leaf(tree, node, primitives);
        let leaf = if can_be_leaf {
            area * COST_LEAF
        } else {
            f32::INFINITY
        };
        if node.is_leaf() {
            finished.push([leaf; 7]);
            continue;
        }
        let (Some(left), Some(right)) = (finished.pop(), finished.pop()) else {
            break;
        };
        // Cost and left share of the best split of `children` between the two subtrees.
        let split = |children: usize| {
            let mut best = (f32::INFINITY, 1);
            for share in children.saturating_sub(7).max(1)..=(children - 1).min(7) {
                let cost = left[share - 1] + right[children - share - 1];
                if cost < best.0 {
                    best = (cost, share as u32);
                }
            }
            best
        };
        let (mut costs, mut shares) = (Costs::default(), Shares::default());
        let (inner, share) = split(8);
        let inner = inner + area * COST_NODE;
        // Areas of boxes beyond 10¹⁹ overflow, so that costs tell nothing.
        let becomes_leaf = can_be_leaf && leaf <= inner;
        costs[0] = if becomes_leaf { leaf } else { inner };
        shares.set(1, if becomes_leaf { 0 } else { share });
        for children in 2..=7 {
            let (cost, share) = split(children);
            let fewer = costs[children - 2];
            costs[children - 1] = if fewer <= cost { fewer } else { cost };
            shares.set(children, if fewer <= cost { 0 } else { share });
        }
        plans[i] = shares;
        finished.push(costs);
    }
    plans
}

fn can_be_leaf(tree: &Bvh, node: &BinaryNode, primitives: &Primitives) -> bool {
    let count = node.count as usize;
    if count == 1 {
        return true;
    }
    let range = node.first as usize..node.first as usize + count;
    count <= LEAF_TRIANGLES
        && tree.order()[range]
            .iter()
            .all(|&i| (i as usize) < primitives.triangles.len())
}

/// Turns the planned tree into nodes and leaves.
struct Emitter<'a> {
    tree: &'a Bvh,
    plans: &'a [Shares],
    primitives: &'a Primitives<'a>,
    nodes: Vec<Node>,
    blocks: Vec<TriangleBlock>,
    depth: usize,
}

impl Emitter<'_> {
    /// The subtrees that become the children of the wide node for `root`.
    fn children_of(&self, root: u32) -> ([u32; 8], usize) {
        let (mut children, mut count) = ([0; 8], 0);
        let Some([left, right]) = self.tree.children(root as usize) else {
            children[0] = root;
            return (children, 1);
        };
        let share = self.plans[root as usize].of(1);
        // A root that is best as one leaf still needs a node above it.
        if share == 0 {
            children[0] = root;
            return (children, 1);
        }
        let mut stack = vec![(right as u32, 8 - share), (left as u32, share)];
        while let Some((node, mut budget)) = stack.pop() {
            let plan = self.plans[node as usize];
            while budget > 1 && plan.of(budget) == 0 {
                budget -= 1;
            }
            match self.tree.children(node as usize) {
                Some([left, right]) if budget > 1 => {
                    let share = plan.of(budget);
                    stack.push((right as u32, budget - share));
                    stack.push((left as u32, share));
                }
                _ => {
                    children[count] = node;
                    count += 1;
                }
            }
        }
        (children, count)
    }

    /// Assigns each child a slot by its position, see [`Node`]: the child with the strongest
    /// preference takes its slot first.
    fn slots(&self, root: u32, children: &[u32]) -> [usize; 8] {
        let center = |node: u32| self.tree.nodes()[node as usize].bounds().center();
        let middle = center(root);
        // The preference of each child for each slot.
        let mut wishes = [[0.0f32; 8]; 8];
        for (wishes, &child) in wishes.iter_mut().zip(children) {
            let offset = center(child) - middle;
            for (slot, wish) in wishes.iter_mut().enumerate() {
                let towards = |axis: usize| {
                    if slot >> axis & 1 == 1 {
                        offset[axis]
                    } else {
                        -offset[axis]
                    }
                };
                *wish = towards(0) + towards(1) + towards(2);
            }
        }
        let mut slots = [0; 8];
        let (mut placed, mut taken) = ([false; 8], [false; 8]);
        for _ in children {
            let mut best = (f32::NEG_INFINITY, 0, 0);
            for (place, wishes) in wishes[..children.len()].iter().enumerate() {
                for (slot, &wish) in wishes.iter().enumerate() {
                    // NaN cannot win; if all preferences are lost to overflow, the first free slot
                    // is taken.
                    let better = wish > best.0 || best.0 == f32::NEG_INFINITY;
                    if !placed[place] && !taken[slot] && better {
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
        self.tree.nodes()[node as usize].is_leaf() || self.plans[node as usize].of(1) == 0
    }

    fn leaf(&mut self, node: u32) -> Child {
        let BinaryNode { first, count, .. } = self.tree.nodes()[node as usize];
        let range = first as usize..(first + count) as usize;
        let members = &self.tree.order()[range];
        let triangles = self.primitives.triangles;
        if let Some(sphere) = (members[0] as usize).checked_sub(triangles.len()) {
            return match sphere.checked_sub(self.primitives.spheres.len()) {
                None => Child::new(ChildKind::Sphere, sphere),
                Some(instance) => Child::new(ChildKind::Instance, instance),
            };
        }
        // In the order of their indices: at equal distances the first is taken.
        let mut sorted = [u32::MAX; LEAF_TRIANGLES];
        sorted[..members.len()].copy_from_slice(members);
        sorted.sort_unstable();
        let members = &sorted[..members.len()];
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
                let BinaryNode { min, max, .. } = self.tree.nodes()[child as usize];
                let reference = if self.is_leaf(child) {
                    self.leaf(child)
                } else {
                    self.nodes.push(Node::empty());
                    stack.push((child, self.nodes.len() - 1, depth + 1));
                    Child::new(ChildKind::Node, self.nodes.len() - 1)
                };
                self.nodes[index].set(slot, min, max, reference);
            }
        }
    }
}

fn collapse<'a>(tree: &'a Bvh, plans: &'a [Shares], primitives: &'a Primitives) -> Emitter<'a> {
    let mut emitter = Emitter {
        tree,
        plans,
        primitives,
        // About as many as there will be: unused memory is never touched.
        nodes: Vec::with_capacity(tree.len() / 8 + 1),
        blocks: Vec::with_capacity(tree.len() / 3 + 1),
        depth: 0,
    };
    emitter.emit();
    emitter
}

/// Collapses `tree`, which was built over `shapes` (triangles, spheres, then instances, at least
/// one).
pub fn build<P: Primitive>(tree: Bvh, shapes: &[P], primitives: Primitives) -> WideBvh {
    let first_sphere = primitives.triangles.len() as u32;
    let reach = doubtful_reach(tree.nodes()[0].min, tree.nodes()[0].max);
    let plans = plan(&tree, &primitives);
    let mut emitted = collapse(&tree, &plans, &primitives);
    // Input on which the heuristic's tree degenerates (a million equal triangles, say) would be too
    // deep to traverse.
    let (balanced, plans);
    if emitted.depth > MAX_DEPTH {
        balanced = Bvh::balanced(shapes).unwrap_or_default();
        plans = plan(&balanced, &primitives);
        emitted = collapse(&balanced, &plans, &primitives);
    }
    let (nodes, blocks) = (emitted.nodes, emitted.blocks);
    WideBvh::from_parts(
        nodes,
        blocks,
        primitives.spheres.to_vec(),
        first_sphere,
        primitives.instances,
        reach,
    )
}
