//! The Beckmann normal distribution.
//!
//! `D(m) = exp(−tan²) / (π α_u α_v cos⁴θ_m)` with
//! `tan² = ((m_x/α_u)² + (m_y/α_v)²)/m_z²`: slopes are normal. With
//! `a = ω_z/√(α_u²ω_x² + α_v²ω_y²)`, `Λ(ω) = (e^{−a²}/(a√π) − erfc(a))/2`
//! (Heitz 2014, eq. 72).
//!
//! Visible normals (Heitz and d'Eon 2014): stretching by `(α_u, α_v, 1)` leaves unit roughness.
//! In the plane of incidence of the stretched view (cosine `c`, sine `s`), the slope `x` towards
//! the viewer has the density `max(0, c − s x) e^{−x²}/√π` up to the factor
//! `1/(c (1 + Λ))`, and the one across is normal. The former is inverted by a safeguarded Newton
//! iteration on
//!
//! `F(x) = (c erfc(−x) + s e^{−x²}/√π) / (c erfc(−a) + s e^{−a²}/√π)`,
//! `x ≤ a = c/s`,
//!
//! in `f64`: as `x → −∞` or at grazing angles its terms cancel.

use super::erf::{EDGE, erf, erfc, inverse_erf_estimate, inverse_erf_of_uniform, scaled_erfc};
use super::microfacet::{MicrofacetDistribution, clamp_alpha};
use crate::{Density, ONE_MINUS_EPSILON, SolidAngle};
use core::f32::consts::FRAC_1_PI;
use core::f64::consts::FRAC_2_SQRT_PI;
use glam::{Vec2, Vec3};

/// `1/√π`.
const FRAC_1_SQRT_PI: f64 = 0.5 * FRAC_2_SQRT_PI;

/// Slopes beyond this many standard deviations (times √2) never occur: their probability is below
/// 10⁻¹⁵.
const MAX_SLOPE: f64 = 5.8;

/// Beckmann with roughness `α_u` along x and `α_v` along y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beckmann {
    alpha_u: f32,
    alpha_v: f32,
}

/// A view direction after stretching: its azimuth as a unit vector, and sine and cosine of its
/// angle to z.
struct StretchedView {
    azimuth: Vec2,
    sin: f64,
    cos: f64,
}

impl Beckmann {
    /// Roughness as it stands in `D`: √2 times the root mean square of the slope. Each is clamped
    /// to [10⁻⁴, 10³]; NaN becomes 10⁻⁴.
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

    #[inline]
    fn stretched_length(&self, direction: Vec3) -> f32 {
        Vec2::new(self.alpha_u * direction.x, self.alpha_v * direction.y).length()
    }

    /// `|z| (1 + Λ)`, the projected area of the facets that face the direction; finite at grazing
    /// angles.
    #[inline]
    fn facing_area(&self, direction: Vec3) -> f32 {
        facing_area(
            f64::from(direction.z.abs()),
            f64::from(self.stretched_length(direction)),
        ) as f32
    }

    fn stretched_view(&self, view: Vec3) -> StretchedView {
        let across = Vec2::new(self.alpha_u * view.x, self.alpha_v * view.y);
        let (sin, cos) = (f64::from(across.length()), f64::from(view.z.max(0.0)));
        let length = sin.hypot(cos);
        if length > 0.0 {
            StretchedView {
                azimuth: across.normalize_or(Vec2::X),
                sin: sin / length,
                cos: cos / length,
            }
        } else {
            StretchedView {
                azimuth: Vec2::X,
                sin: 0.0,
                cos: 1.0,
            }
        }
    }
}

/// `½ (c erfc(−a) + s e^{−a²}/√π)` with `a = c/s`.
fn facing_area(c: f64, s: f64) -> f64 {
    // Beyond this, no slope faces away: the surface is flat to all digits.
    if c > 8.0 * s {
        return c;
    }
    if s > 0.0 { partial_area(c, s, c / s) } else { 0.0 }
}

