//! Values at given directions against the published formulas, written out in `f64`.

use super::oracle;
use super::*;
use glam::DVec3;
use lightshed_testkit::{check_faults, rng, uniform_f64};
use std::f64::consts::PI;

fn normal_density(kind: Microfacet, alpha: f64, h: DVec3) -> f64 {
    let tan2 = (1.0 - h.z * h.z).max(0.0) / (h.z * h.z);
    let a2 = alpha * alpha;
    match kind {
        Microfacet::Ggx => a2 / (PI * h.z.powi(4) * (a2 + tan2).powi(2)),
        Microfacet::Beckmann => (-tan2 / a2).exp() / (PI * a2 * h.z.powi(4)),
    }
}

/// Pairs of directions away from the horizon, `wi` on the same side of the surface or not.
fn for_pairs(same_side: bool, mut f: impl FnMut(DVec3, DVec3) -> Result<(), String>) -> Result<(), String> {
    let mut rng = rng(23);
    let mut above = || {
        let z = 0.05 + 0.95 * uniform_f64(&mut rng);
        let (sin, phi) = ((1.0 - z * z).sqrt(), 2.0 * PI * uniform_f64(&mut rng));
        DVec3::new(sin * phi.cos(), sin * phi.sin(), z)
    };
    for _ in 0..2_000 {
        let (wo, mut wi) = (above(), above());
        if !same_side {
            wi.z = -wi.z;
        }
        f(wo, wi)?;
    }
    Ok(())
}

fn compare(found: f64, expected: f64) -> Result<(), String> {
    if (found - expected).abs() <= 1e-3 * expected.abs() + 1e-6 {
        Ok(())
    } else {
        Err(format!("{found} for {expected}"))
    }
}

fn lobe_value(subject: &Subject, lobe: u8, wo: DVec3, wi: DVec3) -> DVec3 {
    subject
        .evaluate_lobe(lobe, wo.as_vec3(), wi.as_vec3())
        .value
        .as_dvec3()
}

#[test]
fn rough_reflection_is_d_g_f_over_four_cosines() {
    check_faults(
        &[Fault::HeightCorrelated { alpha: 0.5 }, Fault::NoCosine],
        |fault| {
            for kind in [GGX, BECKMANN] {
                let alpha = 0.5;
                let subject = Subject::new(
                    &dielectric(1.5, Some(rough(kind, alpha as f32, alpha as f32))),
                    fault,
                );
                for_pairs(true, |wo, wi| {
                    let h = (wo + wi).normalize();
                    let masking = oracle::masking(kind, alpha, wo) * oracle::masking(kind, alpha, wi);
                    let reflectance = oracle::fresnel(wo.dot(h), 1.5).0;
                    let f = normal_density(kind, alpha, h) * masking * reflectance / (4.0 * wo.z * wi.z);
                    compare(lobe_value(&subject, 0, wo, wi).x, f * wi.z)
                })?;
            }
            Ok::<_, String>(())
        },
    )
    .unwrap();
}

#[test]
fn correlation_is_worth_seven_percent() {
    // The figure that tells the two maskings apart: 70° and 70° across the normal, α = ½.
    let wo = direction_at(70.0, 0.0);
    let wi = direction_at(70.0, std::f32::consts::PI);
    let ggx = Ggx::new(0.5, 0.5);
    let ratio = ggx.masking_shadowing(wo, wi) / (ggx.masking(wo) * ggx.masking(wi));
    assert!((ratio - 1.07).abs() < 0.01, "{ratio}");
    let separable = Subject::new(&conductor(Some(rough(GGX, 0.5, 0.5))), None);
    let planted = Subject::new(
        &conductor(Some(rough(GGX, 0.5, 0.5))),
        Some(Fault::HeightCorrelated { alpha: 0.5 }),
    );
    let (a, b) = (
        separable.evaluate_lobe(0, wo, wi).value.x,
        planted.evaluate_lobe(0, wo, wi).value.x,
    );
    assert!((b / a - ratio).abs() < 1e-5);
}

