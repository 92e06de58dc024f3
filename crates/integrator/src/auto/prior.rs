//! What is known of candidates beforehand.

use crate::registry::Method;

/// The family that is tried last, since its frames are dear.
pub(super) const RESAMPLING: &str = "restir-pt-offline";

/// Emitters from which on a tree is taken without a pilot.
pub(super) const MANY_EMITTERS: usize = 64;

/// What sharing paths among pixels is given in a close call: where it loses, it loses no more than
/// its frames cost beside paths, a factor of two or three; where it gains, it may gain eight.
const SHARING: f64 = 1.1;

/// What the error of a candidate in a pilot is multiplied with, of an image of so many frames: that
/// of frames that resample is in rare outliers, and one frame shows half of it.
pub(super) fn prior(method: &Method, frames: u32) -> f64 {
    match method.name() {
        RESAMPLING => 1.0 + 1.0 / f64::from(frames),
        "path-reuse" => 1.0 / SHARING,
        _ => 1.0,
    }
}
