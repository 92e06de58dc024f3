//! White furnace: under constant light the share of power scattered is known.

use super::oracle::{Event, albedo, in_plane};
use super::*;
use lightshed_testkit::check_faults;

/// Energy over all lobes at `wo`.
fn total(subject: &Subject, wo: Vec3) -> f64 {
    (0..subject.bsdf.lobe_count())
        .map(|lobe| sampled_albedo(subject, lobe, wo, 0))
        .sum()
}

#[test]
fn smooth_surfaces_return_all_energy() {
    let lossless = [
        ("diffuse", diffuse(1.0)),
        ("two-sided diffuse", two_sided(diffuse(1.0), None)),
        ("mirror", mirror()),
        ("glass", dielectric(1.5, None)),
        ("diamond", dielectric(2.42, None)),
        ("bubble", dielectric(1.0 / 1.33, None)),
        ("matched", dielectric(1.0, None)),
        ("thin glass", thin_dielectric(1.5)),
        ("blend", blend(0.25, mirror(), dielectric(1.5, None))),
    ];
    let property = |fault: Option<Fault>| {
        for (name, material) in &lossless {
            let subject = Subject::new(material, fault);
            for tenths in (0..=899).step_by(29) {
                for flip in [1.0, -1.0] {
                    let wo = direction(tenths as f32 / 10.0) * Vec3::new(1.0, 1.0, flip);
                    if flip < 0.0 && matches!(*name, "diffuse" | "mirror" | "blend") {
                        continue;
                    }
                    let energy = total(&subject, wo);
                    if !((energy - 1.0).abs() < 1e-4) {
                        return Err(format!("{name} at {tenths}/10°, side {flip}: {energy}"));
                    }
                }
            }
        }
        Ok(())
    };
    check_faults(&[Fault::NoEtaSquared { eta: 1.5 }, Fault::NoCosine], property).unwrap();
}

#[test]
fn smooth_samples_weigh_one() {
    // Through the whole sampler: with lobes chosen by what they scatter, every sample of a lossless
    // surface carries all power.
    for material in [mirror(), dielectric(1.5, None), thin_dielectric(1.5)] {
        let bsdf = material.at(Vec2::ZERO);
        for angle in ANGLES {
            for u_lobe in [0.0, 0.03, 0.3, 0.9, 0.999_999] {
                let sample = bsdf.sample(direction(angle), u_lobe, Vec2::splat(0.5)).unwrap();
                assert!(sample.is_delta && sample.pdf.value() == f32::INFINITY);
                let power = sample.weight * sample.eta * sample.eta;
                assert!((power - Rgb::ONE).abs().max_element() < 1e-4, "{angle}: {power}");
            }
        }
    }
}

const ALPHAS: [f32; 6] = [0.01, 0.05, 0.15, 0.4, 0.7, 1.0];

/// Holds a lobe of a rough surface to the oracle, to 1e-3.
fn check_albedo(
    material: impl Fn(Roughness) -> Material,
    lobe: u8,
    event: Event,
    fault: Option<Fault>,
) -> Result<(), String> {
    for kind in [GGX, BECKMANN] {
        for alpha in ALPHAS {
            let subject = Subject::new(&material(rough(kind, alpha, alpha)), fault);
            for angle in ANGLES {
                let expected = albedo(kind, alpha as f64, in_plane(angle as f64), event);
                let found = sampled_albedo(&subject, lobe, direction(angle), 0);
                if !((found - expected).abs() < 1e-3) {
                    return Err(format!(
                        "{kind:?} α {alpha} {angle}° {event:?}: {found} for {expected}"
                    ));
                }
            }
        }
    }
    Ok(())
}

/// A conductor that reflects everything: `F = 1` for an infinite extinction.
fn perfect_conductor(roughness: Roughness) -> Material {
    Material::Conductor {
        ior: ConductorIor {
            eta: Rgb::ZERO,
            k: Rgb::splat(1e6),
        },
        roughness: Some(roughness),
        specular_reflectance: Rgb::ONE.into(),
    }
}

