//! The path shifts in scenes with every kind of vertex: round trips, determinants against finite differences, the
//! domain's integral against the path tracer, and what follows reconnection vertices.

mod determinants;
mod integrals;
mod round_trips;
mod suffixes;
mod zoo;