#[test]
fn rough_transmission_is_walters() {
    for eta in [1.5f64, 1.0 / 1.5] {
        check_faults(
            &[Fault::NoEtaSquared { eta: eta as f32 }, Fault::NoCosine],
            |fault| {
                for kind in [GGX, BECKMANN] {
                    let alpha = 0.4;
                    let material = dielectric(eta as f32, Some(rough(kind, alpha as f32, alpha as f32)));
                    let subject = Subject::new(&material, fault);
                    for_pairs(false, |wo, wi| {
                        // Walter's eq. 21 with incident i = wi (index η_i = η) and outgoing o =
                        // wo (η_o = 1).
                        let toward = -(eta * wi + wo);
                        let h = if toward.z < 0.0 { -toward } else { toward }.normalize();
                        let (io, ii) = (wo.dot(h), wi.dot(h));
                        let expected = if io > 0.0 && ii < 0.0 {
                            let transmitted = 1.0 - oracle::fresnel(io, eta).0;
                            let masking = oracle::masking(kind, alpha, wo) * oracle::masking(kind, alpha, wi);
                            let d = normal_density(kind, alpha, h);
                            let jacobian = (eta * ii + io).powi(2);
                            (ii * io).abs() / (wi.z * wo.z).abs() * transmitted * masking * d / jacobian
                        } else {
                            0.0
                        };
                        compare(lobe_value(&subject, 1, wo, wi).x, expected * wi.z.abs())
                    })?;
                }
                Ok::<_, String>(())
            },
        )
        .unwrap();
    }
}

#[test]
fn metallic_roughness_is_appendix_b() {
    let (metallic, perceptual, transmission) = (0.3, 0.7, 0.4);
    let color = DVec3::new(0.9, 0.6, 0.2);
    let alpha = perceptual * perceptual;
    let material = metallic_roughness(metallic as f32, perceptual as f32, transmission as f32);
    // V = G / (4 cos cos) of the specification's GGX, in its own form.
    let visibility = |wo: DVec3, wi: DVec3| {
        let a2 = alpha * alpha;
        let a = wo.z * (wi.z * wi.z * (1.0 - a2) + a2).sqrt();
        let b = wi.z * (wo.z * wo.z * (1.0 - a2) + a2).sqrt();
        0.5 / (a + b)
    };
    check_faults(&[Fault::NoCosine], |fault| {
        let subject = Subject::new(&material, fault);
        for_pairs(true, |wo, wi| {
            let h = (wo + wi).normalize();
            let grazing = (1.0 - wo.dot(h)).powi(5);
            let dielectric = 0.04 + 0.96 * grazing;
            let metal = color + (DVec3::ONE - color) * grazing;
            let specular = normal_density(GGX, alpha, h) * visibility(wo, wi);
            let base = color * (1.0 - metallic) * (1.0 - dielectric);
            let expected = [
                (metal * metallic + DVec3::splat(dielectric * (1.0 - metallic))) * specular,
                base * ((1.0 - transmission) / PI),
                base * (transmission * specular),
            ];
            for lobe in 0..3u8 {
                let side = if lobe == 2 { -1.0 } else { 1.0 };
                let found = lobe_value(&subject, lobe, wo, DVec3::new(wi.x, wi.y, side * wi.z));
                for channel in 0..3 {
                    compare(found[channel], expected[lobe as usize][channel] * wi.z)?;
                }
            }
            Ok(())
        })
    })
    .unwrap();
}

#[test]
fn smooth_reflectances_are_fresnels_and_a_slabs() {
    for angle in ANGLES {
        let wo = direction(angle);
        for eta in [1.33f64, 1.5, 2.4] {
            let face = oracle::fresnel(f64::from(wo.z), eta).0;
            // In, to and fro between the faces, and out again on the side of `wo`.
            let slab: f64 = face
                + (0..2_000)
                    .map(|round| (1.0 - face).powi(2) * face.powi(2 * round + 1))
                    .sum::<f64>();
            let cases = [
                (dielectric(eta as f32, None), face),
                (thin_dielectric(eta as f32), slab),
            ];
            for (material, expected) in cases {
                let sample = material
                    .at(Vec2::ZERO)
                    .sample_lobe(0, wo, Vec2::ZERO)
                    .expect("a reflection");
                let found = f64::from(sample.value.x);
                assert!(
                    (found - expected).abs() < 1e-4,
                    "{material:?} {angle}°: {found} for {expected}"
                );
                assert_eq!(sample.wi, Vec3::new(-wo.x, -wo.y, wo.z));
            }
        }
    }
}

#[test]
fn alpha_u_is_the_roughness_along_x() {
    let bsdf = conductor(Some(rough(GGX, 0.5, 0.05))).at(Vec2::ZERO);
    let along_x = bsdf.evaluate(Vec3::Z, direction_at(30.0, 0.0)).value.x;
    let along_y = bsdf
        .evaluate(Vec3::Z, direction_at(30.0, std::f32::consts::FRAC_PI_2))
        .value
        .x;
    assert!(along_x > 10.0 * along_y, "{along_x} {along_y}");
}
