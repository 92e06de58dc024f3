//! A von Mises–Fisher lobe by its parameters.
//!
//! `p_ω = κ / (2π (1 − e^{−2κ})) · e^{κ(μ·ω − 1)}`, and 1/4π where `κ = 0` (eq.
//! 4.35 without its overflow).

use glam::Vec3;

/// Largest concentration of a lobe: its width, about a thousandth of a radian, is the resolution of
/// `f32` directions.
pub const MAX_CONCENTRATION: f32 = 1e6;

/// Below this concentration a lobe is uniform up to rounding.
const UNIFORM_BELOW: f32 = 1e-7;

/// A lobe of a mixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VmfLobe {
    /// Share of the mixture, not negative.
    pub weight: f32,
    /// Unit mean direction `μ`.
    pub mean: Vec3,
    /// Concentration `κ`, 0 to [`MAX_CONCENTRATION`].
    pub concentration: f32,
}

impl VmfLobe {
    /// All directions alike, of weight zero.
    pub(super) const UNIFORM: Self = Self {
        weight: 0.0,
        mean: Vec3::Z,
        concentration: 0.0,
    };
}

/// The density of a lobe at its mean, `κ / (2π (1 − e^{−2κ}))`, per steradian. Between 1/4π
/// and 1.6·10⁵.
pub(crate) fn peak_density(concentration: f32) -> f32 {
    let kappa = f64::from(concentration);
    let peak = if concentration > UNIFORM_BELOW {
        -kappa / (std::f64::consts::TAU * (-2.0 * kappa).exp_m1())
    } else {
        0.25 * std::f64::consts::FRAC_1_PI
    };
    peak as f32
}

/// The concentration of the lobe with this mean cosine `r̄`:
/// `κ = (3r̄ − r̄³) / (1 − r̄²)` (eq. 4.52), which is near the solution of
/// `r̄ = coth κ − 1/κ`. The mean cosine is brought into 0 to `1 − 1/κ_max`, where the
/// formula would diverge; NaN is 0.
pub fn concentration_of(mean_cosine: f64) -> f32 {
    let most = 1.0 - 1.0 / f64::from(MAX_CONCENTRATION);
    // NaN fails the comparison.
    let r = if mean_cosine > 0.0 {
        mean_cosine.min(most)
    } else {
        0.0
    };
    let kappa = (3.0 * r - r * r * r) / ((1.0 - r) * (1.0 + r));
    (kappa as f32).min(MAX_CONCENTRATION)
}
