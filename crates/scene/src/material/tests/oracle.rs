//! Single-scattering albedo of rough surfaces in `f64`, written from the formulas alone: an
//! integral over normals sampled without regard to visibility, and no code shared with the
//! implementation.

use super::super::Microfacet;
use super::integrate_unit_square;
use glam::DVec3;

/// `erfc` by its Taylor series; beyond 5 it is zero for our purposes.
fn erfc(x: f64) -> f64 {
    if x > 5.0 {
        return 0.0;
    }
    let (mut term, mut sum) = (x, x);
    for n in 1..200 {
        term *= -x * x / n as f64;
        sum += term / (2 * n + 1) as f64;
    }
    1.0 - 2.0 / std::f64::consts::PI.sqrt() * sum
}

/// Smith's `G1`.
pub fn masking(kind: Microfacet, alpha: f64, v: DVec3) -> f64 {
    let tan = (1.0 - v.z * v.z).max(0.0).sqrt() / v.z.abs();
    let a = 1.0 / (alpha * tan);
    let lambda = match kind {
        _ if tan == 0.0 => 0.0,
        Microfacet::Ggx => 0.5 * ((1.0 + 1.0 / (a * a)).sqrt() - 1.0),
        Microfacet::Beckmann => 0.5 * ((-a * a).exp() / (a * std::f64::consts::PI.sqrt()) - erfc(a)),
    };
    1.0 / (1.0 + lambda)
}

/// Unpolarised dielectric reflectance and cosine of refraction.
pub fn fresnel(cos: f64, eta: f64) -> (f64, f64) {
    let cos_t2 = 1.0 - (1.0 - cos * cos) / (eta * eta);
    if cos_t2 <= 0.0 {
        return (1.0, 0.0);
    }
    let cos_t = cos_t2.sqrt();
    let s = (cos - eta * cos_t) / (cos + eta * cos_t);
    let p = (eta * cos - cos_t) / (eta * cos + cos_t);
    (0.5 * (s * s + p * p), cos_t)
}

/// What becomes of light at a microfacet.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// All is reflected.
    Mirror,
    /// Dielectric reflection.
    Reflect { eta: f64 },
    /// Dielectric transmission.
    Transmit { eta: f64 },
}

/// `∫ D(h) G1(wo) G1(w) s(wo·h) (wo·h)/cos θ_o dh` with `w` the scattered direction and `s`
/// the share of power that takes it: the albedo for separable masking. Normals are laid out by
/// `D cos θ_h`.
pub fn albedo(kind: Microfacet, alpha: f64, wo: DVec3, event: Event) -> f64 {
    let integrand = |xi: f64, half_turn: f64| {
        let phi = std::f64::consts::PI * half_turn;
        let tan2 = match kind {
            Microfacet::Ggx => alpha * alpha * xi / (1.0 - xi),
            Microfacet::Beckmann => -alpha * alpha * (1.0 - xi).ln(),
        };
        let cos = 1.0 / (1.0 + tan2).sqrt();
        let sin = cos * tan2.sqrt();
        let h = DVec3::new(sin * phi.cos(), sin * phi.sin(), cos);
        let facing = wo.dot(h);
        if facing <= 0.0 {
            return 0.0;
        }
        let (scattered, share) = match event {
            Event::Mirror => (2.0 * facing * h - wo, 1.0),
            Event::Reflect { eta } => (2.0 * facing * h - wo, fresnel(facing, eta).0),
            Event::Transmit { eta } => {
                let (reflectance, cos_t) = fresnel(facing, eta);
                (-((facing / eta - cos_t) * h - wo / eta), 1.0 - reflectance)
            }
        };
        if scattered.z <= 0.0 || share <= 0.0 {
            return 0.0;
        }
        masking(kind, alpha, wo) * masking(kind, alpha, scattered) * share * facing / (wo.z * cos)
    };
    // Symmetric in φ about the plane of `wo`, which has azimuth 0 here.
    integrate_unit_square(integrand, 1e-4)
}

/// The direction at `degrees` from the normal in the plane `y = 0`.
pub fn in_plane(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

#[test]
fn erfc_is_tabulated_right() {
    // Abramowitz & Stegun table 7.1.
    for (x, expected) in [
        (0.0, 1.0),
        (0.5, 0.479_500_122),
        (1.0, 0.157_299_207),
        (2.0, 0.004_677_735),
    ] {
        assert!((erfc(x) - expected).abs() < 1e-9, "{x}");
    }
}
