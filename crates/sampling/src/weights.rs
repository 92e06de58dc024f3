//! Errors in a list of weights.

use core::fmt;

/// Why a discrete or piecewise-constant distribution cannot be built from its weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WeightsError {
    /// There is no weight.
    Empty,
    /// There are more weights than the structure can index.
    TooMany {
        /// Number of weights given.
        count: usize,
        /// Largest number accepted.
        limit: usize,
    },
    /// The weights do not fill a whole number of rows of the stated width.
    RaggedRows {
        /// Number of weights given.
        count: usize,
        /// Stated number of weights in a row.
        width: usize,
    },
    /// A weight is below zero.
    Negative {
        /// Its place.
        index: usize,
    },
    /// A weight is NaN or infinite.
    NotFinite {
        /// Its place.
        index: usize,
    },
    /// Every weight is zero: nothing can be sampled.
    AllZero,
}

impl fmt::Display for WeightsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Empty => write!(f, "no weights"),
            Self::TooMany { count, limit } => write!(f, "{count} weights, more than {limit}"),
            Self::RaggedRows { count, width } => write!(f, "{count} weights do not form rows of {width}"),
            Self::Negative { index } => write!(f, "weight {index} is negative"),
            Self::NotFinite { index } => write!(f, "weight {index} is not finite"),
            Self::AllZero => write!(f, "all weights are zero"),
        }
    }
}

impl core::error::Error for WeightsError {}

/// Checks what all weighted structures require; returns the largest weight, which is positive.
pub(crate) fn validate<W: Copy + Into<f64>>(weights: &[W], limit: usize) -> Result<f64, WeightsError> {
    if weights.is_empty() {
        return Err(WeightsError::Empty);
    }
    if weights.len() > limit {
        return Err(WeightsError::TooMany {
            count: weights.len(),
            limit,
        });
    }
    let mut largest = 0f64;
    for (index, &weight) in weights.iter().enumerate() {
        let weight = weight.into();
        if !weight.is_finite() {
            return Err(WeightsError::NotFinite { index });
        }
        if weight < 0.0 {
            return Err(WeightsError::Negative { index });
        }
        largest = largest.max(weight);
    }
    if largest > 0.0 {
        Ok(largest)
    } else {
        Err(WeightsError::AllZero)
    }
}