/// `½ (c erfc(−x) + s e^{−x²}/√π) = ∫_{−∞}^x (c − s t) e^{−t²}/√π dt`.
#[inline]
fn partial_area(c: f64, s: f64, x: f64) -> f64 {
    partial_area_and_gaussian(c, s, x).0
}

/// `partial_area`, and the `e^{−x²}` that its terms share.
#[inline]
fn partial_area_and_gaussian(c: f64, s: f64, x: f64) -> (f64, f64) {
    let y = x.abs().min(8.0);
    let gaussian = (-y * y).exp();
    let tail = gaussian * scaled_erfc(y);
    let below = if x > 0.0 { 2.0 - tail } else { tail };
    (0.5 * (c * below + s * FRAC_1_SQRT_PI * gaussian), gaussian)
}

/// The slope `x` at which the share `u` of the facing area lies below; about four steps.
fn visible_slope(c: f64, s: f64, u: f64) -> f64 {
    let u = u.clamp(EDGE, 1.0 - EDGE);
    let target = u * facing_area(c, s);
    let (mut low, mut high) = (-MAX_SLOPE, if c < MAX_SLOPE * s { c / s } else { MAX_SLOPE });
    // At normal incidence the slope is normal, at grazing incidence F = e^{−x²} for x < 0. In
    // between their mean lies too high by about a third of s c.
    let grazing = -(-u.ln()).sqrt();
    let start = c * inverse_erf_estimate(u) + (1.0 - c) * grazing - 0.35 * s * c;
    let mut x = start.clamp(low, high);
    for _ in 0..60 {
        let (area, gaussian) = partial_area_and_gaussian(c, s, x);
        let excess = area - target;
        if excess > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let slope = (c - s * x).max(0.0) * FRAC_1_SQRT_PI * gaussian;
        let newton = x - excess / slope;
        if newton >= low && newton <= high {
            let step = (newton - x).abs();
            x = newton;
            // The error is the square of the last step, about.
            if step < 1e-5 {
                break;
            }
        } else {
            x = 0.5 * (low + high);
            if high - low < 1e-9 {
                break;
            }
        }
    }
    x
}

impl MicrofacetDistribution for Beckmann {
    #[inline]
    fn normal_density(&self, normal: Vec3) -> f32 {
        if !(normal.z > 0.0) {
            return 0.0;
        }
        let (x, y) = (normal.x / self.alpha_u, normal.y / self.alpha_v);
        let z_squared = normal.z * normal.z;
        let exponent = (x * x + y * y) / z_squared;
        // Beyond, the result is below 10⁻³⁰ and its factors over- and underflow.
        if exponent < 80.0 {
            (-exponent).exp() * FRAC_1_PI / (self.alpha_u * z_squared * (self.alpha_v * z_squared))
        } else {
            0.0
        }
    }

    #[inline]
    fn lambda(&self, direction: Vec3) -> f32 {
        let z = direction.z.abs();
        let length = self.stretched_length(direction);
        if z > 8.0 * length && z > 0.0 {
            return 0.0;
        }
        let a = f64::from(z) / f64::from(length);
        if a > 1e-38 {
            (0.5 * (FRAC_1_SQRT_PI * (-a * a).exp() / a - erfc(a))).clamp(0.0, f64::from(f32::MAX)) as f32
        } else {
            f32::MAX
        }
    }

    #[inline]
    fn masking(&self, direction: Vec3) -> f32 {
        let area = self.facing_area(direction);
        if area > 0.0 {
            (direction.z.abs() / area).min(1.0)
        } else {
            0.0
        }
    }

    #[inline]
    fn masking_shadowing(&self, a: Vec3, b: Vec3) -> f32 {
        // With A = z (1 + Λ): 1/(1 + Λ_a + Λ_b) = z_a z_b / (z_b A_a + z_a A_b − z_a z_b),
        // which is finite throughout.
        let (za, zb) = (a.z.abs(), b.z.abs());
        let denominator = (zb * self.facing_area(a) + za * self.facing_area(b)) - za * zb;
        if denominator > 0.0 {
            (za * zb / denominator).min(1.0)
        } else {
            0.0
        }
    }

