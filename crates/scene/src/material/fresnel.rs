//! Reflectance of smooth interfaces (unpolarised Fresnel equations).

use crate::Rgb;
use lightshed_lanes::{Lanes, Vec3Lanes};

/// Reflection and refraction of a smooth dielectric interface at one angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DielectricFresnel {
    /// Share of radiant power that is reflected, `F ∈ [0, 1]`.
    pub reflectance: f32,
    /// `|cos θ_t|` of the refracted direction; 0 in total internal reflection.
    pub cos_transmitted: f32,
}

/// Fresnel reflectance at `cos_incident = |cos θ_i| ∈ [0, 1]`, `eta = η_t/η_i` the index of
/// refraction of the far side over that of the near side.
///
/// `cos θ_t = √(1 − sin²θ_i/η²)`; a radicand that is not positive is total internal
/// reflection. `F = ½ (r_s² + r_p²)` with
/// `r_s = (cos θ_i − η cos θ_t)/(cos θ_i + η cos θ_t)`,
/// `r_p = (η cos θ_i − cos θ_t)/(η cos θ_i + cos θ_t)` (Born & Wolf, *Principles of
/// Optics*, §1.5.2).
#[inline]
pub(super) fn dielectric(cos_incident: f32, eta: f32) -> DielectricFresnel {
    if eta == 1.0 {
        // Both amplitudes are 0/0 at grazing incidence: matched indices reflect nothing.
        return DielectricFresnel {
            reflectance: 0.0,
            cos_transmitted: cos_incident,
        };
    }
    // η² − sin²θ_i, by differences that are exact where they are small: near matched indices,
    // and at normal incidence.
    let radicand = if eta > 0.5 {
        (eta - 1.0) * (eta + 1.0) + cos_incident * cos_incident
    } else {
        eta * eta - (1.0 - cos_incident) * (1.0 + cos_incident)
    };
    if radicand <= 0.0 {
        return DielectricFresnel {
            reflectance: 1.0,
            cos_transmitted: 0.0,
        };
    }
    let cos_transmitted = (radicand.sqrt() / eta).min(1.0);
    let senkrecht = (cos_incident - eta * cos_transmitted) / (cos_incident + eta * cos_transmitted);
    let parallel = (eta * cos_incident - cos_transmitted) / (eta * cos_incident + cos_transmitted);
    DielectricFresnel {
        reflectance: 0.5 * (senkrecht * senkrecht + parallel * parallel),
        cos_transmitted,
    }
}

/// Fresnel reflectance of a conductor with complex index `eta + i k` relative to the outside, per
/// channel, at `cos_incident ∈ [0, 1]`.
///
/// With `t = η² − k² − sin²θ`, `a² + b² = √(t² + 4η²k²)`, `a² − b² = t`:
/// `R_s = ((a − cosθ)² + b²)/((a + cosθ)² + b²)` and
/// `R_p = R_s ((a cosθ − sin²θ)² + b² cos²θ)/((a cosθ + sin²θ)² + b² cos²θ)` (Born
/// & Wolf §14.2, with the differences taken before squaring so that they lose no digits).
#[inline]
pub(super) fn conductor(cos_incident: f32, eta: Rgb, k: Rgb) -> Rgb {
    let c = Rgb::splat(cos_incident);
    let c2 = cos_incident * cos_incident;
    let s2 = (1.0 - c2).max(0.0);
    let eta2_k2 = eta * eta * k * k;
    // In this order: shader compilers take `x − y² − z` for `x − (y² + z)`.
    let t = eta * eta - (k * k + Rgb::splat(s2));
    let modulus = (t * t + 4.0 * eta2_k2).map(f32::sqrt);
    // The larger of a² and b² is a sum; the other follows from a²b² = η²k² without
    // cancellation.
    let larger = 0.5 * (modulus + t.abs());
    let smaller = (eta2_k2 / larger.max(Rgb::splat(f32::MIN_POSITIVE))).min(larger);
    let positive = t.cmpge(Rgb::ZERO);
    let a = Rgb::select(positive, larger, smaller).map(f32::sqrt);
    let b2 = Rgb::select(positive, smaller, larger);
    let square = |v: Rgb| v * v;
    let floor = Rgb::splat(f32::MIN_POSITIVE);
    let senkrecht = (square(a - c) + b2) / (square(a + c) + b2).max(floor);
    let s2 = Rgb::splat(s2);
    let ratio = (square(a * c - s2) + b2 * c2) / (square(a * c + s2) + b2 * c2).max(floor);
    0.5 * senkrecht * (Rgb::ONE + ratio)
}

