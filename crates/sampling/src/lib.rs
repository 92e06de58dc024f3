//! Random numbers, measures and densities, warps and discrete distributions for light transport.
#![forbid(unsafe_code)]

mod frame;
mod measure;
mod rng;
mod uniform;

pub use frame::Frame;
pub use glam;
pub use measure::{Area, Density, Measure, PrimarySample, SolidAngle, balance_heuristic, power_heuristic};
pub use rng::{CounterRng, PathSeed, threefry4x32};
pub use uniform::{ONE_MINUS_EPSILON, f32_from_u32, f64_from_u64};
