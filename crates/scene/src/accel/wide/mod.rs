//! A tree with eight or sixteen children a node, by how many boxes the machine tests at once, and
//! watertight tests of eight triangles at a time. Rays of a batch that all go one way are traced
//! side by side, others several in flight.

mod build;
mod constants;
mod in_flight;
mod instances;
mod node;
mod packet;
mod packet_traversal;
mod query;
mod rays;
mod row;
mod slack;
mod traverse;

#[cfg(test)]
mod build_tests;
#[cfg(test)]
mod packet_tests;

pub use build::build;
#[cfg(test)]
pub use build::build_for;
pub use constants::FAR_WIDENING;
pub use instances::{Instances, Placed};

use super::block::TriangleBlock;
use super::sphere::Sphere;
use lightshed_lanes::{AnyLanes, Lanes};
use node::Node;
use row::{Eight, Row, Sixteen};

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
    nodes: Nodes,
    blocks: Vec<TriangleBlock>,
    spheres: Vec<Sphere>,
    /// Primitive index of the first sphere.
    first_sphere: u32,
    instances: Instances,
    /// Hits nearer than this along a coordinate are looked at again, see [`super::triangle`].
    reach: f32,
    /// Errors of coordinates, see [`slack`].
    uncertainty: f32,
    lanes: lightshed_lanes::LaneChoice,
}

/// The nodes of a tree.
#[derive(Clone, Debug)]
enum Nodes {
    Eight(Vec<Node<Eight>>),
    /// Only on lanes of which sixteen are read at once.
    Sixteen(Vec<Node<Sixteen>>),
}

/// What is done with the nodes of either kind.
trait Walk {
    type Output;
    /// `M` are as many lanes as a row of `R` is long.
    fn walk<L: Lanes, M: AnyLanes, R: Row>(self, nodes: &[Node<R>]) -> Self::Output;
}

impl Nodes {
    /// Does it with these.
    #[inline(always)]
    fn walk<L: Lanes, W: Walk>(&self, walk: W) -> W::Output {
        match self.sixteen() {
            // Known when this is compiled: no code is made for lanes that are not sixteen.
            Some(nodes) if L::Long::COUNT == Sixteen::COUNT => walk.walk::<L, L::Long, _>(nodes),
            _ => walk.walk::<L, L, _>(self.eight()),
        }
    }

    #[inline(always)]
    fn sixteen(&self) -> Option<&[Node<Sixteen>]> {
        match self {
            Self::Sixteen(nodes) => Some(nodes),
            Self::Eight(_) => None,
        }
    }

    /// Nodes of eight children; none if there are those of sixteen.
    #[inline(always)]
    fn eight(&self) -> &[Node<Eight>] {
        match self {
            Self::Eight(nodes) => nodes,
            Self::Sixteen(_) => &[],
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Eight(nodes) => size_of_val(&nodes[..]),
            Self::Sixteen(nodes) => size_of_val(&nodes[..]),
        }
    }
}

impl WideBvh {
    /// Bytes of the tree and the triangles in it.
    pub fn bytes(&self) -> usize {
        self.nodes.bytes()
            + size_of_val(&self.blocks[..])
            + size_of_val(&self.spheres[..])
            + self.instances.bytes()
    }
}
