//! Spatiotemporal reuse over a grid of domains (Lin 2022 §6.5.3).
//!
//! A frame: fresh candidates for each domain; [`Reuse::temporal`] merges them with the previous frame's
//! reservoirs; one or more rounds of [`Reuse::spatial`] (or [`Reuse::paired`], at one shift a pixel) merge
//! neighbours. Every pass reads one buffer and writes another, so its result depends neither on order nor on
//! the number of threads (feature `parallel`).
//!
//! What is biased is named so: [`Mis::ConstantBiased`](crate::Mis::ConstantBiased) and
//! [`TemporalDomains::BiasedCurrent`]. The confidence cap is no bias of a frame; without one, the average
//! over frames converges to a wrong result all the same (Lin 2022 fig. 6.2), because old samples are hardly
//! ever replaced.

mod pass;
mod pattern;

pub use pass::{Reuse, ReuseError, TemporalDomains};
pub use pattern::{Extent, PairedPattern, Pattern, PatternError};
