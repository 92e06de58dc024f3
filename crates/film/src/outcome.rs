//! Progress of a rendering, and its result.

use crate::{Film, RayCounts};

/// How far a rendering is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples taken so far, over all pixels.
    pub samples_done: u64,
    /// Samples to take in all; `None` if the budget is a time.
    pub samples_total: Option<u64>,
    /// Wall time since the start, seconds.
    pub seconds: f64,
}

/// What a rendering gave.
#[derive(Clone, Debug)]
pub struct RenderOutcome {
    /// Statistics of every pixel; each has had [`samples_per_pixel`](Self::samples_per_pixel)
    /// samples.
    pub film: Film,
    /// Samples in every pixel; fewer than requested if interrupted, even zero.
    pub samples_per_pixel: u32,
    /// Wall time, seconds.
    pub seconds: f64,
    /// Processor time of the process during the rendering, seconds, if the platform reports it.
    pub cpu_seconds: Option<f64>,
    /// Whether `cancel` ended it before the budget was spent.
    pub interrupted: bool,
    /// Rays traced, if the method counts them.
    pub rays: Option<RayCounts>,
}
