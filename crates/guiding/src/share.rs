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
/// Samples side by side.
const WIDE: usize = 4;
/// Groups of samples whose sums are exact in `f64`: a term is less than 2³⁹.
const EXACT: usize = 4096;

/// Samples side by side, those of weight zero to fill the last group.
#[derive(Clone, Copy, Default)]
struct Group {
    /// Relative to the largest.
    weight: [f64; WIDE],
    /// Densities: by the BSDF, by the guide, and with which they were sampled.
    scattering: [f64; WIDE],
    guide: [f64; WIDE],
    pdf: [f64; WIDE],
}

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
    let mut groups = vec![Group::default(); samples.len().div_ceil(WIDE)];
    for (group, samples) in groups.iter_mut().zip(samples.chunks(WIDE)) {
        for (i, sample) in samples.iter().enumerate() {
            group.weight[i] = f64::from(sample.weight() / largest);
            group.scattering[i] = f64::from(sample.scattering_pdf());
            group.guide[i] = f64::from(guide(sample.position()).pdf(sample.direction()).value());
            group.pdf[i] = f64::from(sample.pdf());
        }
    }
    let mut share = f64::from(share).max(LEAST_START);
    for _ in 0..STEPS {
        let [total, sum] = if by_variance {
            sums(&groups, share, |weight, pdf, together| {
                // `w p` is the sample's result: divided again by the density that it would have
                // now.
                let ratio = pdf / together.max(f64::MIN_POSITIVE);
                weight * weight * ratio.min(LARGEST_RATIO)
            })
        } else {
            sums(&groups, share, |weight, _, _| weight)
        };
        // Samples of mean weight.
        let prior = f64::from(prior) * total / samples.len() as f64;
        if !(total + prior > 0.0) {
            break;
        }
        share = (sum + 0.5 * prior) / (total + prior);
    }
    share as f32
}

/// Sums of the samples' weights, and of these times how likely the guide is to explain each.
/// `weigh` gives a weight from that of the sample, its density, and that of the mixture.
#[inline(always)]
fn sums(groups: &[Group], share: f64, weigh: impl Fn(f64, f64, f64) -> f64) -> [f64; 2] {
    let (mut total, mut sum) = (0u64, 0u64);
    for groups in groups.chunks(EXACT) {
        let mut parts = [[0.0f64; 2]; WIDE];
        for group in groups {
            for (i, [of_total, of_sum]) in parts.iter_mut().enumerate() {
                let own = share * group.guide[i];
                let together = (1.0 - share) * group.scattering[i] + own;
                let responsible = if together > 0.0 { own / together } else { 0.5 };
                let weight = weigh(group.weight[i], group.pdf[i], together);
                *of_total += whole(weight * SCALE);
                *of_sum += whole(weight * responsible * SCALE);
            }
        }
        for [of_total, of_sum] in parts {
            total += of_total as u64;
            sum += of_sum as u64;
        }
    }
    [total, sum].map(|sum| sum as f64 / SCALE)
}

/// The whole part of a number below 2⁵¹: as `x as u64`, 0 for what is not a number, but side by
/// side with others.
#[inline(always)]
fn whole(x: f64) -> f64 {
    const ONES: f64 = (1u64 << 52) as f64;
    let x = if x > 0.0 { x } else { 0.0 };
    // The sum has no bits after the point: it is rounded to the nearest.
    let rounded = (x + ONES) - ONES;
    rounded - if rounded > x { 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::GuidingSample;
    use lightshed_sampling::{CounterRng, Density, SolidAngle, UniformSphere};
    use lightshed_testkit::check_faults;

    #[test]
    fn whole_parts_are_those_of_casts() {
        for i in 0..100_000u32 {
            let mut rng = CounterRng::new(1, i, 0);
            let scale = 2f64.powi((rng.next_u32() % 60) as i32 - 12);
            let x = f64::from(rng.next_u32()) / f64::from(u32::MAX) * scale;
            assert_eq!(whole(x), x as u64 as f64, "{x}");
        }
        for x in [
            0.0,
            -0.0,
            0.5,
            1.5,
            2.5,
            1.0 - 1e-16,
            4294967295.5,
            f64::NAN,
            -1.0,
        ] {
            assert_eq!(whole(x), x as u64 as f64, "{x}");
        }
    }

    /// A guide of which every direction has the density of its first coordinate.
    struct Slope;

    impl DirectionDistribution for Slope {
        fn sample(&self, _: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
            None
        }

        fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
            Density::new(direction.x.max(0.0))
        }
    }

    /// [`learn_share`], one sample after the other.
    fn plainly(samples: &[TrainingSample], share: f32, prior: f32, by_variance: bool) -> f32 {
        let largest = samples.iter().map(TrainingSample::weight).fold(0.0, f32::max);
        let mut share = f64::from(share).max(LEAST_START);
        for _ in 0..STEPS {
            let (mut total, mut sum) = (0u64, 0u64);
            for sample in samples {
                let own = share * f64::from(Slope.pdf(sample.direction()).value());
                let together = (1.0 - share) * f64::from(sample.scattering_pdf()) + own;
                let responsible = if together > 0.0 { own / together } else { 0.5 };
                let mut weight = f64::from(sample.weight() / largest);
                if by_variance {
                    let ratio = f64::from(sample.pdf()) / together.max(f64::MIN_POSITIVE);
                    weight = weight * weight * ratio.min(LARGEST_RATIO);
                }
                total += (weight * SCALE) as u64;
                sum += (weight * responsible * SCALE) as u64;
            }
            let (total, sum) = (total as f64 / SCALE, sum as f64 / SCALE);
            let prior = f64::from(prior) * total / samples.len() as f64;
            share = (sum + 0.5 * prior) / (total + prior);
        }
        share as f32
    }

    /// Groups of samples give the bits of samples one by one, for any number of them.
    #[test]
    fn groups_are_samples_one_by_one() {
        let samples: Vec<TrainingSample> = (0..40_000u32)
            .filter_map(|i| {
                let mut rng = CounterRng::new(2, i, 0);
                TrainingSample::new(&GuidingSample {
                    position: Vec3::ZERO,
                    direction: UniformSphere::sample(rng.next_2d()),
                    distance: 1.0,
                    weight: 10f32.powf(8.0 * rng.next_f32() - 4.0),
                    pdf: Density::new(rng.next_f32()),
                    scattering_pdf: Density::new(if i % 3 == 0 { 0.0 } else { rng.next_f32() }),
                })
            })
            .collect();
        check_faults(&["a sample left out", "another kind of weight"], |fault| {
            for count in [1, 2, 3, 4, 5, 517, 16_389, 40_000] {
                for by_variance in [false, true] {
                    let samples = &samples[..count];
                    let used = match fault {
                        Some("a sample left out") => &samples[..count - 1],
                        _ => samples,
                    };
                    let by = by_variance != (fault == Some("another kind of weight"));
                    let share = learn_share(used, |_| Slope, 0.3, 16.0, by);
                    let plain = plainly(samples, 0.3, 16.0, by_variance);
                    if share.to_bits() != plain.to_bits() {
                        return Err(format!("{count}: {share} and {plain}"));
                    }
                }
            }
            Ok(())
        })
        .unwrap();
    }
}
