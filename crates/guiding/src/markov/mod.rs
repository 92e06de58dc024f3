//! Markov chain mixture models: one lobe for each of many chains, which together form a mixture
//! (Dittebrandt 2025 ch. 6).
//!
//! A chain's state is the statistics of one lobe, not in directions but in *places*: the places
//! from which light came. So a state has a meaning at every point, and chains can pass their states
//! to each other. A step of a chain:
//!
//! 1. it may take the state of another chain, in proportion to scores ([`Discovery`], Algorithm 2);
//! 2. a direction is sampled by the state's lobe as seen from the point or, with a probability that
//!    is never zero, by the BSDF or phase function ([`MarkovState::lobe`], Algorithm 3);
//! 3. the state learns from what the direction hit, and may become the kept state
//!    ([`MarkovChain::advance`], Algorithm 4).
//!
//! The distribution of the states is unknown and not needed: stochastic MIS
//! (`lightshed-resampling`) estimates without it. So any transitions are valid; these are designed
//! to follow changes fast.

mod apparent;
mod chain;
mod discovery;
mod lobe;
mod model;
mod options;
mod state;

pub use apparent::ApparentDistance;
pub use chain::{Finding, MarkovChain, Proposal};
pub use discovery::{Discovery, OFFSET_WORDS, neighbour_offset};
pub use lobe::{SeenLobe, TargetLobe};
pub use model::MarkovModel;
pub use options::MarkovOptions;
pub use state::MarkovState;
