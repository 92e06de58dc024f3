//! Materials.

use crate::tests::parity::harness::{Shader, Tier, compare, directions, gpu, held, unit_numbers};
use glam::{Affine2, Vec2, Vec3};
use lightshed_scene::{
    Checkerboard, ColorTexture, ComponentRow, ConductorIor, Filter, FlatMaterials, Image, ImageTexture,
    Material, Microfacet, Rgb, Roughness, Wrap,
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
    @group(0) @binding(6) var<storage, read> materials: array<vec2u>;
    fn load_material(index: u32) -> vec2u { return materials[index]; }
    fn load_texture(index: u32) -> Texture { return textures[index]; }
    fn load_texel_word(index: u32) -> u32 { return texels[index]; }
    fn load_coat(place: u32) -> f32 { return coats[place]; }
    fn has_dielectrics() -> bool { return true; }
    fn has_plastics() -> bool { return true; }
    fn has_textures() -> bool { return true; }";

const PUT: &str = "
    let wo = vec3f(number(0u), number(1u), number(2u));
    let at = MaterialAt(word(11u), vec2f(number(9u), number(10u)));
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

type Inputs = [u32; 12];
type Outputs = [u32; 20];

/// Directions and numbers for each material, its number the last word.
fn inputs(materials: usize) -> Vec<Inputs> {
    let all: Vec<[u32; 11]> = directions(50)
        .into_iter()
        .zip(directions(51).into_iter().rev())
        .zip(unit_numbers::<5>(52))
        .map(|(([a, b, c], [d, e, f]), [g, h, i, u, v])| {
            // Coordinates outside of the unit square, too.
            let [u, v] = [u, v].map(|x| (3.0 * f32::from_bits(x) - 1.0).to_bits());
            [a, b, c, d, e, f, g, h, i, u, v]
        })
        .collect();
    // A third of them for each, all ends among them.
    let kept = |i: usize, material: usize| i < 512 || i % 3 == material % 3;
    let of_material = |material: usize| {
        let kept = all.iter().enumerate().filter(move |(i, _)| kept(*i, material));
        kept.map(move |(_, input)| std::array::from_fn(|k| input.get(k).copied().unwrap_or(material as u32)))
    };
    (0..materials).flat_map(of_material).collect()
}

fn expected(material: &Material, words: &Inputs) -> Outputs {
    let [a, b, c, d, e, f, u_lobe, u, v, s, t, _] = words.map(f32::from_bits);
    let bsdf = material.at(Vec2::new(s, t));
    let wo = Vec3::new(a, b, c);
    let value = bsdf.evaluate(wo, Vec3::new(d, e, f));
    let mut all = [0; 20];
    let put = |all: &mut Outputs, k: usize, v: Vec3| {
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
}

/// Values of all lobes and of one, samples, and which lobe they are of; and that faults in them are
/// noticed.
#[test]
fn materials_scatter_alike() {
    let Some(device) = gpu() else { return };
    let materials = materials();
    let mut flat = FlatMaterials::default();
    for (name, material) in &materials {
        assert!(flat.push(material), "{name} has rows");
    }
    let buffers = [
        device.buffer("components", &flat.components),
        device.buffer("textures", &flat.textures),
        device.buffer("texels", &flat.texels),
        device.buffer("coats", &flat.coats),
        device.buffer("materials", &flat.ranges),
    ]
    .map(|buffer| buffer.expect("they are few"));
    let run = |planted, inputs: &[Inputs]| -> Vec<Outputs> {
        let shader = Shader {
            host: HOST,
            buffers: &buffers.each_ref(),
            planted,
            ..Shader::new(
                "import package::lightshed::bsdf::{evaluate_bsdf, evaluate_bsdf_lobe, lobe_roughness, sample_bsdf};
                 import package::lightshed::material::MaterialAt;",
                PUT,
            )
        };
        shader.run(device, inputs)
    };
    let is_of = |input: &Inputs, index: usize| input[11] as usize == index;
    let differs = |index: usize, inputs: &[Inputs], found: &[Outputs]| {
        let (name, material) = &materials[index];
        let [first, rows] = flat.ranges[index].map(|word| word as usize);
        let coated = |row: &ComponentRow| row.kind == ComponentRow::GGX_PLASTIC;
        let tier = if flat.components[first..first + rows].iter().any(coated) {
            // A coat's cubics are summed before a line is drawn between them.
            Tier::Bounded {
                absolute: 1e-6,
                relative: 4e-6,
            }
        } else {
            Tier::Exact
        };
        let pairs = inputs.iter().zip(found).filter(|(input, _)| is_of(input, index));
        let (inputs, found): (Vec<_>, Vec<_>) = pairs.unzip();
        compare(name, tier, &inputs, &found, |words| expected(material, words))
    };
    let all = inputs(materials.len());
    let found = run(None, &all);
    for index in 0..materials.len() {
        held(device, || differs(index, &all, &found));
    }
    if !device.is_exact() {
        return;
    }
    let few: Vec<Inputs> = all.into_iter().step_by(20).collect();
    for (right, wrong, name) in [
        (
            "(1.0 - reflectance) / (eta * eta)",
            "(1.0 - reflectance)",
            "rough glass",
        ),
        (
            "let count = package_lightshed_bsdf__1lobe_count(",
            "let count = 1u + 0u * package_lightshed_bsdf__1lobe_count(",
            "blend of all",
        ),
        ("floor(0.5 * s)", "floor(0.25 * s)", "mirrored image"),
        (
            "component.weight * package_lightshed_vector__1max_element(component.color)",
            "component.importance",
            "blend of images",
        ),
        (
            "sqrt(clamp(cos_theta, 0.0, 1.0))",
            "clamp(cos_theta, 0.0, 1.0)",
            "rough plastic",
        ),
    ] {
        let index = materials
            .iter()
            .position(|(other, _)| *other == name)
            .expect("there is one");
        let found = run(Some([right, wrong]), &few);
        assert!(differs(index, &few, &found).is_err(), "{wrong} is not noticed");
    }
}
