//! Unbiased ray marching (Kettunen et al. 2021).
//!
//! A *query* `X` is an unbiased estimate of the optical depth `τ` by ray marching: `M` look-ups at
//! equal distances with one random offset. `e^{−X}` is too large on average. Around a pivot `P`,
//! another query, the power series
//!
//! `e^{−τ} = e^{−P} Σ_n (P − τ)^n / n!`
//!
//! corrects that: `(P − τ)^n` is the mean product of `n` of the differences `P − X_i`. The
//! number `N` of terms is random, most often 0. With `N + 1` queries, each in turn the pivot and
//! the others in elementary symmetric means `m_n`, and term `n` divided by `q_n = P(N ≥ n)`,
//!
//! `T̂ = 1/(N + 1) Σ_j e^{−X_j} Σ_{n ≤ N} m_n({X_j − X_i}_{i ≠ j}) / (n! q_n)`.
//!
//! The look-ups are at equal distances not in `t` but in the residual depth
//! `∫ (ρ̄ − ρ̌) dt` of the segments, with `∫ ρ̌ dt` as control variate: empty segments
//! take no look-ups, and `X` is bounded on both sides.

use super::TransmittanceEstimate;
use crate::{DensityAccessor, FieldRay, Segment, densities_at};
use lightshed_lanes::LANES;
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;

/// The probability of any correction, `q_1` and `q_2`.
const CORRECTED: f64 = 0.1;
/// `q_{n+1}/q_n = 2/(n + 1)` from here on (the roulette of Bhanot and Kennedy 1985).
const ROULETTE: f64 = 2.0;
/// Greatest number of queries: `q` of more is 10⁻¹⁵, and so is the bias of omitting them.
const MAX_QUERIES: usize = 26;

/// Number of look-ups of a query for a majorant depth `τ̄ = k ∫ ρ̄ dt`:
/// `⌈((0.015 + τ̄)(0.65 + τ̄)(60.3 + τ̄))^{1/3}⌉`, the rule of Kettunen et al. 2021; at
/// most 2¹⁶.
#[inline]
pub fn unbiased_ray_marching_lookups(majorant_depth: f32) -> u32 {
    let depth = majorant_depth.clamp(0.0, 65536.0);
    ((0.015 + depth) * (0.65 + depth) * (60.3 + depth))
        .cbrt()
        .ceil()
        .min(65536.0) as u32
}

