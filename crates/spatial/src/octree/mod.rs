//! An octree whose leaves follow the samples that fall into them (Dittebrandt 2025 §5.6).

mod adapt;
mod augmented;
mod error;
mod neighbours;
mod node;
mod options;
mod tree;

pub use augmented::Correspondence;
pub use error::OctreeError;
pub use neighbours::OctreeNeighbours;
pub use node::{MAX_OCTREE_DEPTH, MAX_OCTREE_NODES, OctreeNode};
pub use options::OctreeOptions;
pub use tree::{AdaptiveOctree, OctreeCell};
