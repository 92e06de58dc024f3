//! The share of a guide in the mixture with the BSDF.
//!
//! Directions have the density `(1 − α) p_s + α p_g`. The share `α` with the least
//! Kullback–Leibler divergence from the target `f` maximises
//! `Σ w_i ln((1 − α) p_s(ω_i) + α p_g(ω_i))` over samples of weights `w_i = f/p`: a concave
//! function of one number. Each step of expectation maximisation, `α ← Σ w_i r_i / Σ w_i` with
//! the responsibility `r_i = α p_g / ((1 − α) p_s + α p_g)`, raises it. Adam, which Müller
//! 2019 uses for the same target, needs a learning rate and depends on the order of the samples;
//! this does not.

use crate::sample::TrainingSample;
use glam::Vec3;
use lightshed_sampling::DirectionDistribution;

/// Number of steps of an update. The share is kept, so later updates continue from it.
const STEPS: u32 = 6;
/// Least start of the steps: a share of zero would stay zero.
const LEAST_START: f64 = 0.05;
/// Largest ratio between a density that a sample had and the density it would have now.
const LARGEST_RATIO: f64 = 64.0;
/// Bits after the binary point of sums that do not depend on the order of their terms.
const SCALE: f64 = (1u64 << 32) as f64;

/// The share after an update. `guide` has the directions at a position, and has not yet learnt from
/// the samples: a guide is judged by samples that it has not seen. `prior` samples that vote for
/// one half are added.
pub(crate) fn learn_share<D: DirectionDistribution>(
    samples: &[TrainingSample],
    guide: impl Fn(Vec3) -> D,
    share: f32,
    prior: f32,
    by_variance: bool,
) -> f32 {
    let largest = samples.iter().map(TrainingSample::weight).fold(0.0, f32::max);
    if !(largest > 0.0) {
        return share;
    }
    let fixed = |x: f64| (x * SCALE) as u64;
    let densities: Vec<[f64; 3]> = samples
        .iter()
        .map(|sample| {
            let direction: Vec3 = sample.direction();
            [
                f64::from(sample.weight() / largest),
                f64::from(sample.scattering_pdf()),
                f64::from(guide(sample.position()).pdf(direction).value()),
            ]
        })
        .collect();
    let mut share = f64::from(share).max(LEAST_START);
    for _ in 0..STEPS {
        let (mut total, mut sum) = (0u64, 0u64);
        for (&[weight, scattering, guide], sample) in densities.iter().zip(samples) {
            let own = share * guide;
            let together = (1.0 - share) * scattering + own;
            let responsible = if together > 0.0 { own / together } else { 0.5 };
            let weight = if by_variance {
                // `w p` is the sample's result: divided again by the density that it would have
                // now.
                let ratio = f64::from(sample.pdf()) / together.max(f64::MIN_POSITIVE);
                weight * weight * ratio.min(LARGEST_RATIO)
            } else {
                weight
            };
            total += fixed(weight);
            sum += fixed(weight * responsible);
        }
        let (total, sum) = (total as f64 / SCALE, sum as f64 / SCALE);
        // Samples of mean weight.
        let prior = f64::from(prior) * total / samples.len() as f64;
        if !(total + prior > 0.0) {
            break;
        }
        share = (sum + 0.5 * prior) / (total + prior);
    }
    share as f32
}
