//! What microfacet normal distributions have in common.
//!
//! A microsurface over the plane `z = 0` has normals `m` with density `D(m)`, in microsurface area per solid angle and per
//! macrosurface area: `∫ D(m) (m·z) dm = 1`. Seen from the unit direction `ω`, a share `G₁(ω) = 1/(1 + Λ(ω))` of what
//! faces the viewer is not masked (Smith 1967, for heights and slopes that are independent), and the normals that
//! are *seen* have the density (Heitz 2014, eq. 16)
//!
//! `D_ω(m) = G₁(ω) max(0, ω·m) D(m) / cos θ_ω`, `∫ D_ω(m) dm = 1`, per solid angle of `m`.
//!
//! Reflection about a visible normal maps solid angle by `dω_i = 4 |ω·m| dm`, so the reflected direction has density
//! `D_ω(m) / (4 |ω·m|)`.

use crate::{Density, SolidAngle};
use glam::Vec3;

/// A normal distribution of a microsurface that is stretched along the local x and y axes, with Smith masking. All
/// directions are unit vectors in the local frame, z along the macrosurface's normal.
///
/// The view direction `ω` of every method counts by `|z|` where only masking is at stake; in those about visible
/// normals a `z` below zero is taken as zero (seen from below there is nothing to see: flip the frame first).
pub trait MicrofacetDistribution {
    /// `D(m)`, per solid angle; 0 at and below the horizon.
    fn normal_density(&self, normal: Vec3) -> f32;

    /// `Λ(ω)`: the masked area over the unmasked, ≥ 0, without a unit. Saturates at `f32::MAX` for grazing directions.
    fn lambda(&self, direction: Vec3) -> f32;

    /// `G₁(ω) = 1/(1 + Λ(ω))`, in [0, 1]. Whether `ω` and the normal lie on the same side is for the caller to ask.
    fn masking(&self, direction: Vec3) -> f32;

    /// `G₂ = 1/(1 + Λ(ω_a) + Λ(ω_b))`, masking and shadowing that are correlated by height (Heitz 2014, eq. 99), in
    /// [0, 1].
    fn masking_shadowing(&self, a: Vec3, b: Vec3) -> f32;

    /// A normal visible from `view`, for `u` in [0, 1)²; a unit vector with `z > 0`.
    fn sample_visible_normal(&self, view: Vec3, u: [f32; 2]) -> Vec3;

    /// Density of [`MicrofacetDistribution::sample_visible_normal`] per solid angle of the *normal*, `D_ω(m)`.
    fn visible_normal_density(&self, view: Vec3, normal: Vec3) -> Density<SolidAngle>;

    /// The `u` that [`MicrofacetDistribution::sample_visible_normal`] maps to `normal`; `None` where its density is zero.
    fn invert_visible_normal(&self, view: Vec3, normal: Vec3) -> Option<[f32; 2]>;
}

/// Roughness below this is treated as this: `f32` directions cannot resolve narrower lobes. Treat such surfaces as smooth.
pub(crate) const MIN_ALPHA: f32 = 1e-4;

/// Roughness above this is treated as this.
pub(crate) const MAX_ALPHA: f32 = 1e3;

/// Roughness in the range that the distributions keep finite; NaN becomes the smallest.
#[inline(always)]
pub(crate) fn clamp_alpha(alpha: f32) -> f32 {
    alpha.max(MIN_ALPHA).min(MAX_ALPHA)
}
