//! Errors of an image.

use serde::{Deserialize, Serialize};

/// Errors of an image's luminance against a reference.
///
/// With `x` the image, `μ` the reference and means over pixels:
///
/// > `MSE = ⟨(x − μ)²⟩`, `relMSE = ⟨(x − μ)² / (μ² + ε²)⟩`,
/// > `MAPE = ⟨|x − μ| / (μ + ε)⟩`, `ε = ⟨μ⟩ / 100`
///
/// (the last as in Lin 2022 §6.8.3, footnote 12). If the reference has a known uncertainty, that
/// is subtracted from the two squared errors, which may then be negative by chance; MAPE includes
/// it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Mean squared error.
    pub mse: f64,
    /// Mean squared relative error.
    pub rel_mse: f64,
    /// Mean absolute relative error.
    pub mape: f64,
}

/// One of [`Errors`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Metric {
    /// [`Errors::mse`].
    Mse,
    /// [`Errors::rel_mse`].
    RelMse,
    /// [`Errors::mape`].
    Mape,
}

impl Metric {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Mse, Self::RelMse, Self::Mape];

    /// Its usual name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mse => "MSE",
            Self::RelMse => "relMSE",
            Self::Mape => "MAPE",
        }
    }

    /// `k` of an error that falls as `t^−k` with the number of independent samples.
    pub fn exponent(self) -> f64 {
        match self {
            Self::Mse | Self::RelMse => 1.0,
            Self::Mape => 0.5,
        }
    }
}

impl Errors {
    /// One of them.
    pub fn get(&self, metric: Metric) -> f64 {
        match metric {
            Metric::Mse => self.mse,
            Metric::RelMse => self.rel_mse,
            Metric::Mape => self.mape,
        }
    }
}
