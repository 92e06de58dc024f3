//! Many small lights in a region, each as a lobe towards a place.
//!
//! A region keeps up to some dozens of *places* from which light came. A place is seen from each
//! position as a von Mises–Fisher lobe, as wide as the light around the place appears from there.
//! So a region may be large, and know lights that appear a hundredth of a degree wide from most of
//! it. What one region finds, all others try: each light has to be found by chance only once.

mod block;
mod directions;
mod exchange;
mod model;
mod options;
mod place;

pub use block::PlaceBlock;
pub use directions::PlaceDirections;
pub use model::PlaceModel;
pub use options::{MAX_PLACES, PlaceOptions};
