//! Collapses a binary tree into one with eight or sixteen children a node, at the least expected
//! cost.
//!
//! The surface area heuristic's cost of a subtree `n` if it becomes at most `i` children of some
//! node, of which a node has `w`:
//!
//! ```text
//! C(n, 1) = min( A(n) · c_leaf            if n has at most 8 triangles,
//!                A(n) · c_node + D(n, w) )
//! C(n, i) = min( D(n, i), C(n, i−1) )
//! D(n, j) = min over 0 < k < j of C(left, k) + C(right, j−k)
//! ```
//!
//! with `A` the surface area of the box: the dynamic programme of Ylitie, Karras and Laine 2017,
//! *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, §3.1, with this
//! tree's own leaf costs.

use super::node::{Child, ChildKind, Node};
use super::row::{Eight, Row, Sixteen};
use super::slack::uncertainty;
use super::{Nodes, Primitives, WideBvh};
use crate::accel::block::TriangleBlock;
use crate::accel::stack::STACK_CAPACITY;
use crate::accel::triangle::doubtful_reach;
use glam::Vec3;
use lightshed_bvh::{Bvh, Node as BinaryNode, Primitive};
use lightshed_lanes::{AnyLanes, LaneChoice, LaneKernel, Lanes, use_huge_pages};

/// Cost of testing the boxes of a node, and of testing a block of eight triangles or a sphere; only
/// their ratio counts.
const COST_NODE: f32 = 1.0;
const COST_LEAF: f32 = 1.2;

/// Triangles in a block.
const LEAF_TRIANGLES: usize = 8;

/// Deepest tree that the traversal's stack can hold: each level leaves all siblings but one behind.
const fn max_depth<R: Row>() -> usize {
    (STACK_CAPACITY - 1) / (R::COUNT - 1)
}

/// Most children that a subtree of a node can become.
const MOST: usize = Sixteen::COUNT - 1;

/// Costs of a subtree that is to become at most `i + 1` children, `i` the index.
type Costs = [f32; MOST];

/// How a subtree is best turned into at most `i` children: four bits for each number, which tell
/// how many of them are given to the left subtree. 0 where one child fewer is as good; for `i = 1`,
/// 0 for a leaf, else the left's share of a node's children.
#[derive(Clone, Copy, Default)]
struct Shares(u64);

impl Shares {
    #[inline(always)]
    fn of(self, children: usize) -> usize {
        (self.0 >> (4 * children) & 15) as usize
    }

    #[inline(always)]
    fn set(&mut self, children: usize, share: u64) {
        self.0 |= share << (4 * children);
    }
}

fn plan<R: Row>(tree: &Bvh, primitives: &Primitives) -> Vec<Shares> {
    let most = R::COUNT - 1;
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
            finished.push([leaf; MOST]);
            continue;
        }
        let (Some(left), Some(right)) = (finished.pop(), finished.pop()) else {
            break;
        };
        // Cost and left share of the best split of `children` between the two subtrees.
        let split = |children: usize| {
            let mut best = (f32::INFINITY, 1);
            for share in children.saturating_sub(most).max(1)..=(children - 1).min(most) {
                let cost = left[share - 1] + right[children - share - 1];
                if cost < best.0 {
                    best = (cost, share as u64);
                }
            }
            best
        };
        let (mut costs, mut shares) = (Costs::default(), Shares::default());
        // More children than primitives are no use.
        let count = node.count as usize;
        let (inner, share) = split(R::COUNT.min(count));
        let inner = inner + area * COST_NODE;
        // Areas of boxes beyond 10¹⁹ overflow, so that costs tell nothing.
        let becomes_leaf = can_be_leaf && leaf <= inner;
        costs[0] = if becomes_leaf { leaf } else { inner };
        shares.set(1, if becomes_leaf { 0 } else { share });
        let useful = most.min(count);
        for children in 2..=useful {
            let (cost, share) = split(children);
            let fewer = costs[children - 2];
            costs[children - 1] = if fewer <= cost { fewer } else { cost };
            shares.set(children, if fewer <= cost { 0 } else { share });
        }
        let least = costs[useful - 1];
        costs[useful..].fill(least);
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
struct Emitter<'a, R> {
    tree: &'a Bvh,
    plans: &'a [Shares],
    primitives: &'a Primitives<'a>,
    nodes: Vec<Node<R>>,
    blocks: Vec<TriangleBlock>,
    depth: usize,
}