/// [`conductor`] of eight surfaces, bit for bit.
#[inline(always)]
pub(super) fn conductor_lanes<L: Lanes>(cos_incident: L, eta: Vec3Lanes<L>, k: Vec3Lanes<L>) -> Vec3Lanes<L> {
    let c2 = cos_incident * cos_incident;
    let s2 = (L::splat(1.0) - c2).max(L::splat(0.0));
    Vec3Lanes::new(
        conductor_channel(cos_incident, c2, s2, eta.x, k.x),
        conductor_channel(cos_incident, c2, s2, eta.y, k.y),
        conductor_channel(cos_incident, c2, s2, eta.z, k.z),
    )
}

#[inline(always)]
fn conductor_channel<L: Lanes>(c: L, c2: L, s2: L, eta: L, k: L) -> L {
    let (half, one, floor) = (L::splat(0.5), L::splat(1.0), L::splat(f32::MIN_POSITIVE));
    let eta2_k2 = eta * eta * k * k;
    let t = eta * eta - (k * k + s2);
    let modulus = (t * t + L::splat(4.0) * eta2_k2).sqrt();
    let larger = half * (modulus + t.abs());
    let smaller = (eta2_k2 / larger.max(floor)).min(larger);
    let positive = L::splat(0.0).less_equal(t);
    let a = larger.select(positive, smaller).sqrt();
    let b2 = smaller.select(positive, larger);
    let (minus, plus) = (a - c, a + c);
    let senkrecht = (minus * minus + b2) / (plus * plus + b2).max(floor);
    let (minus, plus) = (a * c - s2, a * c + s2);
    let ratio = (minus * minus + b2 * c2) / (plus * plus + b2 * c2).max(floor);
    half * senkrecht * (one + ratio)
}

/// Reflectance of a smooth dielectric interface for diffuse light, `2 ∫_0^1 F(μ; η) μ dμ`,
/// `eta` as in [`dielectric`].
///
/// Closed form for `η > 1` (Walsh 1926; Duntley 1942, *The Optical Properties of Diffusing
/// Materials*). From the denser side, reciprocity of the two transmittances gives
/// `1 − R(1/η) = (1 − R(η))/η²`.
pub(super) fn diffuse_reflectance(eta: f32) -> f32 {
    let eta = f64::from(eta);
    let reflectance = if eta >= 1.0 {
        diffuse_reflectance_outside(eta)
    } else {
        1.0 - (1.0 - diffuse_reflectance_outside(1.0 / eta)) * eta * eta
    };
    reflectance as f32
}

