//! The next-flight estimator.

use super::TransmittanceEstimate;
use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_sampling::rand::Rng;

/// Transmittance by the next-flight estimator (Cramer 1978; Novák et al. 2018 §5.1.3): from the
/// beginning and from every tentative collision, the transmittance of the *majorant* up to the end,
///
/// `T̂ = Σ_j e^{−k ∫_{t_j}^{t₁} ρ̄} Π_{i ≤ j} (1 − ρ_i/ρ̄_i)`, `t_0` the
/// beginning.
///
/// Unbiased; not negative, but may exceed 1. It is good where the majorant's depth is small, since
/// its first term alone is exact for a medium that fills its majorant.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. The segments are walked once more,
/// without lookups, for their depth.
#[inline]
pub fn next_flight_transmittance<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment> + Clone,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> TransmittanceEstimate {
    let mut whole = 0.0f32;
    for segment in segments.clone() {
        whole += (segment.majorant * (segment.t1 - segment.t0)).max(0.0);
    }
    let mut collisions = TentativeCollisions::new(segments, extinction);
    let mut weight = 1.0f32;
    let mut value = if extinction > 0.0 {
        (-extinction * whole).exp()
    } else {
        1.0
    };
    let mut lookups = 0;
    while let Some(collision) = collisions.next(rng) {
        lookups += 1;
        weight *= (1.0 - density.density(ray.at(collision.t)) / collision.majorant).max(0.0);
        if weight < f32::MIN_POSITIVE {
            break;
        }
        let ahead = (whole - collisions.majorant_depth()).max(0.0);
        value += weight * (-extinction * ahead).exp();
    }
    TransmittanceEstimate { value, lookups }
}
