//! The error of every statistical test here.

use core::fmt;

/// Why a statistical test did not pass.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum StatisticsError {
    /// The input cannot be tested (lengths differ, a count is missing, a value is not finite, …).
    Malformed(&'static str),
    /// The hypothesis was rejected: if it were true, a statistic this extreme would have
    /// probability `p_value`.
    Rejected {
        /// Name of the test.
        test: &'static str,
        /// Its statistic.
        statistic: f64,
        /// Probability of a statistic at least this extreme under the hypothesis.
        p_value: f64,
        /// The false-positive rate that the caller asked for.
        significance: f64,
        /// Where the largest disagreement is.
        detail: String,
    },
}

impl fmt::Display for StatisticsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed(what) => write!(f, "cannot be tested: {what}"),
            Self::Rejected {
                test,
                statistic,
                p_value,
                significance,
                detail,
            } => write!(
                f,
                "{test} rejects: statistic {statistic:.6}, p = {p_value:.3e} < {significance:.3e}; {detail}"
            ),
        }
    }
}

impl std::error::Error for StatisticsError {}

/// Accepts significances in (0, 1) only: at 0 a test cannot fail.
pub(crate) fn check_significance(significance: f64) -> Result<(), StatisticsError> {
    if significance > 0.0 && significance < 1.0 {
        Ok(())
    } else {
        Err(StatisticsError::Malformed("significance must lie in (0, 1)"))
    }
}

/// `P(|Z| ≥ |z|)` for a standard normal `Z`; 0 for infinite and 1 for NaN-free zero `z`.
pub(crate) fn two_sided_normal_p(z: f64) -> f64 {
    if z.is_nan() {
        return 0.0;
    }
    statrs::function::erf::erfc(z.abs() / core::f64::consts::SQRT_2)
}
