//! Resampled importance sampling within one domain.
//!
//! `M` candidates `X_i` with contribution weights `W_i` become `N` samples `Y` whose density nears
//! the target `p̂`:
//!
//! > `w_i = m_i(X_i) p̂(X_i) W_i`, `Pr[s = i] = w_i / Σ_j w_j`, `W_Y = Σ_j w_j / p̂(Y)` (Lin
//! > 2022 eqs. 6.1–6.6).
//!
//! * [`Ris`] and [`RisMany`]: candidates of one technique, `m_i = 1/M`; the division by `M` happens
//!   once, at the end.
//! * [`MixtureRis`]: candidates of several techniques; each brings its `m_i`, and nothing is
//!   divided at the end.
//!
//! **Stages.** A candidate's weight may be that of an earlier stage, so targets of rising cost see
//! ever fewer samples (Wyman's talk: `∫ f_r G L V ≈ 1/N Σ V · 1/M Σ f_r · 1/K Σ G L / q`):
//! resample many by `G L`, the survivors by `f_r G L`, and trace visibility for the last.
//!
//! ```
//! use lightshed_resampling::{Counting, Reservoir, Ris, Tractable};
//! use lightshed_sampling::CounterRng;
//! # fn cheap(x: u32) -> f64 { f64::from(x % 7) }
//! # fn dear(x: u32) -> f64 { f64::from(x % 7) * f64::from(x % 3) }
//! let mut rng = CounterRng::new(1, 2, 3);
//! let uniform = Tractable::<Counting>::from_density(1.0 / 64.0)?.weight();
//! let mut second = Ris::<u32, Counting>::new();
//! for _ in 0..4 {
//!     let mut first = Ris::<u32, Counting>::new();
//!     for _ in 0..16 {
//!         let x = rng.next_u32() % 64;
//!         first.candidate(x, cheap(x), uniform, &mut rng);
//!     }
//!     let survivor: Reservoir<u32, Counting> = first.finish(1.0);
//!     second.reservoir(&survivor, |&x| dear(x), &mut rng);
//! }
//! let sample: Reservoir<u32, Counting> = second.finish(1.0);
//! # let _ = sample;
//! # Ok::<(), lightshed_resampling::WeightError>(())
//! ```

mod mixture;
mod single;

pub use mixture::{MixtureRis, balance_over_techniques};
pub use single::{Ris, RisMany};
