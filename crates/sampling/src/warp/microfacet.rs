//! What microfacet normal distributions have in common.
//!
//! A microsurface over the plane `z = 0` has normals `m` with density `D(m)`, in microsurface area per solid
//! angle and per macrosurface area: `∫ D(m) (m·z) dm = 1`. Seen from the unit direction `ω`, a share
//! `G₁(ω) = 1/(1 + Λ(ω))` of what faces the viewer is not masked (Smith 1967, for heights and slopes that are
//! independent), and the normals that are *seen* have the density (Heitz 2014, eq. 16)
//!
//! `D_ω(m) = G₁(ω) max(0, ω·m) D(m) / cos θ_ω`, `∫ D_ω(m) dm = 1`, per solid angle of `m`.
//!
//! Reflection about a visible normal maps solid angle by `dω_i = 4 |ω·m| dm`, so the reflected direction has
//! density `D_ω(m) / (4 |ω·m|)`.

use super::clamp_or_low;
use crate::{Density, SolidAngle};
use glam::Vec3;

/// A normal distribution of a microsurface that is stretched along the local x and y axes, with Smith
/// masking. All directions are unit vectors in the local frame, z along the macrosurface's normal.
///
/// The view direction `ω` of every method counts by `|z|` where only masking is at stake; in those about
/// visible normals a `z` below zero is taken as zero (seen from below there is nothing to see: flip the frame
/// first).
pub trait MicrofacetDistribution {
    /// `D(m)`, per solid angle; 0 at and below the horizon.
    fn normal_density(&self, normal: Vec3) -> f32;

    /// `Λ(ω)`: the masked area over the unmasked, ≥ 0, without a unit. Saturates at `f32::MAX` for grazing
    /// directions.
    fn lambda(&self, direction: Vec3) -> f32;

    /// `G₁(ω) = 1/(1 + Λ(ω))`, in [0, 1]. Whether `ω` and the normal lie on the same side is for the caller
    /// to ask.
    fn masking(&self, direction: Vec3) -> f32;

    /// `G₂ = 1/(1 + Λ(ω_a) + Λ(ω_b))`, masking and shadowing that are correlated by height (Heitz 2014, eq.
    /// 99), in [0, 1].
    fn masking_shadowing(&self, a: Vec3, b: Vec3) -> f32;

    /// A normal visible from `view`, for `u` in [0, 1)²; a unit vector with `z > 0`.
    fn sample_visible_normal(&self, view: Vec3, u: [f32; 2]) -> Vec3;

    /// Density of [`MicrofacetDistribution::sample_visible_normal`] per solid angle of the *normal*,
    /// `D_ω(m)`.
    fn visible_normal_density(&self, view: Vec3, normal: Vec3) -> Density<SolidAngle>;

    /// The `u` that [`MicrofacetDistribution::sample_visible_normal`] maps to `normal`; `None` where its
    /// density is zero.
    fn invert_visible_normal(&self, view: Vec3, normal: Vec3) -> Option<[f32; 2]>;
}

/// Roughness below this is treated as this: `f32` directions cannot resolve narrower lobes. Treat such
/// surfaces as smooth.
pub(crate) const MIN_ALPHA: f32 = 1e-4;

/// Roughness above this is treated as this.
pub(crate) const MAX_ALPHA: f32 = 1e3;

