//! Weights, clamping and stratified subsets.

use lightshed_bvh::{Sampling, WeightHistogram, sample, stratum_beside_uniform};
use lightshed_sampling::CounterRng;
use lightshed_testkit::check_faults;
use proptest::prelude::*;

/// The least `c` with `c / Σ min(w, c) ≥ s`: the sum is linear in `c` between weights.
fn exact_clamp(weights: &[f64], stratum: f64) -> f64 {
    let mut sorted = weights.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut below = 0.0;
    for (i, &weight) in sorted.iter().enumerate() {
        // Where all weights from this one on are clamped: c (1 − s k) = s · Σ below.
        let clamped = (sorted.len() - i) as f64;
        let rest = 1.0 - stratum * clamped;
        if rest > 0.0 {
            let clamp = stratum * below / rest;
            if clamp <= weight {
                return clamp;
            }
        }
        below += weight;
    }
    stratum * below
}

fn share(weights: &[f64], clamp: f64) -> f64 {
    clamp / weights.iter().map(|w| w.min(clamp)).sum::<f64>()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Algorithm 6: the clamping weight satisfies its constraint and is at most twice the exact
    /// one.
    #[test]
    fn clamps_are_within_their_bound(
        exponents in prop::collection::vec(-25.0f64..25.0, 2..200),
        narrow in any::<bool>(),
        fraction in 0.01f64..0.9,
    ) {
        let weights: Vec<f64> = exponents
            .iter()
            .map(|e| f64::from(((if narrow { e / 12.0 } else { *e }).exp2() as f32).powi(2)).sqrt())
            .collect();
        let mut histogram = WeightHistogram::default();
        weights.iter().for_each(|w| histogram.add_squared((w * w) as f32));
        let stratum = 1.0 / (fraction * weights.len() as f64).ceil();
        let clamp = histogram.clamp(stratum);
        let exact = exact_clamp(&weights, stratum);
        prop_assert!((share(&weights, exact.max(1e-30)) / stratum - 1.0).abs() < 1e-9 || exact == 0.0);
        prop_assert!(share(&weights, clamp) >= stratum * (1.0 - 1e-6), "{} {}", share(&weights, clamp), stratum);
        prop_assert!(clamp <= 2.0 * exact * (1.0 + 1e-6), "{clamp} and {exact}");
    }
}

/// Bins by exponents are those of logarithms; what is below or above all bins is in the first or
/// the last.
#[test]
fn weights_are_in_their_bins() {
    let one = |weight: f64| {
        let mut histogram = WeightHistogram::default();
        histogram.add_squared((weight * weight) as f32);
        histogram
    };
    for i in -60..60 {
        let low = (f64::from(i) * 0.5).exp2();
        assert_eq!(one(low * 1.0001), one(low * 1.4141));
        assert_ne!(one(low * 1.0001), one(low * 0.9999));
    }
    assert_eq!(one(0.0), one(1e-20));
    assert_eq!(one(1e12), one(1e15));
    // No weight at all: any clamp will do.
    let mut none = WeightHistogram::default();
    (0..5).for_each(|_| none.add_squared(0.0));
    assert!(none.clamp(0.2) > 0.0);
}

fn weights(count: u32) -> Vec<f32> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(2, i, count);
            let scale = if rng.next_f32() < 0.05 { 100.0 } else { 1.0 };
            scale * (rng.next_f32() + 0.01)
        })
        .collect()
}

/// Probabilities by eq. 8.3, with the clamping weight that the histogram gives.
fn probabilities(weights: &[f32], fraction: f64, uniform: f64) -> (f64, Vec<f64>) {
    let count = weights.len();
    let strata = (count as f64 * fraction).ceil();
    let mut histogram = WeightHistogram::default();
    weights.iter().for_each(|w| histogram.add_squared(w * w));
    let clamp = histogram.clamp(stratum_beside_uniform(1.0 / strata, uniform, count));
    let clamped = |w: &f32| f64::from(*w).min(clamp);
    let total: f64 = weights.iter().map(clamped).sum();
    let of = |w| uniform / count as f64 + (1.0 - uniform) * clamped(w) / total;
    (strata, weights.iter().map(of).collect())
}

/// All heavy primitives are in the subset, whatever the offset; the others as often as their
/// probability tells, over all offsets: an enumeration with 4096 of them, off by no more than one.
/// Weights that are not clamped, or not mixed, are noticed.
#[test]
fn subsets_have_their_probabilities() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Uniform,
        Fraction,
    }
    const OFFSETS: u32 = 4096;
    for (count, fraction, uniform) in [
        (1u32, 0.2, 0.1),
        (150, 0.2, 0.1),
        (400, 0.05, 0.0),
        (300, 0.7, 0.2),
    ] {
        let weights = weights(count);
        let (strata, expected) = probabilities(&weights, fraction, uniform);
        assert!((expected.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        let faults: &[Fault] = if count > 1 {
            &[Fault::Uniform, Fault::Fraction]
        } else {
            &[]
        };
        check_faults(faults, |fault| {
            let (fraction, uniform) = match fault {
                Some(Fault::Uniform) => (fraction, uniform + 0.1),
                Some(Fault::Fraction) => (fraction * 1.2, uniform),
                None => (fraction, uniform),
            };
            let mut times = vec![0u32; count as usize];
            for offset in 0..OFFSETS {
                let sampling = Sampling {
                    fraction,
                    uniform,
                    offset: (f64::from(offset) + 0.5) / f64::from(OFFSETS),
                };
                let chosen = sample(count as usize, |i| weights[i] * weights[i], &sampling);
                assert!(chosen.windows(2).all(|w| w[0] < w[1]));
                chosen.iter().for_each(|&i| times[i as usize] += 1);
            }
            for (i, (&times, p)) in times.iter().zip(&expected).enumerate() {
                let points = p * strata;
                let expected = f64::from(OFFSETS) * points.min(1.0);
                if (f64::from(times) - expected).abs() > 1.01 {
                    return Err(format!("{i} of {count}: {times} times, expected {expected}"));
                }
                if points > 1.0 + 1e-9 && times < OFFSETS {
                    return Err(format!(
                        "{i} of {count} is heavy, but was chosen {times} times only"
                    ));
                }
            }
            Ok(())
        })
        .unwrap_or_else(|e| panic!("{count}: {e}"));
    }
}

/// Without weights all are alike; a fraction of one takes all.
#[test]
fn subsets_of_equal_weights_are_even() {
    let sampling = |fraction| Sampling {
        fraction,
        uniform: 0.1,
        offset: 0.4,
    };
    for weight in [0.0, 1.0, 1e-30, 1e30] {
        let chosen = sample(20_000, |_| weight, &sampling(0.1));
        assert_eq!(chosen.len(), 2000);
        assert!(chosen.windows(2).all(|w| (9..=11).contains(&(w[1] - w[0]))));
        assert_eq!(sample(9000, |_| weight, &sampling(1.0)).len(), 9000);
    }
    assert!(sample(0, |_| 1.0, &sampling(0.5)).is_empty());
}
