//! MIS weights of the two techniques that find an emitter.

use lightshed_sampling::{Density, SolidAngle, power_heuristic};

/// MIS weight of an emitter found by emitter sampling.
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

/// MIS weight of an emitter that a direction hit, if emitter sampling finds it with density
/// `emitter` (0 if it cannot).
#[inline(always)]
pub(crate) fn scattering_weight(scattering: Density<SolidAngle>, emitter: Density<SolidAngle>) -> f32 {
    if emitter.is_positive() {
        power_heuristic(scattering, emitter)
    } else {
        1.0
    }
}