impl<R: Row> Emitter<'_, R> {
    /// The subtrees that become the children of the wide node for `root`.
    fn children_of(&self, root: u32) -> ([u32; Sixteen::COUNT], usize) {
        let (mut children, mut count) = ([0; Sixteen::COUNT], 0);
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
        let mut stack = vec![(right as u32, R::COUNT - share), (left as u32, share)];
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
    /// preference for an octant takes its place first. An octant has as many places as fit.
    fn slots(&self, root: u32, children: &[u32]) -> [usize; Sixteen::COUNT] {
        let center = |node: u32| self.tree.nodes()[node as usize].bounds().center();
        let middle = center(root);
        let mut offsets = [Vec3::ZERO; Sixteen::COUNT];
        for (offset, &child) in offsets.iter_mut().zip(children) {
            *offset = center(child) - middle;
        }
        // The preference of each child for each octant.
        let mut wishes = [[0.0f32; 8]; Sixteen::COUNT];
        for (wishes, offset) in wishes.iter_mut().zip(&offsets) {
            for (octant, wish) in wishes.iter_mut().enumerate() {
                let towards = |axis: usize| {
                    if octant >> axis & 1 == 1 {
                        offset[axis]
                    } else {
                        -offset[axis]
                    }
                };
                *wish = towards(0) + towards(1) + towards(2);
            }
        }
        let mut slots = [0; Sixteen::COUNT];
        let (mut placed, mut taken) = ([false; Sixteen::COUNT], [[None; 2]; 8]);
        for _ in children {
            let mut best = (f32::NEG_INFINITY, 0, 0);
            for (place, wishes) in wishes[..children.len()].iter().enumerate() {
                for (octant, &wish) in wishes.iter().enumerate() {
                    // NaN cannot win; if all preferences are lost to overflow, the first free place
                    // is taken.
                    let better = wish > best.0 || best.0 == f32::NEG_INFINITY;
                    if !placed[place] && taken[octant][R::ROOM - 1].is_none() && better {
                        best = (wish, place, octant);
                    }
                }
            }
            let (_, place, octant) = best;
            placed[place] = true;
            slots[place] = octant * R::ROOM;
            match taken[octant][0] {
                None => taken[octant][0] = Some(place),
                // The farther one along (1, 1, 1) comes last.
                Some(other) => {
                    taken[octant][1] = Some(place);
                    let farther = offsets[place].element_sum() > offsets[other].element_sum();
                    slots[if farther { place } else { other }] += 1;
                }
            }
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

/// How many lanes are read at once at most.
struct Longest;

impl LaneKernel for Longest {
    const HOT: bool = true;
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        L::Long::COUNT
    }
}

/// Nodes and leaves of a collapsed tree of at most `deepest` levels.
fn collapsed<R: Row>(
    tree: &Bvh,
    primitives: &Primitives,
    deepest: usize,
) -> Option<(Vec<Node<R>>, Vec<TriangleBlock>)> {
    let mut emitter = Emitter {
        tree,
        plans: &plan::<R>(tree, primitives),
        primitives,
        // About as many as there will be: unused memory is never touched.
        nodes: Vec::with_capacity(tree.len() / 8 + 1),
        blocks: Vec::with_capacity(tree.len() / 3 + 1),
        depth: 0,
    };
    emitter.emit();
    let Emitter {
        nodes, blocks, depth, ..
    } = emitter;
    (depth <= deepest).then(|| {
        use_huge_pages(&nodes);
        use_huge_pages(&blocks);
        (nodes, blocks)
    })
}

/// Levels that trees of sixteen and of eight children may have.
const DEEPEST: [usize; 2] = [max_depth::<Sixteen>(), max_depth::<Eight>()];

/// Nodes of as many children as `lanes` test at once, and leaves. A tree that is too deep with
/// sixteen children has eight, and one that is too deep with eight is balanced.
pub(super) fn nodes_for<P: Primitive>(
    lanes: LaneChoice,
    tree: &Bvh,
    shapes: &[P],
    primitives: &Primitives,
    deepest: [usize; 2],
) -> (Nodes, Vec<TriangleBlock>) {
    if lanes.run(Longest) == Sixteen::COUNT
        && let Some((nodes, blocks)) = collapsed(tree, primitives, deepest[0])
    {
        return (Nodes::Sixteen(nodes), blocks);
    }
    let (nodes, blocks) = collapsed(tree, primitives, deepest[1]).unwrap_or_else(|| {
        // Input on which the heuristic's tree degenerates (a million equal triangles, say). A
        // balanced one is never too deep.
        let balanced = Bvh::balanced(shapes).unwrap_or_default();
        collapsed(&balanced, primitives, usize::MAX).unwrap_or_default()
    });
    (Nodes::Eight(nodes), blocks)
}

/// Collapses `tree`, which was built over `shapes` (triangles, spheres, then instances, at least
/// one), for the lanes of this machine.
pub fn build<P: Primitive>(tree: Bvh, shapes: &[P], primitives: Primitives) -> WideBvh {
    build_for(LaneChoice::best(), tree, shapes, primitives)
}

/// [`build`] for given lanes.
pub fn build_for<P: Primitive>(
    lanes: LaneChoice,
    tree: Bvh,
    shapes: &[P],
    primitives: Primitives,
) -> WideBvh {
    let BinaryNode { min, max, .. } = tree.nodes()[0];
    let (nodes, blocks) = nodes_for(lanes, &tree, shapes, &primitives, DEEPEST);
    WideBvh {
        nodes,
        blocks,
        spheres: primitives.spheres.to_vec(),
        first_sphere: primitives.triangles.len() as u32,
        instances: primitives.instances,
        reach: doubtful_reach(min, max),
        uncertainty: uncertainty(min, max),
        lanes,
    }
}
