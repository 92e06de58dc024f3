//! Materials.

use crate::harness::{Shader, Tier, check, directions, gpu, unit_numbers};
use glam::{Affine2, Vec2, Vec3};
use lightshed_scene::{
    Checkerboard, ColorTexture, ConductorIor, Filter, FlatMaterials, Image, ImageTexture, Material,
    Microfacet, Rgb, Roughness, Wrap,
};
use std::sync::Arc;

fn ggx([u, v]: [f32; 2]) -> Roughness {
    Roughness {
        distribution: Microfacet::Ggx,
        alpha_u: lightshed_scene::FloatTexture::Constant(u),
        alpha_v: lightshed_scene::FloatTexture::Constant(v),
    }
}

fn conductor(eta: [f32; 3], k: [f32; 3], alpha: Option<[f32; 2]>) -> Material {
    Material::Conductor {
        ior: ConductorIor {
            eta: eta.into(),
            k: k.into(),
        },
        roughness: alpha.map(ggx),
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

fn dielectric(eta: f32, alpha: Option<[f32; 2]>) -> Material {
    Material::Dielectric {
        eta,
        roughness: alpha.map(ggx),
        specular_reflectance: Rgb::new(0.9, 1.0, 0.8).into(),
        specular_transmittance: Rgb::new(1.0, 0.7, 0.9).into(),
    }
}

fn plastic(nonlinear: bool, alpha: Option<[f32; 2]>) -> Material {
    Material::Plastic {
        eta: 1.5,
        diffuse_reflectance: Rgb::new(0.7, 0.2, 0.1).into(),
        specular_reflectance: Rgb::new(1.0, 0.9, 0.8).into(),
        nonlinear,
        roughness: alpha.map(ggx),
    }
}

fn image(filter: Filter, wrap: Wrap, coded: bool) -> ColorTexture {
    let (width, height) = (5, 3);
    let codes: Vec<[u8; 3]> = (0..15u8).map(|i| [17 * i, 255 - 11 * i, 40 + 7 * i]).collect();
    let linear = || {
        codes
            .iter()
            .map(|code| code.map(|c| f32::from(c) / 200.0))
            .collect()
    };
    let image = if coded {
        Image::from_srgb8(width, height, codes.clone())
    } else {
        Image::from_linear(width, height, linear())
    };
    ColorTexture::Image(ImageTexture {
        image: Arc::new(image.expect("it has so many texels")),
        to_uv: Affine2::from_cols_array(&[3.0, 0.7, -0.4, 2.0, 0.3, -1.1]),
        filter,
        wrap,
        scale: Rgb::new(0.8, 0.9, 1.0),
    })
}

fn textured(reflectance: ColorTexture) -> Material {
    Material::Diffuse { reflectance }
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
        ("glass", dielectric(1.5, None)),
        ("air in glass", dielectric(1.0 / 1.5, None)),
        ("no boundary", dielectric(1.0, None)),
        ("rough glass", dielectric(1.5, Some([0.3, 0.1]))),
        ("rough air in glass", dielectric(0.7, Some([0.2, 0.2]))),
        (
            "window",
            Material::ThinDielectric {
                eta: 1.5,
                specular_reflectance: Rgb::new(0.9, 1.0, 0.8).into(),
                specular_transmittance: Rgb::new(0.5, 0.7, 0.9).into(),
            },
        ),
        ("plastic", plastic(true, None)),
        ("plastic, two-sided", two_sided(plastic(false, None), None)),
        ("rough plastic", plastic(true, Some([0.15, 0.15]))),
        (
            "blend of all",
            blend(
                0.6,
                two_sided(plastic(true, Some([0.3, 0.2])), None),
                blend(0.5, dielectric(1.5, Some([0.2, 0.2])), dielectric(1.3, None)),
            ),
        ),
        ("image", textured(image(Filter::Bilinear, Wrap::Repeat, true))),
        (
            "mirrored image",
            textured(image(Filter::Bilinear, Wrap::Mirror, false)),
        ),
        (
            "clamped image",
            two_sided(textured(image(Filter::Nearest, Wrap::Clamp, true)), None),
        ),
        (
            "checkerboard on metal",
            Material::Conductor {
                ior: ConductorIor {
                    eta: Rgb::splat(0.2),
                    k: Rgb::splat(3.0),
                },
                roughness: Some(ggx([0.2, 0.3])),
                specular_reflectance: ColorTexture::Checkerboard(Checkerboard {
                    color0: Rgb::new(0.9, 0.5, 0.2),
                    color1: Rgb::ZERO,
                    to_uv: Affine2::from_scale(Vec2::new(3.0, 5.0)),
                }),
            },
        ),
        (
            "blend of images",
            blend(
                0.4,
                textured(image(Filter::Nearest, Wrap::Repeat, false)),
                two_sided(textured(image(Filter::Bilinear, Wrap::Clamp, true)), None),
            ),
        ),
    ]
}

/// What `package::host` has for one material.
const HOST: &str = "
    import package::lightshed::bsdf::Component;
    import package::lightshed::texture::Texture;
    @group(0) @binding(2) var<storage, read> components: array<Component>;
    @group(0) @binding(3) var<storage, read> textures: array<Texture>;
    @group(0) @binding(4) var<storage, read> texels: array<u32>;
    @group(0) @binding(5) var<storage, read> coats: array<f32>;
    fn load_component(row: u32) -> Component { return components[row]; }
    fn load_material(index: u32) -> vec2u { return vec2u(0u, ROWS); }
    fn load_texture(index: u32) -> Texture { return textures[index]; }
    fn load_texel_word(index: u32) -> u32 { return texels[index]; }
    fn load_coat(place: u32) -> f32 { return coats[place]; }
    fn has_dielectrics() -> bool { return true; }
    fn has_plastics() -> bool { return true; }
    fn has_textures() -> bool { return true; }";

const PUT: &str = "
    let wo = vec3f(number(0u), number(1u), number(2u));
    let at = MaterialAt(0u, vec2f(number(9u), number(10u)));
    let e = evaluate_bsdf(at, wo, vec3f(number(3u), number(4u), number(5u)));
    put_3(0u, e.value); put_f(3u, e.pdf);
    let s = sample_bsdf(at, wo, number(6u), vec2f(number(7u), number(8u)));
    put(4u, select(0u, 1u, s.some));
    if s.some {
        put(5u, select(0u, 1u, s.is_delta)); put_3(6u, s.wi); put_3(9u, s.weight);
        put_f(12u, select(s.pdf, 0.0, s.is_delta)); put(13u, s.lobe); put_f(14u, s.eta);
        let l = evaluate_bsdf_lobe(at, s.lobe, wo, s.wi);
        put_3(15u, l.value); put_f(18u, l.pdf); put_f(19u, lobe_roughness(at, s.lobe));
    }";

/// Values of all lobes and of one, samples, and which lobe they are of.
#[test]
fn materials_scatter_alike() {
    for (name, material) in materials() {
        let mut flat = FlatMaterials::default();
        assert!(flat.push(&material), "{name} has rows");
        let Some(device) = gpu() else { return };
        let buffers = [
            device.buffer("components", &flat.components),
            device.buffer("textures", &flat.textures),
            device.buffer("texels", &flat.texels),
            device.buffer("coats", &flat.coats),
        ]
        .map(|buffer| buffer.expect("they are few"));
        drop(device);
        let shader = Shader {
            host: &HOST.replace("ROWS", &format!("{}u", flat.components.len())),
            buffers: &buffers.each_ref(),
            ..Shader::new(
                "import package::lightshed::bsdf::{evaluate_bsdf, evaluate_bsdf_lobe, lobe_roughness, sample_bsdf};
                 import package::lightshed::material::MaterialAt;",
                PUT,
            )
        };
        let inputs: Vec<[u32; 11]> = directions(50)
            .into_iter()
            .zip(directions(51).into_iter().rev())
            .zip(unit_numbers::<5>(52))
            .map(|(([a, b, c], [d, e, f]), [g, h, i, u, v])| {
                // Coordinates outside of the unit square, too.
                let [u, v] = [u, v].map(|x| (3.0 * f32::from_bits(x) - 1.0).to_bits());
                [a, b, c, d, e, f, g, h, i, u, v]
            })
            .collect();
        // Under rough coats: a table's cubics are summed before they are drawn a line between.
        let tier = if flat.coats.is_empty() {
            Tier::Exact
        } else {
            Tier::Bounded {
                absolute: 1e-6,
                relative: 4e-6,
            }
        };
        let truth = |words: &[u32; 11]| {
            let [a, b, c, d, e, f, u_lobe, u, v, s, t] = words.map(f32::from_bits);
            let bsdf = material.at(Vec2::new(s, t));
            let wo = Vec3::new(a, b, c);
            let value = bsdf.evaluate(wo, Vec3::new(d, e, f));
            let mut all = [0; 20];
            let put = |all: &mut [u32; 20], k: usize, v: Vec3| {
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
                all[13] = u32::from(sample.lobe);
                all[14] = sample.eta.to_bits();
                let lobe = bsdf.evaluate_lobe(sample.lobe, wo, sample.wi);
                put(&mut all, 15, lobe.value);
                all[18] = lobe.pdf.value().to_bits();
                all[19] = bsdf.lobe_roughness(sample.lobe).to_bits();
            }
            all
        };
        check::<11, 20>(name, tier, &shader, &inputs, truth);
    }
}
