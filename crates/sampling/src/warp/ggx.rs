//! The GGX (Trowbridge–Reitz) normal distribution.
//!
//! `D(m) = 1 / (π α_u α_v ((m_x/α_u)² + (m_y/α_v)² + m_z²)²)`,
//! `Λ(ω) = (√(1 + (α_u²ω_x² + α_v²ω_y²)/ω_z²) − 1)/2`.
//!
//! Visible normals: stretching by `(α_u, α_v, 1)` turns the microsurface into a hemisphere, whose
//! visible normals bisect the view direction `ω̂` and a direction uniform on the spherical cap
//! `z > −ω̂_z` (Dupuy and Benyoub 2023, *Sampling Visible GGX Normals with Spherical Caps*).

use super::microfacet::{MicrofacetDistribution, clamp_alpha};
use super::turn::{sin_cos_turns, turns_of};
use crate::{Density, ONE_MINUS_EPSILON, SolidAngle};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// GGX with roughness `α_u` along x and `α_v` along y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha_u: f32,
    alpha_v: f32,
}

impl Ggx {
    /// Roughness as it stands in `D` (the square of a "perceptual" roughness). Each is clamped to
    /// [10⁻⁴, 10³]; NaN becomes 10⁻⁴.
    #[inline(always)]
    pub fn new(alpha_u: f32, alpha_v: f32) -> Self {
        Self {
            alpha_u: clamp_alpha(alpha_u),
            alpha_v: clamp_alpha(alpha_v),
        }
    }

    /// The clamped `(α_u, α_v)`.
    #[inline(always)]
    pub fn alpha(&self) -> (f32, f32) {
        (self.alpha_u, self.alpha_v)
    }

    /// `ω` in the space where the microsurface is a hemisphere, before normalisation.
    #[inline(always)]
    fn stretch(&self, direction: Vec3) -> Vec3 {
        Vec3::new(
            self.alpha_u * direction.x,
            self.alpha_v * direction.y,
            direction.z,
        )
    }

    /// The view direction on the hemisphere's side, normalised.
    #[inline(always)]
    fn stretched_view(&self, view: Vec3) -> Vec3 {
        self.stretch(Vec3::new(view.x, view.y, view.z.max(0.0)))
            .normalize_or(Vec3::Z)
    }
}

impl MicrofacetDistribution for Ggx {
    #[inline(always)]
    fn normal_density(&self, normal: Vec3) -> f32 {
        if normal.z > 0.0 {
            let (x, y) = (normal.x / self.alpha_u, normal.y / self.alpha_v);
            let q = x * x + y * y + normal.z * normal.z;
            FRAC_1_PI / (self.alpha_u * q * (self.alpha_v * q))
        } else {
            0.0
        }
    }

    #[inline(always)]
    fn lambda(&self, direction: Vec3) -> f32 {
        let (x, y) = (self.alpha_u * direction.x, self.alpha_v * direction.y);
        // (√(1 + t) − 1)/2 = t / (2(√(1 + t) + 1)), which does not cancel for small t.
        let t = (x * x + y * y) / (direction.z * direction.z);
        if t < f32::MAX {
            0.5 * t / ((1.0 + t).sqrt() + 1.0)
        } else {
            f32::MAX
        }
    }

    #[inline(always)]
    fn masking(&self, direction: Vec3) -> f32 {
        let z = direction.z.abs();
        let length = self.stretch(direction).length();
        if length > 0.0 { 2.0 * z / (z + length) } else { 0.0 }
    }

    #[inline(always)]
    fn masking_shadowing(&self, a: Vec3, b: Vec3) -> f32 {
        // 1 + Λ = (z + l)/2z for the stretched length l; over the common denominator nothing
        // diverges.
        let (za, zb) = (a.z.abs(), b.z.abs());
        let denominator = zb * self.stretch(a).length() + za * self.stretch(b).length();
        if denominator > 0.0 {
            2.0 * za * zb / denominator
        } else {
            0.0
        }
    }

