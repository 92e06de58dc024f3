//! Loads by which leaves lower the variance most.
//!
//! A tree of `L` leaves of equal probability, in a mixture of share `α` with the BSDF, has the
//! second moment `M = Σ_i e_i / m_i` over samples of weight `w_i = f/p` and density `p_i`, where
//! `e_i = w_i² p_i` and `m_i = (1 − α) p_s(ω_i) + α 4^d J(ω_i) / L`. Here `d` is the depth of the
//! leaf of `ω_i` and `J = ‖q‖₂³/4` the factor of eq. 5.1. Samples of a square have the depth of its
//! leaf. So dividing a leaf lowers `M` by the sum over its own samples alone,
//! `Σ e_i (1/m_i(d) − 1/m_i(d + 1)) = Σ e_i 3 b_i / ((a_i + b_i)(a_i + 4 b_i))` with
//! `a = (1 − α) p_s` and `b = α 4^d J / L`. Joining four leaves raises it by that sum, with the
//! depth of their parent. Rath 2020 (eq. 5 there) has the density of least variance for a guide
//! alone, `√(E f²)`; the sum counts what the BSDF finds, too.

use super::learn::{Loads, area};
use crate::sample::TrainingSample;
use crate::square::{code_of, square_of};
use glam::Vec3;
use lightshed_sampling::{Density, octahedral_to_solid_angle};
use std::f64::consts::FRAC_1_PI;

/// Samples in the order of their directions' Morton codes.
pub(super) struct VarianceLoads {
    codes: Vec<u32>,
    /// `e`, `a`, and `α J / L`.
    terms: Vec<[f32; 3]>,
    /// Mean of `e`.
    mean: f64,
    /// `1 − α` and `α / L`.
    shares: [f64; 2],
}

impl VarianceLoads {
    /// From samples in any order: they are sorted by all that sums depend on, so sums have the same
    /// bits. The tree has `leaves` leaves and the share `share` in the mixture; `seen` is the
    /// direction from its pivot for a position and a direction, with its factor.
    pub fn new(
        samples: &[TrainingSample],
        leaves: u32,
        share: f32,
        seen: impl Fn(Vec3, Vec3) -> (Vec3, f32),
    ) -> Self {
        let key = |sample: &TrainingSample| {
            let (direction, factor) = seen(sample.position(), sample.direction());
            let factor = (factor * jacobian(direction)).to_bits();
            let code = code_of(square_of(direction));
            let [weight, pdf, scattering] =
                [sample.weight(), sample.pdf(), sample.scattering_pdf()].map(f32::to_bits);
            [code, weight, pdf, scattering, factor]
        };
        let mut keys: Vec<[u32; 5]> = samples.iter().map(key).collect();
        keys.sort_unstable();
        let own = share / leaves as f32;
        let (mut codes, mut terms) = (Vec::with_capacity(keys.len()), Vec::with_capacity(keys.len()));
        let mut sum = 0.0;
        for [code, rest @ ..] in keys {
            let [weight, pdf, scattering, factor] = rest.map(f32::from_bits);
            // A product that overflows is no more than the largest number.
            let energy = (weight * weight * pdf).min(f32::MAX.sqrt());
            sum += f64::from(energy);
            codes.push(code);
            terms.push([energy, (1.0 - share) * scattering, own * factor]);
        }
        Self {
            mean: sum / codes.len().max(1) as f64,
            codes,
            terms,
            shares: [f64::from(1.0 - share), f64::from(own)],
        }
    }
}

/// `J`: density over directions of the uniform density on the square.
fn jacobian(direction: Vec3) -> f32 {
    octahedral_to_solid_angle(Density::new(1.0), direction).value()
}

impl Loads for VarianceLoads {
    fn count(&self) -> usize {
        if self.mean > 0.0 { self.codes.len() } else { 0 }
    }

    fn load(&self, code: u32, depth: u32, prior: f64) -> (f64, usize) {
        let last = code | u32::MAX.checked_shr(2 * depth).unwrap_or(0);
        let first = self.codes.partition_point(|&own| own < code);
        let end = first + self.codes[first..].partition_point(|&own| own <= last);
        // 4^depth.
        let fineness = f32::from_bits((127 + 2 * depth) << 23);
        let mut sum = 0.0f64;
        for &[energy, a, own] in &self.terms[first..end] {
            let b = own * fineness;
            sum += f64::from(energy * (3.0 * b / ((a + b) * (a + 4.0 * b))));
        }
        // Samples of the prior have the mean energy, and a BSDF that is uniform.
        let [a, b] = self.shares.map(|share| share * 0.25 * FRAC_1_PI);
        let b = b * f64::from(fineness);
        let even = 3.0 * b / ((a + b) * (a + 4.0 * b));
        (sum + prior * area(depth) * self.mean * even, end - first)
    }
}
