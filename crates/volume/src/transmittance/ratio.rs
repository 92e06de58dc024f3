//! Ratio tracking.

use super::{Estimates, SpectralTransmittance, TransmittanceEstimate, rate_and_shares};
use crate::collisions::BLOCK;
use crate::{DensityAccessor, FieldRay, Segment, TentativeCollision, TentativeCollisions};
use lightshed_sampling::rand::Rng;

/// Transmittance by ratio tracking (Novák et al. 2014): `Π (1 − ρ/ρ̄)` over all tentative collisions. Unbiased, in [0, 1].
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. The expected number of lookups is `∫ k ρ̄ dt`, less where the estimate
/// reaches 0 before. Estimates below the least normal `f32` are 0.
#[inline]
pub fn ratio_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> TransmittanceEstimate {
    ratio(density, ray, segments, [extinction], rng).into()
}

/// Transmittance of all channels by ratio tracking at the rate of the greatest coefficient `k̂`: `Π (1 − k_c ρ / (k̂ ρ̄))`,
/// unbiased and in [0, 1] for each (spectral tracking, Kutz et al. 2017). The channels share their collisions: no weights between them
/// are needed.
///
/// `extinction` has the coefficients `k_c ≥ 0`, finite.
#[inline]
pub fn spectral_ratio_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: [f32; 3],
    rng: &mut (impl Rng + ?Sized),
) -> SpectralTransmittance {
    ratio(density, ray, segments, extinction, rng).into()
}

#[inline(always)]
fn ratio<const N: usize, A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: [f32; N],
    rng: &mut (impl Rng + ?Sized),
) -> Estimates<N> {
    let (rate, shares) = rate_and_shares(extinction);
    let mut collisions = TentativeCollisions::new(segments, rate);
    let mut value = [1.0f32; N];
    let mut lookups = 0;
    let mut block = [TentativeCollision::NONE; BLOCK];
    loop {
        let block = collisions.next_block(density, ray, rng, &mut block);
        for collision in block {
            lookups += 1;
            let ratio = density.density(ray.at(collision.t)) / collision.majorant;
            for (value, share) in value.iter_mut().zip(shares) {
                *value *= (1.0 - share * ratio).max(0.0);
            }
        }
        if value.iter().all(|&v| v < f32::MIN_POSITIVE) {
            value = [0.0; N];
            break;
        }
        if block.len() < BLOCK {
            break;
        }
    }
    Estimates { value, lookups }
}
