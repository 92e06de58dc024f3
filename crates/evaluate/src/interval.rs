//! Ratios with intervals, from a few repeats.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// A positive quantity, known from repeats: the geometric mean, and an interval that holds the true
/// one in 95 of 100 cases if logarithms are normally distributed (Student's t).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Geometric mean.
    pub mid: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Of repeated measurements; `None` for fewer than two, or any that is not positive and finite.
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len() as f64;
        if values.len() < 2 || !values.iter().all(|value| *value > 0.0 && value.is_finite()) {
            return None;
        }
        let logs = values.iter().map(|value| value.ln());
        let mean = logs.clone().sum::<f64>() / count;
        let variance = logs.map(|log| (log - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let quantile = StudentsT::new(0.0, 1.0, count - 1.0).ok()?.inverse_cdf(0.975);
        let half = quantile * (variance / count).sqrt();
        Some(Self {
            low: (mean - half).exp(),
            mid: mean.exp(),
            high: (mean + half).exp(),
        })
    }

    /// Whether two intervals overlap.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.low <= other.high && other.low <= self.high
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_students() {
        // Logarithms −1, 0, 1: mean 0, standard error 1/√3, t quantile 4.3027.
        let interval = Interval::of(&[(-1f64).exp(), 1.0, 1f64.exp()]).unwrap();
        assert!((interval.mid - 1.0).abs() < 1e-12);
        let half = 4.302_652_73 / 3f64.sqrt();
        assert!((interval.high.ln() - half).abs() < 1e-6 && (interval.low.ln() + half).abs() < 1e-6);
        assert!(interval.overlaps(&Interval {
            low: 5.0,
            mid: 6.0,
            high: 7.0
        }));
        assert!(!interval.overlaps(&Interval {
            low: 50.0,
            mid: 60.0,
            high: 70.0
        }));
    }

    #[test]
    fn what_is_no_sample_of_ratios_has_none() {
        for values in [
            &[][..],
            &[1.0],
            &[1.0, 0.0],
            &[1.0, -1.0],
            &[1.0, f64::NAN],
            &[1.0, f64::INFINITY],
        ] {
            assert_eq!(Interval::of(values), None);
        }
    }
}
