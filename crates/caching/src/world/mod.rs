//! Reservoirs in world space: cells of a hash grid that keep samples for whoever comes by
//! (*World-Space Clustered GRIS*, 2022; merges by GRIS, Lin 2022 ch. 6).
//!
//! ```text
//! visit(pixels) ──► update(fresh reservoirs) ──► links(pixels) ──► Reuse::linked
//!   cells, who brings     each cell merges          which of a cell's  a pixel's own and
//!   and who comes         what is brought           reservoirs it reads  some of its cell's
//! ```
//!
//! **A cell is a domain.** It keeps a *site*, a whole domain of one of its users (a pixel with its
//! surface, its view, what it sees), and `K` reservoirs that live in that domain. So a cell's
//! reservoirs are inputs like any others: shifted from the site to the pixel, weighed by what the
//! site's target could have produced. With a canonical sample of the pixel that is unbiased,
//! wherever cells end and whatever they mix; by themselves, without one, they miss what the site
//! cannot see, and the result is **biased**.
//!
//! **Nothing is chosen by what samples are.** Sites, who brings something to a cell, and which
//! reservoirs a pixel reads follow from places and random numbers alone. Confidences follow from
//! the numbers of those that came.
//!
//! **Cells hold different samples.** Samples that several of a cell's inputs hold are pooled, and
//! its reservoirs repeat one only where it outweighs the others
//! ([`merge_several`](lightshed_resampling::merge_several)).

mod links;
mod options;
mod report;
mod reservoirs;
mod visits;

pub use links::{MAX_READS, WorldLinks, WorldReads};
pub use options::{MAX_CELL_RESERVOIRS, WorldReservoirOptions};
pub use report::WorldReport;
pub use reservoirs::{WorldDomain, WorldReservoirs};
pub use visits::WorldVisits;
