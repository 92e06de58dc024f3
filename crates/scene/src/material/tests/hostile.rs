//! Finite in, finite out.

use super::*;

#[test]
fn hostile_directions_roughnesses_and_colours_stay_finite() {
    let mut materials: Vec<Material> = zoo().into_iter().map(|(_, material)| material).collect();
    for kind in [GGX, BECKMANN] {
        for alpha in [1e-6, 1e-4, 1e-3, 0.5, 30.0, 1e6] {
            for other in [alpha, 1e-3, 2.0] {
                materials.push(conductor(Some(rough(kind, alpha, other))));
                materials.push(dielectric(1.5, Some(rough(kind, alpha, other))));
                materials.push(dielectric(1.0 + f32::EPSILON, Some(rough(kind, alpha, other))));
                materials.push(plastic(true, Some(rough(kind, alpha, other))));
            }
        }
    }
    for tint in [0.0, 1e-38, 1e-30, 1e30] {
        materials.push(diffuse(tint));
        let tint = Rgb::new(tint, 0.0, tint);
        materials.push(Material::Plastic {
            eta: 1.5,
            diffuse_reflectance: tint.into(),
            specular_reflectance: tint.into(),
            nonlinear: true,
            roughness: None,
        });
        materials.push(Material::MetallicRoughness {
            base_color: tint.into(),
            metallic: 0.5.into(),
            roughness: 0.0.into(),
            transmission: 0.5.into(),
            ior: 0.0,
        });
        materials.push(blend(1e-30, diffuse(tint.x), mirror()));
    }
    for eta in [1e-3, 1e3] {
        materials.push(dielectric(eta, None));
        materials.push(dielectric(eta, Some(rough(GGX, 0.1, 0.1))));
        materials.push(thin_dielectric(eta));
    }
    let mut directions = vec![Vec3::X, -Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z];
    for z in [1e-45, 1e-38, 1e-20, 1e-7, 1e-4, 1e-2, 0.5] {
        for sign in [1.0, -1.0] {
            let z = z * sign;
            directions.push(Vec3::new((1.0f32 - z * z).sqrt(), 0.0, z));
            directions.push(Vec3::new(0.0, -(1.0f32 - z * z).sqrt(), z));
            directions.push(Vec3::new(-z, 0.0, (1.0f32 - z * z).sqrt()));
        }
    }
    let randoms = [0.0, 1e-30, 0.25, 0.5, 0.75, 1.0 - f32::EPSILON / 2.0];
    for material in &materials {
        let bsdf = material.at(Vec2::ZERO);
        assert!(bsdf.albedo_hint().is_finite());
        for wo in &directions {
            for lobe in 0..=bsdf.lobe_count() {
                let probability = bsdf.lobe_probability(lobe, *wo);
                assert!(
                    (0.0..=1.000_001).contains(&probability),
                    "{material:?} {wo}: {probability}"
                );
            }
            for wi in &directions {
                let found = bsdf.evaluate(*wo, *wi);
                let sound =
                    found.value.is_finite() && found.value.min_element() >= 0.0 && found.pdf.value() >= 0.0;
                assert!(
                    sound && found.pdf.value().is_finite(),
                    "{material:?} {wo} {wi}: {found:?}"
                );
            }
            for u_lobe in randoms {
                for (u, v) in randoms.iter().flat_map(|u| randoms.map(|v| (*u, v))) {
                    if let Some(sample) = bsdf.sample(*wo, u_lobe, Vec2::new(u, v)) {
                        let finite =
                            sample.wi.is_finite() && sample.weight.is_finite() && sample.eta.is_finite();
                        let unit = (sample.wi.length() - 1.0).abs() < 1e-3;
                        let positive = sample.weight.min_element() >= 0.0 && sample.pdf.is_positive();
                        assert!(
                            finite && unit && positive,
                            "{material:?} {wo} {u_lobe} {u} {v}: {sample:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn behind_a_one_sided_surface_it_is_black() {
    for material in [
        diffuse(1.0),
        mirror(),
        conductor(None),
        conductor(Some(rough(GGX, 0.3, 0.3))),
        plastic(true, None),
        plastic(true, Some(rough(BECKMANN, 0.3, 0.3))),
        metallic_roughness(0.5, 0.5, 0.0),
    ] {
        let bsdf = material.at(Vec2::ZERO);
        let (above, below) = (direction(30.0), -direction(30.0));
        for (wo, wi) in [(below, below), (below, above), (above, below)] {
            assert_eq!(bsdf.evaluate(wo, wi), BsdfValue::default(), "{material:?}");
        }
        assert!(bsdf.sample(below, 0.5, Vec2::splat(0.5)).is_none());
    }
}
