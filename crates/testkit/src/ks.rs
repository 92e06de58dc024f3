//! The one-sample Kolmogorov–Smirnov test.
//!
//! `D = sup_x |F_n(x) − F(x)|` between the empirical distribution function `F_n` of `n` samples
//! and a continuous distribution function `F`. The p-value is Kolmogorov's
//! `Q(λ) = 2 Σ_{k≥1} (−1)^{k−1} e^{−2k²λ²}` at Stephens'
//! `λ = (√n + 0.12 + 0.11/√n) D` (Stephens 1970), accurate to a few per cent from n ≈ 20 on.

use crate::StatisticsError;
use crate::rejection::check_significance;

/// A Kolmogorov–Smirnov test that passed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct KolmogorovSmirnovReport {
    /// `D`.
    pub statistic: f64,
    /// Probability of a statistic at least this large under the hypothesis.
    pub p_value: f64,
}

/// Tests whether `samples` (sorted in place) may come from the continuous distribution function
/// `cdf`.
///
/// Rejects a correct sampler with probability `significance`. Ties, as `f32` samplers give, make
/// the test slightly conservative as long as they are few.
///
/// # Errors
/// [`StatisticsError::Rejected`], or [`StatisticsError::Malformed`] for fewer than 20 samples or
/// values that are not finite.
pub fn kolmogorov_smirnov_test(
    samples: &mut [f64],
    cdf: impl Fn(f64) -> f64,
    significance: f64,
) -> Result<KolmogorovSmirnovReport, StatisticsError> {
    check_significance(significance)?;
    if samples.len() < 20 {
        return Err(StatisticsError::Malformed("fewer than 20 samples"));
    }
    if !samples.iter().all(|x| x.is_finite()) {
        return Err(StatisticsError::Malformed("a sample is not finite"));
    }
    samples.sort_by(f64::total_cmp);
    let n = samples.len() as f64;
    let mut worst = (0.0f64, 0.0);
    for (index, &x) in samples.iter().enumerate() {
        let value = cdf(x);
        if !value.is_finite() {
            return Err(StatisticsError::Malformed(
                "the distribution function is not finite",
            ));
        }
        let distance = (value - index as f64 / n)
            .abs()
            .max((value - (index + 1) as f64 / n).abs());
        if distance > worst.0 {
            worst = (distance, x);
        }
    }
    let statistic = worst.0;
    let p_value = kolmogorov_q((n.sqrt() + 0.12 + 0.11 / n.sqrt()) * statistic);
    if p_value < significance {
        return Err(StatisticsError::Rejected {
            test: "Kolmogorov-Smirnov",
            statistic,
            p_value,
            significance,
            detail: format!("largest distance at x = {}", worst.1),
        });
    }
    Ok(KolmogorovSmirnovReport { statistic, p_value })
}

fn kolmogorov_q(lambda: f64) -> f64 {
    if lambda < 0.2 {
        // 1 − Q < 1e-12 here, where the alternating series converges slowly.
        return 1.0;
    }
    let mut sum = 0.0;
    for k in 1..=100 {
        let term = (-2.0 * (k * k) as f64 * lambda * lambda).exp();
        sum += if k % 2 == 1 { term } else { -term };
        if term < 1e-18 {
            break;
        }
    }
    (2.0 * sum).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{check_faults, rng, uniform_f64};

    #[test]
    fn matches_tabulated_critical_values() {
        // Kolmogorov's limiting distribution: Q(1.3581) = 0.05, Q(1.6276) = 0.01.
        assert!((kolmogorov_q(1.3581) - 0.05).abs() < 1e-5);
        assert!((kolmogorov_q(1.6276) - 0.01).abs() < 1e-5);
        assert!((kolmogorov_q(0.2) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn accepts_exponential_samples_and_rejects_a_wrong_rate() {
        // False-positive rate 1e-6.
        check_faults(&[0.94, 1.06], |rate: Option<f64>| {
            let mut rng = rng(21);
            let mut samples: Vec<f64> = (0..40_000)
                .map(|_| -(-uniform_f64(&mut rng)).ln_1p() / rate.unwrap_or(1.0))
                .collect();
            kolmogorov_smirnov_test(&mut samples, |x| -(-x).exp_m1(), 1e-6)
        })
        .unwrap();
    }

    #[test]
    fn the_false_positive_rate_is_the_one_stated() {
        let mut rng = rng(22);
        let mut rejections = 0i64;
        for _ in 0..4000 {
            let mut samples: Vec<f64> = (0..200).map(|_| uniform_f64(&mut rng)).collect();
            rejections += i64::from(kolmogorov_smirnov_test(&mut samples, |x| x, 0.05).is_err());
        }
        // Binomial(4000, 0.05), five standard deviations.
        assert!((rejections - 200).abs() < 69, "{rejections}");
    }

    #[test]
    fn malformed_input_is_an_error() {
        let mut few = [0.5; 19];
        let mut bad = [f64::NAN; 30];
        let mut fine = [0.5; 30];
        assert!(matches!(
            kolmogorov_smirnov_test(&mut few, |x| x, 0.1),
            Err(StatisticsError::Malformed(_))
        ));
        assert!(matches!(
            kolmogorov_smirnov_test(&mut bad, |x| x, 0.1),
            Err(StatisticsError::Malformed(_))
        ));
        assert!(matches!(
            kolmogorov_smirnov_test(&mut fine, |_| f64::NAN, 0.1),
            Err(StatisticsError::Malformed(_))
        ));
    }
}
