//! Products of a mixture with a cosine.
//!
//! The clamped cosine around a normal `n` is near a lobe, `max(0, n·ω) ≈ c e^{λ(n·ω − 1)}`
//! with λ = 2.18853 the concentration of equal mean cosine. The product of two lobes is a lobe:
//! `κ μ' = κ₁ μ₁ + κ₂ μ₂`, and its integral is the ratio of peaks times
//! `e^{κ − κ₁ − κ₂}`.

use super::lobe::{VmfLobe, peak_density};
use super::mixture::{MAX_LOBES, VmfMixture};
use glam::Vec3;

/// Concentration of the lobe whose mean cosine is 2/3, that of the clamped cosine.
const COSINE_CONCENTRATION: f32 = 2.188_53;

impl VmfMixture {
    /// The mixture times the clamped cosine around the unit `normal`, with the cosine approximated
    /// by a lobe, normalised again. It does not sample the exact product, but its density is that
    /// with which it samples.
    #[must_use]
    pub fn times_cosine(&self, normal: Vec3) -> Self {
        let mut products = [VmfLobe::UNIFORM; MAX_LOBES];
        for (product, lobe) in products.iter_mut().zip(self.lobes()) {
            let sum = lobe.mean * lobe.concentration + normal * COSINE_CONCENTRATION;
            let concentration = sum.length();
            // κ − κ₁ − κ₂ = ((κ₁ μ₁ + κ₂ n)² − (κ₁ + κ₂)²) / (κ +
            // κ₁ + κ₂), with μ₁·n − 1 by the chord.
            let both = lobe.concentration + COSINE_CONCENTRATION;
            let chord = (lobe.mean - normal).length_squared();
            let exponent = -lobe.concentration * COSINE_CONCENTRATION * chord / (concentration + both);
            let peaks = peak_density(lobe.concentration) / peak_density(concentration);
            *product = VmfLobe {
                weight: lobe.weight * peaks * exponent.exp(),
                mean: sum.normalize_or(normal),
                concentration,
            };
        }
        Self::new(&products[..self.len()])
    }
}
