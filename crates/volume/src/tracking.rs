//! Free flight and transmittance by null collisions.
//!
//! With extinction `σ(t) = k ρ(x(t))` and majorant `σ̄(t) = k ρ̄(t)`:
//!
//! - *Delta tracking* (Woodcock et al. 1965) takes a tentative collision as real with probability `ρ/ρ̄`. Real collisions have the
//!   density `σ(t) T(t)` per unit of `t` (Lin 2022 eq. 5.15 with its slip put right), `T(t) = e^{−∫σ}`: not known in closed
//!   form. The path with all its null collisions has a known density.
//! - *Ratio tracking* (Novák et al. 2014) multiplies `1 − ρ/ρ̄` over all tentative collisions: an unbiased estimate of `T`, in [0, 1].

use crate::{DensityAccessor, FieldRay, Segment, TentativeCollisions};
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;

/// How far light came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Where on the ray it collided; `None` if it crossed all segments.
    pub distance: Option<f32>,
    /// Density lookups.
    pub lookups: u32,
}

/// An estimate of transmittance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransmittanceEstimate {
    /// The estimate.
    pub value: f32,
    /// Density lookups.
    pub lookups: u32,
}

/// Free flight by delta tracking: real collisions with density `σ(t) T(t)` per unit of `t`, which is not known in closed form.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. The expected number of lookups is `∫ k ρ̄ dt` up to the collision.
#[inline]
pub fn delta_tracking<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> Flight {
    let mut collisions = TentativeCollisions::new(segments, extinction);
    let mut lookups = 0;
    while let Some(collision) = collisions.next(rng) {
        lookups += 1;
        if f32_from_u32(rng.next_u32()) * collision.majorant < density.density(ray.at(collision.t)) {
            return Flight {
                distance: Some(collision.t),
                lookups,
            };
        }
    }
    Flight {
        distance: None,
        lookups,
    }
}

/// Transmittance by ratio tracking: unbiased, in [0, 1].
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
    let mut collisions = TentativeCollisions::new(segments, extinction);
    let mut value = 1.0;
    let mut lookups = 0;
    while let Some(collision) = collisions.next(rng) {
        lookups += 1;
        value *= (1.0 - density.density(ray.at(collision.t)) / collision.majorant).max(0.0);
        if value < f32::MIN_POSITIVE {
            value = 0.0;
            break;
        }
    }
    TransmittanceEstimate { value, lookups }
}

#[cfg(test)]
mod tests;
