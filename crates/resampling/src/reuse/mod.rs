//! Spatiotemporal reuse among domains (Lin 2022 §6.5.3).
//!
//! A frame: fresh candidates for each domain; [`Reuse::temporal`] merges them with the previous
//! frame's reservoirs ([`Reuse::linked`] with those of any other domains, several at a time); one
//! or more rounds of [`Reuse::spatial`] (or [`Reuse::paired`], at one shift a domain) merge
//! neighbours. Domains stand in a row ([`Domains`]: pixels, cells, suffix spaces behind prefixes),
//! some of them absent; who neighbours whom is a [`Topology`]. Every pass reads one buffer and
//! writes another, so its result depends neither on order nor on the number of threads (feature
//! `parallel`).
//!
//! What is biased is named so: [`Mis::ConstantBiased`](crate::Mis::ConstantBiased), and a
//! [`History`] with domains of another frame than its reservoirs. The confidence cap is no bias of
//! a frame; without one, the average over frames converges to a wrong result all the same (Lin 2022
//! fig. 6.2), because old samples are hardly ever replaced.

mod domains;
mod each;
mod error;
mod linked;
mod pass;
mod pattern;
mod rule;
mod topology;

pub use domains::Domains;
pub use error::ReuseError;
pub use pass::{History, Reuse, Sums};
pub use pattern::{Extent, PairedPattern, Pattern, PatternError, PixelNeighbours, PixelPairs};
pub use rule::MergeRule;
pub use topology::{CellGrid, Filtered, NeighbourLists, Topology, TopologyError};
