//! Random numbers, measures and densities, warps and discrete distributions for light transport.
#![forbid(unsafe_code)]

mod frame;
mod measure;

pub use frame::Frame;
pub use glam;
pub use measure::{Area, Density, Measure, PrimarySample, SolidAngle, balance_heuristic, power_heuristic};