fn diffuse_reflectance_outside(eta: f64) -> f64 {
    // The closed form is a difference of terms in 1/(η−1): below this it is all rounding, and R
    // is next to linear.
    const NEAR: f64 = 1e-4;
    if eta < 1.0 + NEAR {
        return (eta - 1.0) / NEAR * diffuse_reflectance_outside(1.0 + NEAR);
    }
    let e2 = eta * eta;
    let e4 = e2 * e2;
    let (sum, difference) = (e2 + 1.0, e4 - 1.0);
    let reflectance = 0.5
        + (eta - 1.0) * (3.0 * eta + 1.0) / (6.0 * (eta + 1.0) * (eta + 1.0))
        + e2 * (e2 - 1.0) * (e2 - 1.0) / (sum * sum * sum) * ((eta - 1.0) / (eta + 1.0)).ln()
        - 2.0 * e2 * eta * (e2 + 2.0 * eta - 1.0) / (sum * difference)
        + 8.0 * e4 * (e4 + 1.0) / (sum * difference * difference) * eta.ln();
    reflectance.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Complex Fresnel equations in `f64`, by complex arithmetic alone.
    fn conductor_oracle(cos: f64, eta: f64, k: f64) -> f64 {
        let mul = |a: (f64, f64), b: (f64, f64)| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
        let abs2 = |a: (f64, f64)| a.0 * a.0 + a.1 * a.1;
        let n2 = mul((eta, k), (eta, k));
        let radicand = (n2.0 - (1.0 - cos * cos), n2.1); // n² − sin²θ = (n cosθ_t)²
        let modulus = abs2(radicand).sqrt().sqrt();
        let half = 0.5 * radicand.1.atan2(radicand.0);
        let q = (modulus * half.cos(), modulus * half.sin());
        let rs = abs2((cos - q.0, -q.1)) / abs2((cos + q.0, q.1));
        let n2c = (n2.0 * cos, n2.1 * cos);
        let rp = abs2((n2c.0 - q.0, n2c.1 - q.1)) / abs2((n2c.0 + q.0, n2c.1 + q.1));
        0.5 * (rs + rp)
    }

    #[test]
    fn conductor_matches_complex_arithmetic() {
        for (eta, k) in [
            (0.2004, 3.912),
            (1.5, 0.0),
            (0.0, 1.0),
            (2.5, 0.01),
            (0.05, 30.0),
            (4.0, 4.0),
            (0.5, 0.0),
        ] {
            for step in 0..=100 {
                let cos = step as f64 / 100.0;
                let expected = conductor_oracle(cos, eta, k);
                let found = conductor(cos as f32, Rgb::splat(eta as f32), Rgb::splat(k as f32)).x as f64;
                assert!(
                    (found - expected).abs() < 2e-6,
                    "eta {eta} k {k} cos {cos}: {found} for {expected}"
                );
            }
        }
    }

    #[test]
    fn dielectric_is_a_conductor_without_absorption() {
        for eta in [1.0f32 / 1.5, 0.9, 1.000_1, 1.33, 1.5, 2.4, 10.0] {
            for step in 1..=100 {
                let cos = step as f32 / 100.0;
                let expected = conductor_oracle(cos as f64, eta as f64, 0.0);
                let found = dielectric(cos, eta).reflectance as f64;
                assert!(
                    (found - expected).abs() < 1e-5,
                    "eta {eta} cos {cos}: {found} for {expected}"
                );
            }
        }
    }

    #[test]
    fn total_internal_reflection_starts_at_the_critical_angle() {
        let eta = 1.0 / 1.5f32;
        let critical = (1.0 - eta * eta).sqrt();
        assert_eq!(dielectric(critical - 1e-3, eta).reflectance, 1.0);
        assert_eq!(dielectric(critical - 1e-3, eta).cos_transmitted, 0.0);
        assert!(dielectric(critical + 1e-3, eta).reflectance < 0.95);
        assert!((dielectric(1.0, 1.5).reflectance - 0.04).abs() < 1e-6);
        assert!((dielectric(0.6, 1.5).cos_transmitted - (1.0f32 - 0.64 / 2.25).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn diffuse_reflectance_is_the_mean_over_angles() {
        for eta in [
            1.000_05f32,
            1.001,
            1.1,
            1.3,
            1.49,
            1.5,
            1.9,
            3.0,
            10.0,
            1.0 / 1.5,
            0.9,
            0.4,
        ] {
            let integrand = |mu: f64| 2.0 * mu * conductor_oracle(mu, eta as f64, 0.0);
            // From the denser side the critical angle is a kink.
            let critical = (1.0 - (eta as f64).powi(2)).max(0.0).sqrt();
            let expected = lightshed_testkit::integrate(integrand, 0.0, critical, 1e-9).value
                + lightshed_testkit::integrate(integrand, critical, 1.0, 1e-9).value;
            let found = diffuse_reflectance(eta) as f64;
            assert!(
                (found - expected).abs() < 2e-5,
                "eta {eta}: {found} for {expected}"
            );
        }
        assert_eq!(diffuse_reflectance(1.0), 0.0);
    }

    #[test]
    fn hostile_arguments_stay_finite() {
        for cos in [0.0, 1e-30, 1.0] {
            for eta in [1e-3, 1.0, 1.0 + f32::EPSILON, 1.0 - f32::EPSILON, 1e3] {
                assert!((0.0..=1.0).contains(&dielectric(cos, eta).reflectance));
            }
            for eta in [0.0, 1e-20, 1.0, 1e4] {
                for k in [0.0, 1e-20, 1e4] {
                    let found = conductor(cos, Rgb::splat(eta), Rgb::splat(k)).x;
                    assert!((0.0..=1.000_001).contains(&found), "{cos} {eta} {k}: {found}");
                }
            }
        }
    }
}
