//! Light at what the camera sees, by Markov chain mixtures: guiding that needs no list of lights.

mod incident;
mod method;
mod options;
mod tile;

pub use method::Mixture;
pub use options::{MAX_MIXTURE_STEPS, MixtureError, MixtureOptions, MixtureSets, TILE_SIZES, UnknownSets};