    #[inline(always)]
    fn sample_visible_normal(&self, view: Vec3, u: [f32; 2]) -> Vec3 {
        let view = self.stretched_view(view);
        // A direction c on the cap: 1 − c_z = u₁ (1 + ω̂_z), uniform by Archimedes' theorem.
        // Nothing here cancels towards the cap's rim, where c is opposite to ω̂: c_z + ω̂_z =
        // (1 − u₁)(1 + ω̂_z), and sin² θ_c = (1 − c_z)(1 + c_z) with 1 + c_z = (c_z +
        // ω̂_z) + (1 − ω̂_z).
        let above = u[1] * (1.0 + view.z);
        let sum_z = (1.0 - u[1]).max(0.5 * f32::EPSILON) * (1.0 + view.z);
        let one_minus_view_z = (view.x * view.x + view.y * view.y) / (1.0 + view.z);
        let sin_theta = (above * (sum_z + one_minus_view_z)).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u[0]);
        let half = Vec3::new(sin_theta * cos_phi + view.x, sin_theta * sin_phi + view.y, sum_z);
        self.stretch(half).normalize_or(Vec3::Z)
    }

    #[inline(always)]
    fn visible_normal_density(&self, view: Vec3, normal: Vec3) -> Density<SolidAngle> {
        let view = Vec3::new(view.x, view.y, view.z.max(0.0));
        // G₁/cos θ = 2/(z + l): finite at grazing angles.
        let denominator = view.z + self.stretch(view).length();
        let facing = view.dot(normal);
        if facing > 0.0 && denominator > 0.0 {
            Density::new(2.0 * facing * self.normal_density(normal) / denominator)
        } else {
            Density::ZERO
        }
    }

    #[inline]
    fn invert_visible_normal(&self, view: Vec3, normal: Vec3) -> Option<[f32; 2]> {
        let view = self.stretched_view(view);
        let half = Vec3::new(normal.x / self.alpha_u, normal.y / self.alpha_v, normal.z).try_normalize()?;
        let facing = view.dot(half);
        if !(facing > 0.0 && half.z > 0.0) {
            return None;
        }
        // c = 2(ω̂·h)h − ω̂ and c_z + ω̂_z = (1 − u₁)(1 + ω̂_z).
        let cap = 2.0 * facing * half - view;
        let remainder = 2.0 * facing * half.z / (1.0 + view.z);
        Some([
            turns_of(cap.x, cap.y),
            (1.0 - remainder).clamp(0.0, ONE_MINUS_EPSILON),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::microfacet::tests::{
        check_against_oracle, check_axes, check_distribution, check_visible_normals,
    };
    use crate::warp::properties::assert_frozen;
    use lightshed_testkit::check_faults;

    #[test]
    fn properties_hold() {
        check_visible_normals("GGX", |alpha| Ggx::new(alpha[0], alpha[1]));
    }

    #[test]
    fn masking_and_projection_agree() {
        check_distribution(Ggx::new(0.2, 0.7));
        check_distribution(Ggx::new(1.5, 1.0));
    }

    #[test]
    fn exchanged_axes_are_noticed() {
        check_axes(|alpha| Ggx::new(alpha[0], alpha[1]));
    }

    #[test]
    fn agrees_with_the_formulas_in_double_precision() {
        let density = |alpha: [f64; 2], m: [f64; 3]| {
            let tan_squared = ((m[0] / alpha[0]).powi(2) + (m[1] / alpha[1]).powi(2)) / m[2].powi(2);
            1.0 / (core::f64::consts::PI * alpha[0] * alpha[1] * m[2].powi(4) * (1.0 + tan_squared).powi(2))
        };
        // a = 1/(α tan θ)
        let lambda = |a: f64| 0.5 * ((1.0 + 1.0 / (a * a)).sqrt() - 1.0);
        // One of the two is a hundredth of a per cent too large.
        check_faults(&[[1.0001, 1.0], [1.0, 1.0001]], |fault| {
            let [scale_density, scale_lambda] = fault.unwrap_or([1.0, 1.0]);
            check_against_oracle(
                |alpha| Ggx::new(alpha[0], alpha[1]),
                |alpha, m| scale_density * density(alpha, m),
                |a| scale_lambda * lambda(a),
            );
            Ok::<_, ()>(())
        })
        .unwrap();
    }

    #[test]
    fn values_are_stable() {
        let view = Vec3::new(0.6, 0.0, 0.8);
        assert_frozen(
            |u| Ggx::new(0.2, 0.5).sample_visible_normal(view, u),
            [
                Vec3::new(0.09828211, 0.1451726, 0.9845128),
                Vec3::new(-0.27903512, 0.0, 0.9602809),
                Vec3::new(0.09483506, -0.2557795, 0.9620724),
            ],
        );
    }
}
