//! Light at the points that the camera sees, by Markov chain mixtures: guiding without a list of
//! lights.

mod incident;
mod method;
mod options;
mod tile;

pub use method::Mixture;
pub use options::{
    MAX_MIXTURE_STEPS, MixtureError, MixtureOptions, MixtureSets, STATES, TILE_SIZES, UnknownSets,
};
