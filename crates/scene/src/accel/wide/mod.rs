//! A tree with eight children a node and watertight tests of eight triangles at a time. Rays of a
//! batch that all go one way are traced side by side, others several in flight.

mod build;
mod instances;
mod node;
mod packet;
mod packet_traversal;
mod traverse;

#[cfg(test)]
mod packet_tests;

pub use build::build;
pub use instances::{Instances, Placed};
pub use traverse::FAR_WIDENING;

use super::block::TriangleBlock;
use super::sphere::Sphere;
use lightshed_lanes::use_huge_pages;
use node::Node;

/// What a tree is built over.
pub struct Primitives<'a> {
    /// Corners of each triangle.
    pub triangles: &'a [[glam::Vec3; 3]],
    /// Spheres; primitive `triangles.len() + i` is sphere `i`.
    pub spheres: &'a [Sphere],
    /// Instances; in the tree's order, shape `triangles.len() + spheres.len() + i` is instance `i`.
    pub instances: Instances,
}

/// The tree. Not empty.
#[derive(Clone, Debug)]
pub struct WideBvh {
    nodes: Vec<Node>,
    blocks: Vec<TriangleBlock>,
    spheres: Vec<Sphere>,
    /// Primitive index of the first sphere.
    first_sphere: u32,
    instances: Instances,
    /// Hits nearer than this along a coordinate are looked at again, see [`super::triangle`].
    reach: f32,
    lanes: lightshed_lanes::LaneChoice,
}

impl WideBvh {
    fn from_parts(
        nodes: Vec<Node>,
        blocks: Vec<TriangleBlock>,
        spheres: Vec<Sphere>,
        first_sphere: u32,
        instances: Instances,
        reach: f32,
    ) -> Self {
        use_huge_pages(&nodes);
        use_huge_pages(&blocks);
        Self {
            nodes,
            blocks,
            spheres,
            first_sphere,
            instances,
            reach,
            lanes: lightshed_lanes::LaneChoice::best(),
        }
    }

    /// Bytes of the tree and the triangles in it.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.blocks[..])
            + size_of_val(&self.spheres[..])
            + self.instances.bytes()
    }

    /// The same tree on the lanes of the specification.
    #[cfg(test)]
    pub fn on_array_lanes(mut self) -> Self {
        self.lanes = lightshed_lanes::LaneChoice::ARRAY;
        self
    }
}
