//! `auto`: which method renders a scene with the least error, found by a look at the scene and a
//! short pilot.
//!
//! Of candidates `k` it takes the one with the least `C_k E_k`, where `C_k` is what a frame costs
//! and `E_k` the mean squared error of a frame: at equal cost independent frames of method `k` have
//! the error `C_k E_k / C`. `E_k` is half the mean squared difference of two independent images,
//! which is the squared error of an unbiased method whatever the image is; a bound of it, which
//! takes unseen outliers into account ([`TailBound`]), stands in its place. `C_k` is counted in
//! rays (`cost.rs`), so that the choice is a function of the scene and of what is asked, the same
//! for any number of threads, on any machine, and for each of an image's shards.

mod candidates;
mod choice;
mod cost;
mod frames;
mod pilot;
mod plan;
mod request;
mod tail;
#[cfg(test)]
mod tests;

pub use candidates::LeftOut;
pub use choice::{Choice, PilotRun, Trial};
pub use frames::AutoFrames;
pub use plan::AutoTask;
pub use request::{Auto, MethodRequest};
pub use tail::TailBound;
