//! Exact proofs: every outcome of every random decision is enumerated, and `E[f(Y) W] = ∫ f` is
//! demanded to 1e-12. No Monte Carlo, no false positives. The code enumerated is the code shipped,
//! with `f64` instead of `f32` storage.

mod conditional;
mod duplicates;
mod faults;
mod finite;
mod learning;
mod merging;
mod mutations;
mod reuse;
mod several;
mod stages;
mod stochastic_mis;
mod suffixes;
