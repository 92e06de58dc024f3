//! Global illumination by virtual point lights (Keller 1997; Lin 2022 ch. 3).

mod atrous;
mod brute;
mod camera;
mod gather;
mod grid;
mod trace;

pub use brute::VplBrute;
pub use grid::{MAX_FILTER_ITERATIONS, ShadowTargets, VplGrid, VplGridOptions};
pub use trace::{MAX_LIGHT_PATHS, MAX_VPL_BOUNCES, VplError, VplOptions, VplSet};
