//! A lobe's statistics of the directions that it was fitted to.

use super::lobe::{VmfLobe, concentration_of};
use glam::{DVec3, Vec3};

/// Sums over samples `i` of a lobe, each with its weight times the share `γ_i` of the lobe in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct LobeStatistics {
    /// `Σ γ w`.
    pub weight: f64,
    /// `Σ (γ w)²`: with the sum before, it gives the equivalent number of samples of equal
    /// weight.
    pub weight_squared: f64,
    /// `Σ γ w ω`.
    pub direction: [f64; 3],
    /// `Σ γ w / t` of the distances `t`; nothing of what is at infinity.
    pub inverse_distance: f64,
}

impl LobeStatistics {
    /// Adds a sample of weight `γ w`, with `1/t` of its distance.
    pub fn add(&mut self, weight: f64, direction: Vec3, inverse_distance: f64) {
        self.weight += weight;
        self.weight_squared += weight * weight;
        for axis in 0..3 {
            self.direction[axis] += weight * f64::from(direction[axis]);
        }
        self.inverse_distance += weight * inverse_distance;
    }

    /// `self` times `factor`, plus `other`. The number of samples is scaled by `factor` as well.
    pub fn decayed_plus(&self, factor: f64, other: &Self) -> Self {
        let add = |a: f64, b: f64| a * factor + b;
        Self {
            weight: add(self.weight, other.weight),
            weight_squared: add(self.weight_squared, other.weight_squared),
            direction: std::array::from_fn(|axis| add(self.direction[axis], other.direction[axis])),
            inverse_distance: add(self.inverse_distance, other.inverse_distance),
        }
    }

    /// Equivalent number of samples of equal weight, `(Σ w)² / Σ w²`.
    pub fn effective_count(&self) -> f64 {
        if self.weight_squared > 0.0 {
            self.weight * self.weight / self.weight_squared
        } else {
            0.0
        }
    }

    /// The lobe that fits best, with a prior: `r̄ ← (N² r̄ + N_p r_p) / (N² + N_p)`
    /// (Algorithm 3). `None` without a direction.
    pub fn lobe(&self, prior_count: f64, prior_cosine: f64) -> Option<VmfLobe> {
        let sum = DVec3::from_array(self.direction);
        let length = sum.length();
        // NaN fails the comparison.
        if !(length > 0.0 && self.weight > 0.0) {
            return None;
        }
        let squared = self.effective_count().powi(2);
        let mean_cosine =
            (squared * (length / self.weight) + prior_count * prior_cosine) / (squared + prior_count);
        Some(VmfLobe {
            weight: self.weight as f32,
            mean: (sum / length).as_vec3(),
            concentration: concentration_of(mean_cosine),
        })
    }

    /// Distance of the light that the lobe represents: the harmonic mean, which is that of the
    /// parallax. Infinite if all samples are at infinity.
    pub fn distance(&self) -> f32 {
        if self.inverse_distance > 0.0 {
            (self.weight / self.inverse_distance) as f32
        } else {
            f32::INFINITY
        }
    }
}