    fn sample_visible_normal(&self, view: Vec3, u: [f32; 2]) -> Vec3 {
        let view = self.stretched_view(view);
        let towards = visible_slope(view.cos, view.sin, f64::from(u[0])) as f32;
        let across = inverse_erf_of_uniform(f64::from(u[1])) as f32;
        // Back to the axes, and unstretched; the normal of slopes (p, q) is along (−p, −q, 1).
        let p = towards * view.azimuth.x - across * view.azimuth.y;
        let q = towards * view.azimuth.y + across * view.azimuth.x;
        Vec3::new(-self.alpha_u * p, -self.alpha_v * q, 1.0).normalize_or(Vec3::Z)
    }

    #[inline]
    fn visible_normal_density(&self, view: Vec3, normal: Vec3) -> Density<SolidAngle> {
        let view = Vec3::new(view.x, view.y, view.z.max(0.0));
        let area = self.facing_area(view);
        let facing = view.dot(normal);
        if facing > 0.0 && area > 0.0 {
            Density::new(facing * self.normal_density(normal) / area)
        } else {
            Density::ZERO
        }
    }

    fn invert_visible_normal(&self, view: Vec3, normal: Vec3) -> Option<[f32; 2]> {
        if !(normal.z > 0.0 && self.visible_normal_density(view, normal).is_positive()) {
            return None;
        }
        let view = self.stretched_view(view);
        let slope = Vec2::new(-normal.x / self.alpha_u, -normal.y / self.alpha_v) / normal.z;
        let towards = f64::from(slope.dot(view.azimuth));
        let across = f64::from(view.azimuth.perp_dot(slope));
        let share = partial_area(view.cos, view.sin, towards) / facing_area(view.cos, view.sin);
        let u = [share, 0.5 + 0.5 * erf(across)];
        Some(u.map(|x| (x as f32).clamp(0.0, ONE_MINUS_EPSILON)))
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
        check_visible_normals("Beckmann", |alpha| Beckmann::new(alpha[0], alpha[1]));
    }

    #[test]
    fn masking_and_projection_agree() {
        check_distribution(Beckmann::new(0.2, 0.7));
        check_distribution(Beckmann::new(1.5, 1.0));
    }

    #[test]
    fn exchanged_axes_are_noticed() {
        check_axes(|alpha| Beckmann::new(alpha[0], alpha[1]));
    }

    #[test]
    fn agrees_with_the_formulas_in_double_precision() {
        let density = |alpha: [f64; 2], m: [f64; 3]| {
            let tan_squared = ((m[0] / alpha[0]).powi(2) + (m[1] / alpha[1]).powi(2)) / m[2].powi(2);
            (-tan_squared).exp() / (core::f64::consts::PI * alpha[0] * alpha[1] * m[2].powi(4))
        };
        // Λ(a) = ∫_a^∞ (t/a − 1) e^{−t²}/√π dt, the masked slopes.
        let lambda = |a: f64| {
            let masked = |t: f64| (t / a - 1.0) * FRAC_1_SQRT_PI * (-t * t).exp();
            lightshed_testkit::integrate(masked, a, a + 8.0, 1e-14).value
        };
        // One of the two is a hundredth of a per cent too large.
        check_faults(&[[1.0001, 1.0], [1.0, 1.0001]], |fault| {
            let [scale_density, scale_lambda] = fault.unwrap_or([1.0, 1.0]);
            check_against_oracle(
                |alpha| Beckmann::new(alpha[0], alpha[1]),
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
            |u| Beckmann::new(0.2, 0.5).sample_visible_normal(view, u),
            [
                Vec3::new(0.18395598, 0.2803328, 0.9421113),
                Vec3::new(0.014535102, -0.23193929, 0.9726217),
                Vec3::new(-0.12751223, 0.18080878, 0.97521734),
            ],
        );
    }
}
