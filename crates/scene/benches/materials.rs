//! Cost of looking up, evaluating and sampling scattering functions.
//!
//! One iteration goes through 1,024 prepared pairs of directions, so that a figure divided by 1,024
//! is one call.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{
    ColorTexture, ConductorIor, Filter, Image, ImageTexture, Material, Microfacet, Rgb, Roughness, Wrap,
};
use std::hint::black_box;
use std::sync::Arc;

const COUNT: usize = 1024;

fn rough(distribution: Microfacet) -> Option<Roughness> {
    Some(Roughness {
        distribution,
        alpha_u: 0.2.into(),
        alpha_v: 0.2.into(),
    })
}

fn diffuse() -> Material {
    Material::Diffuse {
        reflectance: Rgb::splat(0.5).into(),
    }
}

fn conductor(roughness: Option<Roughness>) -> Material {
    Material::Conductor {
        ior: ConductorIor {
            eta: Rgb::new(0.143, 0.375, 1.442),
            k: Rgb::new(3.983, 2.386, 1.603),
        },
        roughness,
        specular_reflectance: Rgb::ONE.into(),
    }
}

fn dielectric(roughness: Option<Roughness>) -> Material {
    Material::Dielectric {
        eta: 1.5,
        roughness,
        specular_reflectance: Rgb::ONE.into(),
        specular_transmittance: Rgb::ONE.into(),
    }
}

fn plastic(roughness: Option<Roughness>) -> Material {
    Material::Plastic {
        eta: 1.5,
        diffuse_reflectance: Rgb::splat(0.5).into(),
        specular_reflectance: Rgb::ONE.into(),
        nonlinear: true,
        roughness,
    }
}

fn textured() -> Material {
    let codes = (0..256 * 256u32)
        .map(|i| [i as u8, (i >> 4) as u8, (i >> 8) as u8])
        .collect();
    Material::Diffuse {
        reflectance: ColorTexture::Image(ImageTexture {
            image: Arc::new(Image::from_srgb8(256, 256, codes).expect("256² codes")),
            to_uv: lightshed_scene::glam::Affine2::IDENTITY,
            filter: Filter::Bilinear,
            wrap: Wrap::Repeat,
            scale: Rgb::ONE,
        }),
    }
}

fn materials() -> Vec<(&'static str, Material)> {
    vec![
        ("diffuse", diffuse()),
        ("textured_diffuse", textured()),
        (
            "two_sided_diffuse",
            Material::TwoSided {
                front: Box::new(diffuse()),
                back: None,
            },
        ),
        ("conductor_smooth", conductor(None)),
        ("conductor_ggx", conductor(rough(Microfacet::Ggx))),
        ("conductor_beckmann", conductor(rough(Microfacet::Beckmann))),
        ("dielectric_smooth", dielectric(None)),
        ("dielectric_ggx", dielectric(rough(Microfacet::Ggx))),
        ("plastic_smooth", plastic(None)),
        ("plastic_ggx", plastic(rough(Microfacet::Ggx))),
        (
            "metallic_roughness",
            Material::MetallicRoughness {
                base_color: Rgb::splat(0.5).into(),
                metallic: 0.5.into(),
                roughness: 0.5.into(),
                transmission: 0.0.into(),
                ior: 1.5,
            },
        ),
        (
            "blend",
            Material::Blend {
                weight: 0.5.into(),
                first: Box::new(diffuse()),
                second: Box::new(conductor(rough(Microfacet::Ggx))),
            },
        ),
    ]
}

/// A fixed low-discrepancy sequence in the unit square (Roberts' R2).
fn points() -> Vec<Vec2> {
    let step = Vec2::new(0.754_877_7, 0.569_840_3);
    (0..COUNT)
        .map(|i| (Vec2::splat(0.5) + step * i as f32).fract())
        .collect()
}

fn hemisphere(u: Vec2) -> Vec3 {
    let (sin, phi) = ((1.0 - u.x * u.x).sqrt(), std::f32::consts::TAU * u.y);
    Vec3::new(sin * phi.cos(), sin * phi.sin(), u.x.max(1e-3))
}

fn benchmark(c: &mut Criterion<CpuTime>) {
    let points = points();
    let directions: Vec<Vec3> = points.iter().map(|u| hemisphere(*u)).collect();
    for (name, material) in materials() {
        material.validate().expect("sound materials");
        let mut resolve = c.benchmark_group("scene/bsdf_resolve");
        resolve.throughput(Throughput::Elements(COUNT as u64));
        resolve.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for uv in &points {
                    black_box(black_box(&material).at(*uv));
                }
            });
        });
        resolve.finish();

        let bsdf = material.at(Vec2::ZERO);
        let mut evaluate = c.benchmark_group("scene/bsdf_evaluate");
        evaluate.throughput(Throughput::Elements(COUNT as u64));
        evaluate.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for (i, wo) in directions.iter().enumerate() {
                    black_box(black_box(&bsdf).evaluate(*wo, directions[COUNT - 1 - i]));
                }
            });
        });
        evaluate.finish();

        let mut sample = c.benchmark_group("scene/bsdf_sample");
        sample.throughput(Throughput::Elements(COUNT as u64));
        sample.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for (i, wo) in directions.iter().enumerate() {
                    let u = points[COUNT - 1 - i];
                    black_box(black_box(&bsdf).sample(*wo, u.x, Vec2::new(u.y, points[i].x)));
                }
            });
        });
        sample.finish();
    }
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = benchmark
}
criterion_main!(benches);
