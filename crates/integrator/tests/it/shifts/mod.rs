//! Scenes with every kind of vertex as worlds of path shifts: round trips, the domain's integral
//! against the path tracer, and what follows reconnection vertices. The shifts themselves are
//! tested where they stand, in `lightshed-shift`.

mod integrals;
mod round_trips;
mod suffixes;
mod zoo;

pub use zoo::zoo;
