//! Pearson's χ² test of counts.
//!
//! `X² = Σ_b (O_b − E_b)² / E_b` over bins `b` with observed counts `O_b` and expected counts
//! `E_b = n P_b`. Under the hypothesis that the `n` observations are drawn with bin probabilities
//! `P_b`, `X²` follows approximately a χ² distribution with (bins − 1) degrees of freedom, an
//! approximation that holds once every `E_b` is at least about 5 (Cochran 1954). Bins below that
//! are pooled.

use crate::StatisticsError;
use crate::rejection::check_significance;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Bins that expect fewer than this many counts are pooled with their successors.
const MINIMUM_EXPECTATION: f64 = 5.0;

/// By how much the expectations may miss the number of observations, relatively.
const MASS_TOLERANCE: f64 = 1e-4;

/// A χ² test that passed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ChiSquaredReport {
    /// `X²`.
    pub statistic: f64,
    /// Number of bins after pooling, less one.
    pub degrees_of_freedom: usize,
    /// Probability of a statistic at least this large under the hypothesis.
    pub p_value: f64,
}

/// The significance of each of `tests` tests such that the chance of *any* false positive among
/// them is at most `significance` (Bonferroni).
pub fn family_significance(significance: f64, tests: usize) -> f64 {
    significance / tests.max(1) as f64
}

/// Tests whether `observed` counts may come from a distribution with `expected` counts.
///
/// Rejects a correct sampler with probability `significance`. A count in a bin that expects exactly
/// zero is rejected whatever the rest says: such a sample lies outside the support.
///
/// # Errors
/// [`StatisticsError::Rejected`], or [`StatisticsError::Malformed`] if the slices differ in length,
/// an expectation is negative or not finite, the expectations do not sum to the number of
/// observations (to 10⁻⁴, relatively: the density then does not integrate to one over the
/// bins), or fewer than two bins remain after pooling.
pub fn chi_squared_test(
    observed: &[u64],
    expected: &[f64],
    significance: f64,
) -> Result<ChiSquaredReport, StatisticsError> {
    check_significance(significance)?;
    if observed.len() != expected.len() {
        return Err(StatisticsError::Malformed(
            "observed and expected differ in length",
        ));
    }
    if !expected.iter().all(|e| e.is_finite() && *e >= 0.0) {
        return Err(StatisticsError::Malformed(
            "an expectation is negative or not finite",
        ));
    }
    let total: u64 = observed.iter().sum();
    let mass: f64 = expected.iter().sum();
    if !((mass - total as f64).abs() <= MASS_TOLERANCE * total as f64) {
        return Err(StatisticsError::Malformed(
            "expectations do not sum to the number of observations",
        ));
    }
    let rejected = |statistic, p_value, detail| StatisticsError::Rejected {
        test: "chi-squared",
        statistic,
        p_value,
        significance,
        detail,
    };
    if let Some(bin) = (0..observed.len()).find(|&b| expected[b] == 0.0 && observed[b] > 0) {
        let detail = format!("{} samples in bin {bin}, which expects none", observed[bin]);
        return Err(rejected(f64::INFINITY, 0.0, detail));
    }

    let bins = pool(observed, expected);
    if bins.len() < 2 {
        return Err(StatisticsError::Malformed(
            "fewer than two bins remain after pooling",
        ));
    }
    let mut statistic = 0.0;
    let mut worst = (0.0, 0);
    for (index, bin) in bins.iter().enumerate() {
        let term = (bin.observed - bin.expected).powi(2) / bin.expected;
        statistic += term;
        if term > worst.0 {
            worst = (term, index);
        }
    }
    let degrees_of_freedom = bins.len() - 1;
    let p_value = ChiSquared::new(degrees_of_freedom as f64)
        .map_err(|_| StatisticsError::Malformed("no degrees of freedom"))?
        .sf(statistic);
    if p_value < significance {
        let bin = &bins[worst.1];
        let detail = format!(
            "{degrees_of_freedom} degrees of freedom; worst bin {}: {} observed, {:.2} expected",
            bin.first, bin.observed, bin.expected
        );
        return Err(rejected(statistic, p_value, detail));
    }
    Ok(ChiSquaredReport {
        statistic,
        degrees_of_freedom,
        p_value,
    })
}

