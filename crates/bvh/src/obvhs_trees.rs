//! Trees of the crate `obvhs`.

use crate::node::Node;
use crate::tree::Bvh;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;

/// Cost of a node beside that of a primitive, for joining leaves; that of obvhs' own presets.
const NODE_COST: f32 = 3.0;

impl Bvh {
    /// As a binary tree of `obvhs`, with up to `leaf_primitives` primitives in a leaf (1 to 255).
    pub fn to_obvhs_bvh2(&self, leaf_primitives: u32) -> Bvh2 {
        let aabb = |node: &Node| Aabb::new(Vec3A::from(node.min), Vec3A::from(node.max));
        let mut bvh = Bvh2 {
            nodes: vec![Bvh2Node::default(); self.nodes().len()],
            primitive_indices: self.order().to_vec(),
            children_are_ordered_after_parents: true,
            ..Bvh2::default()
        };
        bvh.max_depth = bvh.max_depth.max(self.depth() + 1);
        // Both children of a node lie together there.
        let mut next = 1;
        let mut waiting = Vec::new();
        if !self.is_empty() {
            waiting.push((0, 0));
        }
        while let Some((index, place)) = waiting.pop() {
            let node = &self.nodes()[index];
            let (count, first) = match self.children(index) {
                Some([low, high]) => {
                    waiting.extend([(high, next + 1), (low, next)]);
                    next += 2;
                    (0, next - 2)
                }
                None => (1, node.first as usize),
            };
            bvh.nodes[place] = Bvh2Node::new(aabb(node), count, first as u32);
        }
        collapse(&mut bvh, leaf_primitives.clamp(1, 255), NODE_COST);
        bvh
    }

    /// As a compressed eight-wide tree of `obvhs`, with up to `leaf_primitives` primitives in a
    /// leaf (1 to 3).
    pub fn to_obvhs_cwbvh(&self, leaf_primitives: u32) -> CwBvh {
        bvh2_to_cwbvh(&self.to_obvhs_bvh2(1), leaf_primitives.clamp(1, 3), true, false)
    }
}
