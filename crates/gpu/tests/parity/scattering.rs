//! Materials.

use crate::harness::{Shader, Tier, check, directions, gpu, unit_numbers};
use glam::{Vec2, Vec3};
use lightshed_scene::{ComponentRow, ConductorIor, Material, Microfacet, Rgb, Roughness};

fn conductor(eta: [f32; 3], k: [f32; 3], alpha: Option<[f32; 2]>) -> Material {
    Material::Conductor {
        ior: ConductorIor {
            eta: eta.into(),
            k: k.into(),
        },
        roughness: alpha.map(|[u, v]| Roughness {
            distribution: Microfacet::Ggx,
            alpha_u: lightshed_scene::FloatTexture::Constant(u),
            alpha_v: lightshed_scene::FloatTexture::Constant(v),
        }),
        specular_reflectance: Rgb::new(0.9, 0.8, 1.0).into(),
    }
}

fn blend(weight: f32, first: Material, second: Material) -> Material {
    Material::Blend {
        weight: lightshed_scene::FloatTexture::Constant(weight),
        first: Box::new(first),
        second: Box::new(second),
    }
}

fn two_sided(front: Material, back: Option<Material>) -> Material {
    Material::TwoSided {
        front: Box::new(front),
        back: back.map(Box::new),
    }
}

fn materials() -> Vec<(&'static str, Material)> {
    let diffuse = || Material::Diffuse {
        reflectance: Rgb::new(0.7, 0.5, 0.1).into(),
    };
    let mirror = || Material::Mirror {
        reflectance: Rgb::new(0.9, 0.95, 0.8).into(),
    };
    let metal = |alpha| conductor([0.2, 0.9, 1.1], [3.9, 2.4, 2.2], alpha);
    vec![
        ("diffuse", diffuse()),
        ("diffuse, two-sided", two_sided(diffuse(), None)),
        ("mirror", mirror()),
        ("smooth conductor", two_sided(metal(None), None)),
        ("rough conductor", metal(Some([0.3, 0.05]))),
        ("very smooth conductor", metal(Some([0.002, 0.002]))),
        (
            "total reflection",
            conductor([0.0; 3], [1.0; 3], Some([0.5, 0.5])),
        ),
        (
            "blend",
            blend(
                0.3,
                two_sided(diffuse(), None),
                blend(0.5, mirror(), metal(Some([0.2, 0.2]))),
            ),
        ),
        ("two sides", two_sided(metal(Some([0.1, 0.4])), Some(diffuse()))),
    ]
}

#[test]
fn materials_scatter_alike() {
    for (name, material) in materials() {
        let rows = material.component_rows().expect("it has rows");
        let table = match gpu() {
            Some(gpu) => gpu
                .buffer::<ComponentRow>("components", &rows)
                .expect("they are few"),
            None => return,
        };
        let shader = Shader {
            host: &format!(
                "import package::lightshed::bsdf::Component;
                 @group(0) @binding(2) var<storage, read> components: array<Component>;
                 fn load_component(row: u32) -> Component {{ return components[row]; }}
                 fn load_material(index: u32) -> vec2u {{ return vec2u(0u, {}u); }}",
                rows.len()
            ),
            buffers: &[&table],
            ..Shader::new(
                "import package::lightshed::bsdf::{evaluate_bsdf, sample_bsdf};",
                "let wo = vec3f(number(0u), number(1u), number(2u));
                 let e = evaluate_bsdf(0u, wo, vec3f(number(3u), number(4u), number(5u)));
                 put_3(0u, e.value); put_f(3u, e.pdf);
                 let s = sample_bsdf(0u, wo, number(6u), vec2f(number(7u), number(8u)));
                 put(4u, select(0u, 1u, s.some));
                 if s.some {
                     put(5u, select(0u, 1u, s.is_delta)); put_3(6u, s.wi); put_3(9u, s.weight);
                     put_f(12u, select(s.pdf, 0.0, s.is_delta));
                 }",
            )
        };
        let inputs: Vec<[u32; 9]> = directions(50)
            .into_iter()
            .zip(directions(51).into_iter().rev())
            .zip(unit_numbers::<3>(52))
            .map(|(([a, b, c], [d, e, f]), [g, h, i])| [a, b, c, d, e, f, g, h, i])
            .collect();
        let bsdf = material.at(Vec2::ZERO);
        check::<9, 13>(name, Tier::Exact, &shader, &inputs, |words| {
            let [a, b, c, d, e, f, u_lobe, u, v] = words.map(f32::from_bits);
            let wo = Vec3::new(a, b, c);
            let value = bsdf.evaluate(wo, Vec3::new(d, e, f));
            let mut all = [0; 13];
            let put = |all: &mut [u32; 13], k: usize, v: Vec3| {
                all[k..k + 3].copy_from_slice(&v.to_array().map(f32::to_bits));
            };
            put(&mut all, 0, value.value);
            all[3] = value.pdf.value().to_bits();
            if let Some(sample) = bsdf.sample(wo, u_lobe, Vec2::new(u, v)) {
                all[4] = 1;
                all[5] = u32::from(sample.is_delta);
                put(&mut all, 6, sample.wi);
                put(&mut all, 9, sample.weight);
                all[12] = if sample.is_delta {
                    0
                } else {
                    sample.pdf.value().to_bits()
                };
            }
            all
        });
    }
}
