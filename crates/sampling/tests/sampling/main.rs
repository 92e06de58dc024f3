//! Tests of the crate's public face: exact where the domain is finite, statistical with fixed seeds elsewhere.

mod alias;
mod choose;
mod frame;
mod measure;
mod piecewise;
mod rng;
