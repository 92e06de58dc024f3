//! Directional quadtrees of a few bits (§5.5).

mod bits;
mod counts;
mod learn;
mod migrate;
mod model;
mod options;
mod parallax;
mod product;
mod sample;
mod variance;
mod view;

pub use bits::{MAX_QUADTREE_BITS, MAX_QUADTREE_DEPTH};
pub use model::QuadtreeModel;
pub use options::{QuadtreeGoal, QuadtreeOptions};
pub use parallax::SeenQuadtree;
pub use product::{MAX_PRODUCT_BITS, QuadtreeProduct};
pub use view::{CompressedQuadtree, QuadtreeCell};
