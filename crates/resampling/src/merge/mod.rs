//! The GRIS merge: one estimator for all reuse.
//!
//! Inputs are pairs of a domain `Ω_i` and a reservoir `(X_i, W_i, c_i)` in it. With
//! `Y_i = T_i(X_i)` in the domain merged into,
//!
//! > `w_i = m_i(Y_i) p̂(Y_i) W_i |∂T_i/∂X_i|`, or 0 where `T_i` is undefined (Lin 2022 eq.
//! > 6.19), `Pr[s = i] = w_i / Σ_j w_j`, `Y = Y_s`, `W_Y = Σ_j w_j / p̂(Y)` (eq. 6.22).
//!
//! `E[f(Y) W_Y] = ∫ f` over `supp p̂` as soon as the inputs cover it, whatever their
//! correlation. Read with everything conditioned on `Z`, the same is conditional RIS (Kettunen 2023
//! eq. 13): a domain carries its prefix, and its space is [`Given`](crate::Given). [`integrate`] is
//! the sum form `Σ_i m_i f(Y_i) W_i
//! |∂T_i/∂X_i|` (Kettunen 2023 eq. 14, Lin 2022 eq. 6.47), which has no selection and so no colour noise.

mod gris;
mod input;
mod report;
mod several;
mod stream;

pub use gris::{Contribution, integrate, merge, merge_and_integrate};
pub use input::{DomainReservoir, Input, MergeError, Merged};
pub use report::{Evaluations, MergeReport, UndefinedShifts};
pub use several::merge_several;
pub use stream::{Carried, PairwiseStream};