/// Transmittance by unbiased ray marching (see the source's head), with `lookups` lookups a query
/// (at least 1; [`unbiased_ray_marching_lookups`] suggests a number).
///
/// Unbiased. Nine estimates in ten are one query, `e^{−X}`, in (0, 1]; the others may be negative
/// or exceed 1. Where a query's noise is well below 1 the variance is far below that of ratio
/// tracking; where a query misses the medium's structure, it is large.
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`. The segments are walked once for each
/// query.
pub fn unbiased_ray_marching<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment> + Clone,
    extinction: f32,
    lookups: u32,
    rng: &mut (impl Rng + ?Sized),
) -> TransmittanceEstimate {
    let (mut control, mut residual) = (0.0f64, 0.0f64);
    for segment in segments.clone() {
        let length = f64::from(segment.t1) - f64::from(segment.t0);
        control += (f64::from(segment.minorant) * length).max(0.0);
        residual += (f64::from(segment.majorant - segment.minorant) * length).max(0.0);
    }
    let k = f64::from(if extinction > 0.0 { extinction } else { 0.0 });
    if !(residual > 0.0) {
        return TransmittanceEstimate {
            value: (-k * control).exp() as f32,
            lookups: 0,
        };
    }
    let lookups = lookups.max(1);

    let mut corrections = 0;
    let mut u = f64::from(f32_from_u32(rng.next_u32()));
    if u < CORRECTED {
        corrections = 2;
        let mut chance = ROULETTE / 3.0;
        u = f64::from(f32_from_u32(rng.next_u32()));
        while u < chance && corrections + 1 < MAX_QUERIES {
            corrections += 1;
            chance = ROULETTE / (corrections + 1) as f64;
            u = f64::from(f32_from_u32(rng.next_u32()));
        }
    }

    let mut queries = [0.0f64; MAX_QUERIES];
    for query in &mut queries[..=corrections] {
        let offset = f64::from(f32_from_u32(rng.next_u32()));
        let share = residual_share(density, ray, segments.clone(), residual, lookups, offset);
        *query = k * (control + residual * share);
    }
    let queries = &queries[..=corrections];
    let mut sum = 0.0;
    for (j, &pivot) in queries.iter().enumerate() {
        sum += (-pivot).exp() * corrected(queries, j, chance_of);
    }
    TransmittanceEstimate {
        value: (sum / queries.len() as f64) as f32,
        lookups: lookups * queries.len() as u32,
    }
}

/// The mean of `(ρ − ρ̌)/(ρ̄ − ρ̌)` over points at equal distances in residual depth.
#[inline]
fn residual_share<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    segments: impl Iterator<Item = Segment>,
    residual: f64,
    lookups: u32,
    offset: f64,
) -> f64 {
    let spacing = residual / f64::from(lookups);
    let (mut before, mut done) = (0.0, 0);
    let mut next = offset * spacing;
    let mut sum = Sum {
        count: 0,
        t: [0.0; LANES],
        minorant: [0.0; LANES],
        spread: [1.0; LANES],
        total: 0.0,
    };
    for segment in segments {
        let length = f64::from(segment.t1) - f64::from(segment.t0);
        let spread = segment.majorant - segment.minorant;
        let within = (f64::from(spread) * length).max(0.0);
        // The last point may lie past the end by rounding.
        while next < before + within && done < lookups {
            let t = (f64::from(segment.t0) + (next - before) / f64::from(spread)) as f32;
            sum.add(density, ray, t.min(segment.t1), segment.minorant, spread);
            done += 1;
            next = (f64::from(done) + offset) * spacing;
        }
        before += within;
    }
    sum.look(density, ray);
    sum.total / f64::from(done.max(1))
}

/// `Σ (ρ(t) − ρ̌)/(ρ̄ − ρ̌)`, looked up in eights.
struct Sum {
    /// Points that are not looked up yet.
    count: usize,
    t: [f32; LANES],
    minorant: [f32; LANES],
    /// `ρ̄ − ρ̌`.
    spread: [f32; LANES],
    total: f64,
}

impl Sum {
    #[inline(always)]
    fn add<A: DensityAccessor>(
        &mut self,
        density: &mut A,
        ray: &FieldRay,
        t: f32,
        minorant: f32,
        spread: f32,
    ) {
        self.t[self.count] = t;
        self.minorant[self.count] = minorant;
        self.spread[self.count] = spread;
        self.count += 1;
        if self.count == LANES {
            self.look(density, ray);
        }
    }

    #[inline(always)]
    fn look<A: DensityAccessor>(&mut self, density: &mut A, ray: &FieldRay) {
        let rho = densities_at(density, ray, &self.t, self.count);
        let bounds = self.minorant.iter().zip(&self.spread);
        for (rho, (minorant, spread)) in rho[..self.count].iter().zip(bounds) {
            self.total += f64::from((rho - minorant) / spread);
        }
        self.count = 0;
    }
}

/// `q_n`, the probability of at least `n` corrections.
fn chance_of(n: usize) -> f64 {
    match n {
        0 => 1.0,
        1 | 2 => CORRECTED,
        _ => (3..=n).fold(CORRECTED, |chance, i| chance * ROULETTE / i as f64),
    }
}

/// `Σ_n m_n / (n! q_n)` around the pivot `queries[j]`.
fn corrected(queries: &[f64], j: usize, chance: impl Fn(usize) -> f64) -> f64 {
    let count = queries.len() - 1;
    // Means of products of n different ones, e_n / C(count, n), built by adding one query at a
    // time: m_n of i + 1 is ((i + 1 − n) m_n + n x m_{n−1}) / (i + 1).
    let mut means = [0.0f64; MAX_QUERIES];
    means[0] = 1.0;
    let others = queries.iter().enumerate().filter(|&(i, _)| i != j);
    for (added, (_, &query)) in others.enumerate() {
        let x = queries[j] - query;
        let total = (added + 1) as f64;
        for n in (1..=added + 1).rev() {
            means[n] = ((total - n as f64) * means[n] + n as f64 * x * means[n - 1]) / total;
        }
    }
    let (mut sum, mut factorial) = (1.0, 1.0);
    for (n, mean) in means.iter().enumerate().take(count + 1).skip(1) {
        factorial *= n as f64;
        sum += mean / (factorial * chance(n));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::check_faults;

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        ChancesForgotten,
        PivotDependent,
    }

    #[test]
    fn all_outcomes_together_have_the_mean_exactly() {
        // Queries with two values; numbers of corrections up to where nothing is left of the
        // series.
        const VALUES: [f64; 2] = [0.2, 0.9];
        const MOST: usize = 10;
        let truth = (-0.5 * (VALUES[0] + VALUES[1])).exp();
        check_faults(&[Fault::ChancesForgotten, Fault::PivotDependent], |fault| {
            let mut mean = 0.0;
            for corrections in (0..=MOST).filter(|&n| n != 1) {
                let next = if corrections == 0 { 2 } else { corrections + 1 };
                let beyond = if corrections == MOST { 0.0 } else { chance_of(next) };
                let probability = chance_of(corrections) - beyond;
                for outcome in 0..1u32 << (corrections + 1) {
                    let queries: Vec<f64> = (0..=corrections)
                        .map(|i| VALUES[(outcome >> i & 1) as usize])
                        .collect();
                    let estimate: f64 = (0..queries.len())
                        .map(|j| {
                            let sum = match fault {
                                None => corrected(&queries, j, chance_of),
                                Some(Fault::ChancesForgotten) => corrected(&queries, j, |_| 1.0),
                                Some(Fault::PivotDependent) => corrected(&queries, 0, chance_of),
                            };
                            (-queries[j]).exp() * sum
                        })
                        .sum();
                    let share = probability / f64::from(1u32 << (corrections + 1));
                    mean += share * estimate / queries.len() as f64;
                }
            }
            if (mean - truth).abs() < 1e-9 {
                Ok(())
            } else {
                Err(format!("{mean} for {truth}"))
            }
        })
        .unwrap();
    }

    #[test]
    fn the_number_of_corrections_is_drawn_by_its_chances() {
        // The loop in `unbiased_ray_marching`, all outcomes of its roulette: P(N ≥ n + 1 | N ≥
        // n) is what is compared with.
        for n in 2..12 {
            let ratio = chance_of(n + 1) / chance_of(n);
            assert!((ratio - ROULETTE / (n + 1) as f64).abs() < 1e-15);
        }
        assert_eq!(
            (chance_of(0), chance_of(1), chance_of(2)),
            (1.0, CORRECTED, CORRECTED)
        );
        // What is cut off is beyond any precision.
        assert!(chance_of(MAX_QUERIES) < 1e-15);
    }
}
