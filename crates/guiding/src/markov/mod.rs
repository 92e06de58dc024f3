//! Markov chain mixture models: one lobe for each of many chains, which together are a mixture
//! (Dittebrandt 2025 ch. 6).
//!
//! A chain's state is the statistics of one lobe, not in directions but in *places*: where what it
//! found lies. So a state means something at every point, and chains can hand their states to each
//! other. A step of a chain:
//!
//! 1. it may take over the state of another, in proportion to scores ([`Discovery`], Algorithm 2);
//! 2. a direction is sampled by the state's lobe as it is seen from the point, or, with a
//!    probability that is never zero, by what scatters there ([`MarkovState::lobe`], Algorithm 3);
//! 3. the state learns from what the direction met, and may become the one that is kept
//!    ([`MarkovChain::advance`], Algorithm 4).
//!
//! Nobody knows how the states are distributed, and nobody has to: stochastic MIS
//! (`lightshed-resampling`) estimates without it. Transitions may therefore be anything that works;
//! these are made to follow changes fast.

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