/// Roughness in the range that the distributions keep finite; NaN becomes the smallest.
#[inline(always)]
pub(crate) fn clamp_alpha(alpha: f32) -> f32 {
    clamp_or_low(alpha, MIN_ALPHA, MAX_ALPHA)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::warp::properties::{Case, Chart};
    use core::f64::consts::FRAC_PI_2;
    use lightshed_testkit::{hostile_f32, hostile_unit_f32, integrate_hemisphere};

    /// The visible normals of a distribution of roughness `alpha` as a case for
    /// [`verify`](super::super::properties::verify).
    pub(crate) fn visible_normal_case(
        name: String,
        distribution: impl MicrofacetDistribution + Copy + 'static,
        view: Vec3,
        alpha: [f32; 2],
    ) -> Case {
        let view = view.normalize();
        let width = f64::from(alpha[0].min(alpha[1])).min(1.0);
        // Normals at right angles to the view have density zero; rounding takes samples there.
        Case {
            rounds_off_support: true,
            ..Case::directions(
                name,
                Chart::cap(Vec3::Z, width, FRAC_PI_2),
                move |u| distribution.sample_visible_normal(view, u),
                move |m| distribution.visible_normal_density(view, m).value(),
                move |m| distribution.invert_visible_normal(view, m),
            )
        }
    }

    /// `∫ D(m) cos θ_m dm = 1`, `∫ D(m) max(0, ω·m) dm = cos θ_ω (1 + Λ(ω))` (Heitz 2014, eqs. 7 and 8), and
    /// the relations among `Λ`, `G₁` and `G₂`; then hostile input.
    pub(crate) fn check_distribution(distribution: impl MicrofacetDistribution) {
        let vec3 = |d: [f64; 3]| Vec3::from_array(d.map(|x| x as f32));
        let area = integrate_hemisphere(|m| m[2] * f64::from(distribution.normal_density(vec3(m))), 1e-5);
        assert!((area.value - 1.0).abs() < 3e-5, "projected area {area:?}");
        let views = [
            [0.0, 0.0, 1.0],
            [0.6, 0.0, 0.8],
            [-0.3, 0.9, 0.2],
            [0.1, -0.99, 0.01],
        ];
        for view in views.map(|v| Vec3::from_array(v).normalize()) {
            let facing = |m: [f64; 3]| {
                f64::from(view.dot(vec3(m)).max(0.0)) * f64::from(distribution.normal_density(vec3(m)))
            };
            let seen = integrate_hemisphere(facing, 1e-5).value;
            let lambda = distribution.lambda(view);
            let expected = f64::from(view.z) * (1.0 + f64::from(lambda));
            assert!(
                (seen - expected).abs() < 5e-5,
                "{view}: {seen} against {expected}"
            );
            let masking = distribution.masking(view);
            assert!(
                (masking * (1.0 + lambda) - 1.0).abs() < 1e-5,
                "{view}: {masking} {lambda}"
            );
            for other in views.map(|v| Vec3::from_array(v).normalize()) {
                let both = distribution.masking_shadowing(view, other);
                let expected = 1.0 / (1.0 + lambda + distribution.lambda(other));
                assert!(
                    (both - expected).abs() < 1e-5 * expected,
                    "{view} {other}: {both} {expected}"
                );
                assert_eq!(both, distribution.masking_shadowing(other, view));
            }
        }
        check_hostile(&distribution);
    }

    fn check_hostile(distribution: &impl MicrofacetDistribution) {
        let mut directions = vec![Vec3::ZERO, Vec3::X, -Vec3::Z, Vec3::Z, -Vec3::Y];
        for small in hostile_f32().filter(|x| x.abs() <= 1.0) {
            directions.push(Vec3::new((1.0 - small * small).max(0.0).sqrt(), 0.0, small));
            directions.push(Vec3::new(
                small,
                small,
                (1.0 - 2.0 * small * small).max(0.0).sqrt(),
            ));
        }
        for &view in &directions {
            assert!(distribution.lambda(view).is_finite(), "{view}");
            assert!((0.0..=1.0 + 1e-6).contains(&distribution.masking(view)), "{view}");
            for &other in &directions {
                let both = distribution.masking_shadowing(view, other);
                assert!((0.0..=1.0 + 1e-6).contains(&both), "{view} {other} {both}");
                assert!(
                    distribution
                        .visible_normal_density(view, other)
                        .value()
                        .is_finite()
                );
                if let Some(u) = distribution.invert_visible_normal(view, other) {
                    assert!(u.iter().all(|x| (0.0..1.0).contains(x)), "{view} {other} {u:?}");
                }
            }
            for u in hostile_unit_f32().flat_map(|a| hostile_unit_f32().map(move |b| [a, b])) {
                let normal = distribution.sample_visible_normal(view, u);
                assert!(
                    (normal.length() - 1.0).abs() < 1e-6 && normal.z > 0.0,
                    "{view} {u:?} {normal}"
                );
            }
        }
    }
}
