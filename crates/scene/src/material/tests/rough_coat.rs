//! The tabulated transmittance of rough coats against `f64` quadrature.

use super::super::microfacet::Distribution;
use super::super::rough_coat::{internal_reflectance, transmittance};
use super::oracle::{Event, albedo, in_plane};
use super::*;
use lightshed_testkit::GaussLegendre;

#[test]
fn tables_match_quadrature() {
    let (mut worst_transmittance, mut worst_reflectance) = (0.0f64, 0.0f64);
    // Off the nodes.
    for kind in [GGX, BECKMANN] {
        for eta in [1.2f32, 1.33, 1.49, 1.72, 2.3] {
            for alpha in [0.03f32, 0.1, 0.22, 0.5, 0.85] {
                let distribution = Distribution::new(kind, alpha, alpha);
                for angle in [0.0, 25.0, 55.0, 72.0, 83.0, 88.0] {
                    let wo = in_plane(angle);
                    let expected = albedo(kind, alpha as f64, wo, Event::Transmit { eta: eta as f64 });
                    let found = transmittance(&distribution, eta, wo.z as f32) as f64;
                    if (found - expected).abs() > worst_transmittance {
                        worst_transmittance = (found - expected).abs();
                        println!("{kind:?} η {eta} α {alpha} {angle}°: {found} for {expected}");
                    }
                }
            }
        }
        for (eta, alpha) in [(1.33f32, 0.1f32), (1.49, 0.3), (1.8, 0.7)] {
            let inside = Event::Reflect {
                eta: 1.0 / eta as f64,
            };
            let integrand =
                |mu: f64| 2.0 * mu * albedo(kind, alpha as f64, in_plane(mu.acos().to_degrees()), inside);
            let expected = GaussLegendre::new(24).integrate(integrand, 0.0, 1.0);
            let found = internal_reflectance(&Distribution::new(kind, alpha, alpha), eta) as f64;
            worst_reflectance = worst_reflectance.max((found - expected).abs());
            println!("{kind:?} η {eta} α {alpha}: R_int {found} for {expected}");
        }
    }
    assert!(worst_transmittance < 2e-3, "{worst_transmittance}");
    assert!(worst_reflectance < 2e-3, "{worst_reflectance}");
}
