//! Tests of means.
//!
//! Welford's running mean and squared deviation, and z-tests on them: `z = (x̄ − μ)/√(s²/n)`
//! against a known mean, `z = (x̄ − ȳ)/√(s_x²/n_x + s_y²/n_y)` between two.

use crate::StatisticsError;
use crate::rejection::{check_significance, two_sided_normal_p};

/// Running mean and variance of a stream of values (Welford 1962), with z-tests.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanTest {
    count: u64,
    mean: f64,
    squared_deviation: f64,
}

/// A test of a mean that passed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MeanReport {
    /// The measured mean.
    pub mean: f64,
    /// Standard error of the difference.
    pub standard_error: f64,
    /// Deviation in standard errors.
    pub z: f64,
    /// Two-sided probability of a deviation at least this large under the hypothesis.
    pub p_value: f64,
}

impl MeanTest {
    /// No values yet.
    pub const fn new() -> Self {
        Self {
            count: 0,
            mean: 0.0,
            squared_deviation: 0.0,
        }
    }

    /// Adds a value.
    pub fn push(&mut self, value: f64) {
        self.count += 1;
        let delta = value - self.mean;
        self.mean += delta / self.count as f64;
        self.squared_deviation += delta * (value - self.mean);
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Sample mean; 0 without values.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased sample variance; 0 with fewer than two values.
    pub fn variance(&self) -> f64 {
        if self.count < 2 {
            0.0
        } else {
            self.squared_deviation / (self.count - 1) as f64
        }
    }

    /// Standard error of the mean; 0 with fewer than two values.
    pub fn standard_error(&self) -> f64 {
        if self.count < 2 {
            0.0
        } else {
            (self.variance() / self.count as f64).sqrt()
        }
    }

    /// Tests whether the mean may be `expected`; rejects a true hypothesis with probability
    /// `significance` once the mean is close to normal (the caller sees to enough values for the
    /// tails at hand).
    ///
    /// # Errors
    /// [`StatisticsError::Rejected`], or [`StatisticsError::Malformed`] for fewer than 20 values or
    /// values that are not finite.
    pub fn test_against(&self, expected: f64, significance: f64) -> Result<MeanReport, StatisticsError> {
        self.compare(
            self.mean - expected,
            self.standard_error(),
            expected,
            significance,
            20,
        )
    }

    /// Tests whether two means may be equal, as [`MeanTest::test_against`].
    ///
    /// # Errors
    /// As [`MeanTest::test_against`], for either stream.
    pub fn test_equal(&self, other: &Self, significance: f64) -> Result<MeanReport, StatisticsError> {
        if other.count < 20 {
            return Err(StatisticsError::Malformed("fewer than 20 values"));
        }
        let standard_error = self.standard_error().hypot(other.standard_error());
        self.compare(
            self.mean - other.mean,
            standard_error,
            other.mean,
            significance,
            20,
        )
    }

    fn compare(
        &self,
        difference: f64,
        standard_error: f64,
        reference: f64,
        significance: f64,
        minimum: u64,
    ) -> Result<MeanReport, StatisticsError> {
        check_significance(significance)?;
        if self.count < minimum {
            return Err(StatisticsError::Malformed("fewer than 20 values"));
        }
        if !difference.is_finite() || !standard_error.is_finite() {
            return Err(StatisticsError::Malformed("a value is not finite"));
        }
        // A constant estimator has no spread to measure by: it must be right up to rounding.
        let rounding = 1e-12 * reference.abs().max(self.mean.abs());
        let z = if difference.abs() <= rounding {
            0.0
        } else {
            difference / standard_error
        };
        let p_value = two_sided_normal_p(z);
        if p_value < significance {
            return Err(StatisticsError::Rejected {
                test: "mean",
                statistic: z,
                p_value,
                significance,
                detail: format!("mean {} ± {standard_error:.3e} against {reference}", self.mean),
            });
        }
        Ok(MeanReport {
            mean: self.mean,
            standard_error,
            z,
            p_value,
        })
    }
}

impl Extend<f64> for MeanTest {
    fn extend<I: IntoIterator<Item = f64>>(&mut self, values: I) {
        values.into_iter().for_each(|value| self.push(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{check_faults, rng, uniform_f64};

    #[test]
    fn welford_matches_the_two_pass_formula_far_from_zero() {
        let values: Vec<f64> = (0..1000).map(|i| 1e9 + f64::from(i % 7)).collect();
        let mut test = MeanTest::new();
        test.extend(values.iter().copied());
        let mean = values.iter().sum::<f64>() / 1000.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 999.0;
        assert!((test.mean() - mean).abs() < 1e-5);
        assert!((test.variance() / variance - 1.0).abs() < 1e-7);
        assert_eq!(test.count(), 1000);
    }

    #[test]
    fn accepts_the_true_mean_and_rejects_a_bias_of_one_percent() {
        // False-positive rate 1e-6.
        check_faults(&[1.01, 0.99], |scale: Option<f64>| {
            let (mut rng, mut test, mut other) = (rng(31), MeanTest::new(), MeanTest::new());
            for _ in 0..200_000 {
                test.push(scale.unwrap_or(1.0) * 3.0 * uniform_f64(&mut rng).powi(2));
                other.push(2.0 * uniform_f64(&mut rng));
            }
            test.test_against(1.0, 1e-6).and(test.test_equal(&other, 1e-6))
        })
        .unwrap();
    }

    #[test]
    fn a_constant_estimator_must_be_right() {
        let mut test = MeanTest::new();
        test.extend([0.3; 30]);
        assert!(test.test_against(0.3, 0.01).is_ok());
        assert!(matches!(
            test.test_against(0.300001, 0.01),
            Err(StatisticsError::Rejected { .. })
        ));
        assert!(matches!(
            MeanTest::new().test_against(0.0, 0.01),
            Err(StatisticsError::Malformed(_))
        ));
        test.push(f64::NAN);
        assert!(matches!(
            test.test_against(0.3, 0.01),
            Err(StatisticsError::Malformed(_))
        ));
    }
}
