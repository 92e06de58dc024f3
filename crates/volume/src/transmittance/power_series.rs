//! Transmittance by a power series.
//!
//! With the residual depth `R = k ∫ (ρ̄ − ρ̌) dt` of a segment and `r` the share
//! `(ρ − ρ̌)/(ρ̄ − ρ̌)` at a uniform point of it,
//!
//! `T = e^{−k ∫ρ̌} · e^{−R} Σ_n R^n/n! · E[1 − r]^n`.
//!
//! Ratio tracking draws `n` from the Poisson distribution and takes one term. Summing the terms
//! instead removes the noise of `n`: the product over the first `n` points serves term `n`, and the
//! series ends by Russian roulette once 99 % of the Poisson mass is summed (the "p-series CMF" of
//! Georgiev et al. 2019).

use super::TransmittanceEstimate;
use crate::{DensityAccessor, FieldRay, Segment};
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;

/// The part of the Poisson mass that is always summed.
const CERTAIN_MASS: f64 = 0.99;
/// Segments of a greater residual depth are cut: `e^{−R}` must not underflow.
const MAX_RESIDUAL: f64 = 64.0;

/// Transmittance by summing a power series over each segment (see the source's head): unbiased, in
/// [0, 1] but for the rare estimates that survive roulette.
///
/// Points are uniform within a segment, so one segment for the whole ray
/// ([`MajorantGrid::whole_segment`](crate::MajorantGrid::whole_segment)) and one for each
/// super-voxel are different estimators: the first has fewer terms, the second tighter bounds.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. About `R + 2.3 √R + 1` lookups for a
/// segment of residual depth `R`.
pub fn power_series_transmittance<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    extinction: f32,
    rng: &mut (impl Rng + ?Sized),
) -> TransmittanceEstimate {
    let mut value = 1.0f64;
    let mut control_depth = 0.0f64;
    let mut lookups = 0;
    let extinction = f64::from(if extinction > 0.0 { extinction } else { 0.0 });
    for segment in segments {
        let length = f64::from(segment.t1) - f64::from(segment.t0);
        let spread = segment.majorant - segment.minorant;
        control_depth += (f64::from(segment.minorant) * length).max(0.0);
        let residual = extinction * f64::from(spread) * length;
        if !(residual > 0.0 && residual < f64::INFINITY) {
            continue;
        }
        let pieces = (residual / MAX_RESIDUAL).ceil().max(1.0);
        let mut piece = 0.0;
        while piece < pieces {
            value *= series(residual / pieces, rng, |rng| {
                lookups += 1;
                let along = (piece + f64::from(f32_from_u32(rng.next_u32()))) / pieces;
                let t = (f64::from(segment.t0) + along * length) as f32;
                let share = (density.density(ray.at(t)) - segment.minorant) / spread;
                1.0 - f64::from(share)
            });
            piece += 1.0;
            if value < f64::from(f32::MIN_POSITIVE) {
                return TransmittanceEstimate { value: 0.0, lookups };
            }
        }
    }
    TransmittanceEstimate {
        value: (value * (-extinction * control_depth).exp()) as f32,
        lookups,
    }
}

/// `e^{−R} Σ_n R^n/n! Π_{i ≤ n} f_i`, with independent `f_i` by `factor`.
#[inline(always)]
fn series<R: Rng + ?Sized>(residual: f64, rng: &mut R, mut factor: impl FnMut(&mut R) -> f64) -> f64 {
    let mut mass = (-residual).exp();
    let mut summed = mass;
    let mut sum = mass;
    let mut weight = 1.0;
    let mut n = 0.0;
    loop {
        n += 1.0;
        // Ratio of the next term's mass to this one's; below 1 in the tail, where it is the
        // probability to continue.
        let ratio = residual / n;
        if summed >= CERTAIN_MASS {
            let chance = ratio.min(1.0);
            if !(f64::from(f32_from_u32(rng.next_u32())) < chance) {
                return sum;
            }
            weight /= chance;
        }
        mass *= ratio;
        summed += mass;
        weight *= factor(rng);
        sum += mass * weight;
        if !(weight > 0.0) {
            return sum;
        }
    }
}
