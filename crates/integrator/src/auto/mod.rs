//! `auto`: which method renders a scene with the least error, found by a look at the scene and a
//! short pilot.
//!
//! Of candidates `k` it takes the one with the least `p_k C_k E_k`, where `C_k` is what a frame
//! costs, `E_k` the mean squared error of a frame, and `p_k` what is known of `k` that a pilot is
//! too small to show (`prior.rs`): at equal cost independent frames of method `k` have the error
//! `C_k E_k / C`. `E_k` is half the mean squared difference of two independent images, which is the
//! squared error of an unbiased method whatever the image is, or rather its geometric mean with the
//! same relative to the brightness of the neighbourhood, which hangs less on single pixels; of
//! plain paths it is what frames that share paths say about them (`plain.rs`). Both are with the
//! short paths that an image would have (`short_gain.rs`). `C_k` is counted in rays (`cost.rs`), so
//! that the choice is a function of the scene and of what is asked, the same for any number of
//! threads, on any machine, and for each of an image's shards.
//! Pilots render blocks of the image and not a smaller one: in larger pixels, surfaces' edges would
//! hold more of the error, and neighbours would have less to share.

mod candidates;
mod chain;
mod choice;
mod choosing;
mod cost;
mod frames;
mod gains;
mod pilot;
mod plain;
mod plan;
mod prior;
mod race;
mod request;
mod short_gain;
mod short_looks;
#[cfg(test)]
mod tests;

pub use candidates::LeftOut;
pub use choice::{Choice, PilotRun, Trial};
pub use frames::AutoFrames;
pub use plan::AutoTask;
pub use request::{Auto, MethodRequest};
pub use short_gain::ShortGain;
