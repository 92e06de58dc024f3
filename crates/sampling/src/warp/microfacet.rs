//! The interface of microfacet normal distributions.
//!
//! A microsurface over the plane `z = 0` has normals `m` with density `D(m)`, in microsurface area
//! per solid angle and per macrosurface area: `∫ D(m) (m·z) dm = 1`. Seen from the unit
//! direction `ω`, a share `G₁(ω) = 1/(1 + Λ(ω))` of the facets that face the viewer is
//! unmasked (Smith 1967, for independent heights and slopes), and the *visible* normals have the
//! density (Heitz 2014, eq. 16)
//!
//! `D_ω(m) = G₁(ω) max(0, ω·m) D(m) / cos θ_ω`, `∫ D_ω(m) dm = 1`, per solid angle of
//! `m`.
//!
//! Reflection about a visible normal maps solid angle by `dω_i = 4 |ω·m| dm`, so the reflected
//! direction has density `D_ω(m) / (4 |ω·m|)`.

use super::clamp_or_low;
use crate::{Density, SolidAngle};
use glam::Vec3;

/// A normal distribution of a microsurface that is stretched along the local x and y axes, with
/// Smith masking. All directions are unit vectors in the local frame, z along the macrosurface's
/// normal.
///
/// Where only masking matters, the view direction `ω` counts by `|z|`. In functions of visible
/// normals a `z` below zero is taken as zero: nothing is visible from below, so flip the frame
/// first.
///
/// ```
/// use lightshed_sampling::{Density, Ggx, MicrofacetDistribution, SolidAngle, glam::Vec3};
///
/// // Reflection off a rough surface: sample a visible normal, reflect about it.
/// let (ggx, view) = (Ggx::new(0.2, 0.4), Vec3::new(0.6, 0.0, 0.8));
/// let normal = ggx.sample_visible_normal(view, [0.3, 0.7]);
/// let light = 2.0 * view.dot(normal) * normal - view;
/// let density: Density<SolidAngle> = ggx.visible_normal_density(view, normal) * (0.25 / view.dot(normal));
///
/// // BRDF × cosine over density is G₂/G₁: the weight never exceeds one.
/// let brdf = ggx.normal_density(normal) * ggx.masking_shadowing(view, light) / (4.0 * view.z * light.z);
/// let weight = brdf * light.z / density.value();
/// assert!((weight - ggx.masking_shadowing(view, light) / ggx.masking(view)).abs() < 1e-5);
/// ```
pub trait MicrofacetDistribution {
    /// `D(m)`, per solid angle; 0 at and below the horizon.
    fn normal_density(&self, normal: Vec3) -> f32;

    /// `Λ(ω)`: the masked area over the unmasked, ≥ 0, without a unit. Saturates at `f32::MAX`
    /// for grazing directions.
    fn lambda(&self, direction: Vec3) -> f32;

    /// `G₁(ω) = 1/(1 + Λ(ω))`, in [0, 1]. The caller checks whether `ω` and the normal lie on
    /// the same side.
    fn masking(&self, direction: Vec3) -> f32;

    /// `G₂ = 1/(1 + Λ(ω_a) + Λ(ω_b))`, height-correlated masking and shadowing (Heitz 2014,
    /// eq. 99), in [0, 1].
    fn masking_shadowing(&self, a: Vec3, b: Vec3) -> f32;

    /// A normal visible from `view`, for `u` in [0, 1)²; a unit vector with `z > 0`.
    fn sample_visible_normal(&self, view: Vec3, u: [f32; 2]) -> Vec3;

    /// Density of [`MicrofacetDistribution::sample_visible_normal`] per solid angle of the
    /// *normal*, `D_ω(m)`.
    fn visible_normal_density(&self, view: Vec3, normal: Vec3) -> Density<SolidAngle>;

    /// The `u` that [`MicrofacetDistribution::sample_visible_normal`] maps to `normal`; `None`
    /// where its density is zero.
    fn invert_visible_normal(&self, view: Vec3, normal: Vec3) -> Option<[f32; 2]>;
}

/// Roughness below this value is clamped to it: `f32` directions cannot resolve narrower lobes.
/// Treat such surfaces as smooth.
pub(crate) const MIN_ALPHA: f32 = 1e-4;

/// Roughness above this value is clamped to it.
pub(crate) const MAX_ALPHA: f32 = 1e3;