struct Bin {
    first: usize,
    observed: f64,
    expected: f64,
}

/// Merges thin bins, in order, into pools that each expect enough; bins that expect enough stay
/// alone.
fn pool(observed: &[u64], expected: &[f64]) -> Vec<Bin> {
    let mut bins: Vec<Bin> = Vec::new();
    let mut thin: Option<Bin> = None;
    for (index, (&o, &e)) in observed.iter().zip(expected).enumerate() {
        if e >= MINIMUM_EXPECTATION {
            bins.push(Bin {
                first: index,
                observed: o as f64,
                expected: e,
            });
        } else if e > 0.0 {
            let pool = thin.get_or_insert(Bin {
                first: index,
                observed: 0.0,
                expected: 0.0,
            });
            pool.observed += o as f64;
            pool.expected += e;
            if pool.expected >= MINIMUM_EXPECTATION {
                bins.extend(thin.take());
            }
        }
    }
    // What is left over joins the last bin, so that no count is dropped.
    if let Some(rest) = thin {
        match bins.last_mut() {
            Some(last) => {
                last.observed += rest.observed;
                last.expected += rest.expected;
            }
            None => bins.push(rest),
        }
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{check_faults, rng, uniform_f64};

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        SlightlySkewed,
        OutsideSupport,
    }

    #[test]
    fn accepts_a_fair_die_and_rejects_a_loaded_one() {
        // False-positive rate 1e-6.
        check_faults(&[Fault::SlightlySkewed, Fault::OutsideSupport], |fault| {
            let mut rng = rng(11);
            let mut counts = [0u64; 7];
            let n = 60_000;
            for _ in 0..n {
                let u = uniform_f64(&mut rng);
                let u = if let Some(Fault::SlightlySkewed) = fault {
                    u.powf(1.05)
                } else {
                    u
                };
                counts[(u * 6.0) as usize] += 1;
            }
            if let Some(Fault::OutsideSupport) = fault {
                counts[0] -= 1;
                counts[6] += 1;
            }
            let mut expected = [n as f64 / 6.0; 7];
            expected[6] = 0.0;
            chi_squared_test(&counts, &expected, 1e-6)
        })
        .unwrap();
    }

    #[test]
    fn the_false_positive_rate_is_the_one_stated() {
        let (trials, significance) = (4000, 0.05);
        let mut rng = rng(12);
        let mut rejections = 0;
        for _ in 0..trials {
            let mut counts = [0u64; 20];
            for _ in 0..1000 {
                counts[(uniform_f64(&mut rng) * 20.0) as usize] += 1;
            }
            rejections += u32::from(chi_squared_test(&counts, &[50.0; 20], significance).is_err());
        }
        // Binomial(4000, 0.05): mean 200, standard deviation 13.8; five of them is a 6e-7 event.
        assert!(
            (i64::from(rejections) - 200).abs() < 69,
            "{rejections} rejections"
        );
    }

    #[test]
    fn pools_thin_bins_without_losing_counts() {
        let bins = pool(&[1, 2, 3, 10, 1], &[1.0, 2.0, 3.0, 10.0, 1.0]);
        assert_eq!(bins.len(), 2);
        assert_eq!(bins.iter().map(|b| b.observed).sum::<f64>(), 17.0);
        assert_eq!(bins.iter().map(|b| b.expected).sum::<f64>(), 17.0);
    }

    #[test]
    fn malformed_input_is_an_error() {
        for (observed, expected, significance) in [
            (&[10u64, 10][..], &[20.0][..], 0.01),
            (&[10, 10], &[10.0, f64::NAN], 0.01),
            (&[10, 10], &[10.0, 11.0], 0.01),
            (&[1, 1], &[1.0, 1.0], 0.01),
            (&[10, 10], &[10.0, 10.0], 0.0),
        ] {
            let result = chi_squared_test(observed, expected, significance);
            assert!(matches!(result, Err(StatisticsError::Malformed(_))), "{result:?}");
        }
        assert_eq!(family_significance(0.01, 10), 0.001);
        assert_eq!(family_significance(0.01, 0), 0.01);
    }
}