#[test]
fn rough_conductors_return_their_single_scattering_albedo() {
    let faults = [
        Fault::HeightCorrelated { alpha: 0.4 },
        Fault::NoHalfVectorJacobian,
        Fault::NoCosine,
    ];
    check_faults(&faults, |fault| {
        check_albedo(perfect_conductor, 0, Event::Mirror, fault)
    })
    .unwrap();
}

#[test]
fn rough_dielectrics_return_their_single_scattering_albedo() {
    let eta = 1.5;
    let glass = |roughness| dielectric(eta as f32, Some(roughness));
    check_faults(
        &[Fault::NoEtaSquared { eta: eta as f32 }, Fault::NoCosine],
        |fault| {
            check_albedo(glass, 1, Event::Transmit { eta }, fault)?;
            check_albedo(glass, 0, Event::Reflect { eta }, fault)
        },
    )
    .unwrap();
}

#[test]
fn rough_dielectrics_from_inside() {
    // `wo` in the glass: the far side is the thinner.
    let eta = 1.0 / 1.5;
    let glass = |roughness| dielectric(eta as f32, Some(roughness));
    check_albedo(glass, 0, Event::Reflect { eta }, None).unwrap();
    check_albedo(glass, 1, Event::Transmit { eta }, None).unwrap();
    // Which is also what an ordinary glass does from below.
    for (angle, lobe) in ANGLES.iter().flat_map(|a| [(*a, 0), (*a, 1)]) {
        let roughness = || Some(rough(GGX, 0.3, 0.3));
        let bubble = Subject::new(&dielectric(1.0 / 1.5, roughness()), None);
        let glass = Subject::new(&dielectric(1.5, roughness()), None);
        let above = direction(angle);
        let below = above * Vec3::new(1.0, 1.0, -1.0);
        let difference = sampled_albedo(&bubble, lobe, above, 0) - sampled_albedo(&glass, lobe, below, 0);
        assert!(difference.abs() < 1e-5, "{angle} {lobe}: {difference}");
    }
}

#[test]
fn nothing_gains_energy() {
    for (name, material) in zoo() {
        let subject = Subject::new(&material, None);
        for angle in ANGLES {
            for flip in [1.0, -1.0] {
                let wo = direction(angle) * Vec3::new(1.0, 1.0, flip);
                let energy = total(&subject, wo);
                // Schlick's Fresnel of the half vector over a Lambertian base lets glTF gain at
                // grazing angles.
                let bound = if name.starts_with("gltf") { 1.1 } else { 1.0 + 1e-3 };
                assert!(energy < bound, "{name} at {angle}°: {energy}");
            }
        }
    }
}

#[test]
fn plastic_matches_its_closed_form() {
    // Under constant light the coat reflects F(θ) and the base returns (1 − F(θ)) (1 − R_ext)
    // / η² · ρ/(1 − ρ R_int), where (1 − R_ext)/η² = 1 − R_int. Both R by quadrature.
    let eta = 1.49f64;
    let external =
        lightshed_testkit::integrate(|mu| 2.0 * mu * super::oracle::fresnel(mu, eta).0, 0.0, 1.0, 1e-9);
    let internal = 1.0 - (1.0 - external.value) / (eta * eta);
    let albedo = glam::DVec3::new(0.8, 0.4, 0.1);
    for nonlinear in [false, true] {
        let rounds = if nonlinear {
            albedo / (glam::DVec3::ONE - albedo * internal)
        } else {
            albedo / (1.0 - internal)
        };
        let subject = Subject::new(&plastic(nonlinear, None), None);
        for angle in ANGLES {
            let wo = direction(angle);
            let coat = super::oracle::fresnel(wo.z as f64, eta).0;
            let base = rounds * ((1.0 - coat) * (1.0 - internal));
            assert!(
                (sampled_albedo(&subject, 0, wo, 0) - coat).abs() < 1e-4,
                "{angle}"
            );
            for channel in 0..3 {
                let (found, expected) = (sampled_albedo(&subject, 1, wo, channel), base[channel]);
                assert!((found - expected).abs() < 3e-4, "{angle}: {found} for {expected}");
            }
        }
    }
}
