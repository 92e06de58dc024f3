//! Stochastic multiple importance sampling over chains that learn from their own samples.
//!
//! A technique `p(x|t)` depends on parameters `t` that are themselves random, with an unknown
//! distribution: the state of a Markov chain, say. With `n` techniques `t_1 … t_n` and one sample
//! `x_i ∼ p(·|t_i)` of each,
//!
//! > `⟨I⟩ = Σ_i f(x_i) / Σ_j p(x_i|t_j)`
//!
//! is an unbiased estimate of `I = ∫ f dx` for any distribution of the techniques (West,
//! Georgiev, Gruson and Hachisuka 2020 eq. 12; Dittebrandt 2025 eq. 6.2), and so is
//! `n f(x)/Σ_j p(x|t_j)` for one sample of one of them, chosen with equal probabilities (eq. 6.3).
//! Both hold where the techniques *together* cover `f`, and where `x_i` depends on no technique but
//! its own (appendix A). A chain that moves by the sample that it draws breaks the last condition:
//! its next technique depends on the sample before.
//!
//! So chains trade places. A tile is a set of places (pixels), each with a chain's state. After
//! each step, [`temporal_smis`] moves all states on by one place, around the tile: in a set of no
//! more steps than places, no place gets back what its own samples have touched. [`spatial_smis`]
//! makes a set of all states of the tile in one step, and gives each place one that is drawn
//! uniformly, by a random permutation. Then `E[⟨I⟩ | everything before the set] = I`, exactly.
//! [`Exchange::Kept`] leaves the exchange out; it is **biased**, and here to show that.
//!
//! Further techniques, such as emitter sampling, are merged by the balance heuristic over all
//! techniques of the set. With `m` samples of density `q` besides the set, each sample, from any
//! technique, counts `f(x) / (Σ_j p(x|t_j) + m q(x))` ([`ChainTile::other_density`]).

mod scratch;
mod spatial;
mod temporal;
mod tile;

pub use scratch::TileScratch;
pub use spatial::{permute, spatial_smis};
pub use temporal::temporal_smis;
pub use tile::{ChainTile, Exchange, SetWeight};
