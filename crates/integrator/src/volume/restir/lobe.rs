//! Media that scatter into a narrow lobe.

use lightshed_scene::Medium;
use lightshed_scene::volume::PhaseFunction;
use std::f32::consts::PI;

/// Whether a medium scatters into a lobe more than 5 times as bright as the mean. If so, directions
/// of the phase function find light that emitter samples seldom find.
pub(crate) fn has_lobe(medium: &Medium) -> bool {
    // Measured at asymmetries of 0 and 0.8: between them this is at about 0.45.
    medium.phase().phase(1.0).max(medium.phase().phase(-1.0)) * 4.0 * PI > 5.0
}
