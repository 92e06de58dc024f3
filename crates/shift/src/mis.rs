//! MIS weights between the two ways to find an emitter.

use lightshed_sampling::{Density, SolidAngle, power_heuristic};

/// MIS weight of having sampled an emitter.
#[inline(always)]
pub(crate) fn emitter_weight(
    emitter: Density<SolidAngle>,
    scattering: Density<SolidAngle>,
    is_delta: bool,
) -> f32 {
    if is_delta {
        1.0
    } else {
        power_heuristic(emitter, scattering)
    }
}

/// MIS weight of having met an emitter that emitter sampling finds with density `emitter` (0 if it
/// cannot).
#[inline(always)]
pub(crate) fn scattering_weight(scattering: Density<SolidAngle>, emitter: Density<SolidAngle>) -> f32 {
    if emitter.is_positive() {
        power_heuristic(scattering, emitter)
    } else {
        1.0
    }
}
