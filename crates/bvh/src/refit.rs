//! The same tree for primitives that have moved.

use crate::error::BuildError;
use crate::primitive::Primitive;
use crate::tree::Bvh;
use glam::Vec3;
use lightshed_sampling::parallel::for_each_chunk;

/// What a refit did to a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refit {
    /// Cost by the surface area heuristic before, with nodes and primitives at 1 each
    /// ([`Bvh::sah_cost`]).
    pub cost_before: f64,
    /// The same now.
    pub cost: f64,
}

impl Refit {
    /// How many times costlier rays have become. A tree that was built for these primitives would
    /// have about 1: where builds take as long as the rays of a frame, a new one is worth it from
    /// about 1.5 on.
    pub fn growth(&self) -> f64 {
        if self.cost_before > 0.0 {
            self.cost / self.cost_before
        } else {
            1.0
        }
    }
}

impl Bvh {
    /// Gives all nodes the boxes of `primitives`, which are as many as the tree was built over, in
    /// the same order.
    ///
    /// # Errors
    /// [`BuildError::Count`] and [`BuildError::Bounds`]; the tree is as it was then.
    pub fn refit<P: Primitive>(&mut self, primitives: &[P]) -> Result<Refit, BuildError> {
        if primitives.len() != self.len() {
            return Err(BuildError::Count {
                primitives: self.len(),
                boxes: primitives.len(),
            });
        }
        if let Some(index) = primitives.iter().position(|p| !p.bounds().is_valid()) {
            return Err(BuildError::Bounds(index as u32));
        }
        let cost_before = self.sah_cost(1.0, 1.0);
        self.fit(primitives);
        Ok(Refit {
            cost_before,
            cost: self.sah_cost(1.0, 1.0),
        })
    }

    /// Recomputes all boxes from the primitives, from the leaves up.
    pub(crate) fn fit<P: Primitive>(&mut self, primitives: &[P]) {
        let order = &self.order;
        for_each_chunk(&mut self.nodes, 1 << 14, |_, nodes| {
            for node in nodes.iter_mut().filter(|node| node.is_leaf()) {
                let bounds = primitives[order[node.first as usize] as usize].bounds();
                // Zeros become positive, as builds make them.
                (node.min, node.max) = (bounds.min + Vec3::ZERO, bounds.max + Vec3::ZERO);
            }
        });
        for index in (0..self.nodes.len()).rev() {
            if let Some([low, high]) = self.children(index) {
                let bounds = self.nodes[low].bounds().union(&self.nodes[high].bounds());
                (self.nodes[index].min, self.nodes[index].max) = (bounds.min, bounds.max);
            }
        }
    }
}
