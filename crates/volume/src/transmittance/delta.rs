//! Transmittance by delta tracking.

use super::TransmittanceEstimate;
use crate::{DensityAccessor, FieldRay, Segment, delta_tracking};
use lightshed_sampling::rand::Rng;

/// Transmittance by delta tracking: 1 if a photon comes through, 0 if it collides. Unbiased;
/// variance `T (1 − T)`.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. Takes fewer lookups than
/// [`ratio_tracking`](crate::ratio_tracking) where the medium is dense, since it stops at the first
/// real collision.
#[inline]
pub fn delta_transmittance<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> TransmittanceEstimate {
    let flight = delta_tracking(density, ray, segments, extinction, rng);
    TransmittanceEstimate {
        value: if flight.distance.is_some() { 0.0 } else { 1.0 },
        lookups: flight.lookups,
    }
}
