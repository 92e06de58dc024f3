//! The path shifts in scenes with every kind of vertex: round trips, determinants against finite differences, and the
//! domain's integral against the path tracer.

mod determinants;
mod integrals;
mod round_trips;
mod zoo;