/// Roughness in the range that the distributions keep finite; NaN becomes the smallest.
#[inline(always)]
pub(crate) fn clamp_alpha(alpha: f32) -> f32 {
    clamp_or_low(alpha, MIN_ALPHA, MAX_ALPHA)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::warp::properties::verify;
    use crate::warp::properties::{Case, Chart};
    use core::f64::consts::FRAC_PI_2;
    use lightshed_testkit::{
        check_faults, hostile_f32, hostile_unit_f32, integrate_hemisphere, rng, uniform_f32,
    };

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

    /// [`verify`]s the visible normals of `distribution` from wide to narrow, isotropic and not,
    /// from above to grazing.
    pub(crate) fn check_visible_normals<D: MicrofacetDistribution + Copy + 'static>(
        name: &str,
        distribution: impl Fn([f32; 2]) -> D,
    ) {
        for (alpha, view, (integral, jacobian, inverse)) in [
            ([0.3, 0.3], [0.0, 0.0, 1.0], (1e-5, 1e-3, 2e-6)),
            ([0.1, 0.6], [0.6, 0.0, 0.8], (1e-5, 2e-3, 4e-6)),
            ([0.6, 0.1], [0.5, -0.7, 0.2], (1e-5, 2e-3, 4e-6)),
            ([1.0, 1.0], [-0.8, 0.1, 1e-3], (1e-5, 2e-3, 4e-6)),
            ([0.01, 0.01], [0.3, 0.4, 0.6], (1e-5, 2e-3, 5e-5)),
            ([1e-4, 1e-3], [0.1, -0.2, 0.9], (1e-4, 2e-3, 5e-5)),
        ] {
            let name = format!("{name} {alpha:?} {view:?}");
            let case = visible_normal_case(name, distribution(alpha), Vec3::from_array(view), alpha);
            verify(&case.tolerances(integral, jacobian, inverse));
        }
    }

    /// `∫ D(m) cos θ_m dm = 1`, `∫ D(m) max(0, ω·m) dm = cos θ_ω (1 + Λ(ω))` (Heitz
    /// 2014, eqs. 7 and 8), and the relations among `Λ`, `G₁` and `G₂`; then hostile input.
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

    /// The properties hold. They fail if the density exchanges the roughness of the axes, forgets
    /// masking, or uses the distribution of all normals instead of the visible ones.
    pub(crate) fn check_axes<D: MicrofacetDistribution + Copy + 'static>(new: impl Fn([f32; 2]) -> D) {
        #[derive(Clone, Copy, Debug)]
        enum Fault {
            ExchangedAxes,
            NoMasking,
            AllNormals,
        }
        let (alpha, view) = ([0.2, 0.7], Vec3::new(0.48, 0.64, 0.6));
        let faults = [Fault::ExchangedAxes, Fault::NoMasking, Fault::AllNormals];
        check_faults(&faults, |fault| {
            let (right, wrong) = (new(alpha), new([alpha[1], alpha[0]]));
            let mut case = visible_normal_case("planted".to_owned(), right, view, alpha);
            match fault {
                None => {}
                Some(Fault::ExchangedAxes) => {
                    case.density = Box::new(move |m| wrong.visible_normal_density(view, m).value());
                }
                Some(Fault::NoMasking) => {
                    case.density = Box::new(move |m| {
                        right.visible_normal_density(view, m).value() / right.masking(view)
                    });
                }
                Some(Fault::AllNormals) => case.density = Box::new(move |m| right.normal_density(m) * m.z),
            }
            verify(&case.tolerances(1e-5, 2e-3, 1e-5));
            Ok::<_, ()>(())
        })
        .unwrap();
    }

    /// `D`, `Λ`, `G₁`, `G₂` and `D_ω` against the textbook's formulas in `f64`, at every
    /// roughness and down to grazing angles: relative error below 10⁻⁵. `lambda` is a function
    /// of `a = cot θ/α`, `α` along the azimuth.
    pub(crate) fn check_against_oracle<D: MicrofacetDistribution>(
        new: impl Fn([f32; 2]) -> D,
        density: impl Fn([f64; 2], [f64; 3]) -> f64,
        lambda: impl Fn(f64) -> f64,
    ) {
        let mut rng = rng(0xface);
        let close = |computed: f32, truth: f64| {
            // Nothing is checked where the truth itself has no digits left.
            (f64::from(computed) - truth).abs() <= 1e-5 * truth.abs() + 1e-30
        };
        for alpha in [[1e-4f32, 1e-4], [1e-3, 0.1], [0.3, 0.05], [1.0, 0.5], [3.0, 1.0]] {
            let distribution = new(alpha);
            let wide = alpha.map(f64::from);
            let true_lambda = |w: Vec3| {
                let w = w.to_array().map(f64::from);
                lambda(w[2].abs() / (wide[0] * w[0]).hypot(wide[1] * w[1]))
            };
            for k in 0..200 {
                // Every other pair of directions is close to grazing.
                let squeeze = if k % 2 == 0 { 1.0 } else { 0.01 };
                let mut direction = || {
                    let [x, y, z] = [(); 3].map(|()| uniform_f32(&mut rng));
                    Vec3::new(x - 0.5, y - 0.5, squeeze * (z + 0.01)).normalize()
                };
                let (a, b) = (direction(), direction());
                let normal =
                    distribution.sample_visible_normal(a, [uniform_f32(&mut rng), uniform_f32(&mut rng)]);
                let (la, lb) = (true_lambda(a), true_lambda(b));
                let d = density(wide, normal.to_array().map(f64::from));
                let facing: f64 = (0..3).map(|i| f64::from(a[i]) * f64::from(normal[i])).sum();
                let seen = facing.max(0.0) * d / ((1.0 + la) * f64::from(a.z));
                assert!(
                    close(distribution.normal_density(normal), d),
                    "D: {alpha:?} {normal}"
                );
                // Λ is a small difference where there is little masking; only 1 + Λ is used.
                assert!(close(1.0 + distribution.lambda(a), 1.0 + la), "Λ: {alpha:?} {a}");
                assert!(
                    close(distribution.masking(a), 1.0 / (1.0 + la)),
                    "G1: {alpha:?} {a}"
                );
                assert!(
                    close(distribution.masking_shadowing(a, b), 1.0 / (1.0 + la + lb)),
                    "G2: {alpha:?} {a} {b}"
                );
                // The cosine to the normal cancels where they are nearly at right angles.
                if facing > 1e-2 {
                    let computed = distribution.visible_normal_density(a, normal).value();
                    assert!(close(computed, seen), "{alpha:?} {a} {normal}: {computed} {seen}");
                }
            }
        }
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
