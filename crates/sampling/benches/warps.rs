//! Costs of the warps, each hot one beside the alternative it was chosen over (names that end in
//! `_by_…`).
//!
//! Times are for a batch of 64 samples at uniforms that are not in order, so that no branch is
//! predicted from the last.
#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use lightshed_sampling::{
    Beckmann, ConcentricDisk, CosineHemisphere, CounterRng, FreeFlight, Ggx, MicrofacetDistribution,
    PolarDisk, SphericalRectangle, SphericalTriangle, Tent, UniformCone, UniformHemisphere, UniformSphere,
    UniformTriangle, VonMisesFisher, f32_from_u32, glam, sin_cos_turns,
};

const BATCH: usize = 64;

/// Uniforms of a batch.
fn uniforms() -> [[f32; 2]; BATCH] {
    core::array::from_fn(|i| [0, 1].map(|d| f32_from_u32(CounterRng::at(1, i as u32, 0, d))))
}

/// One benchmark: `run` on each `u` of a batch.
fn bench<T>(c: &mut Criterion<CpuTime>, name: &str, mut run: impl FnMut([f32; 2]) -> T) {
    let uniforms = uniforms();
    let mut group = c.benchmark_group("sampling");
    group.throughput(Throughput::Elements(BATCH as u64));
    group.bench_function(BenchmarkId::new(format!("warp_{name}"), BATCH), |b| {
        b.iter(|| {
            for u in black_box(&uniforms) {
                black_box(run(*u));
            }
        });
    });
}

fn planar(c: &mut Criterion<CpuTime>) {
    bench(c, "sin_cos_turns", |u| sin_cos_turns(u[0]));
    bench(c, "sin_cos_turns_by_std", |u| {
        (core::f32::consts::TAU * u[0]).sin_cos()
    });
    bench(c, "concentric_disk", ConcentricDisk::sample);
    bench(c, "polar_disk", PolarDisk::sample);
    bench(c, "tent", Tent::sample);
    bench(c, "triangle", UniformTriangle::sample);
    bench(c, "triangle_by_square_root", |u| {
        let root = u[0].sqrt();
        [1.0 - root, u[1] * root, root - u[1] * root]
    });
    let flight = FreeFlight::new(black_box(0.7)).expect("a positive rate");
    bench(c, "free_flight", |u| flight.sample(u[0]));
}

fn directions(c: &mut Criterion<CpuTime>) {
    bench(c, "cosine_hemisphere", CosineHemisphere::sample);
    bench(c, "cosine_hemisphere_by_polar_disk", |u| {
        let p = PolarDisk::sample(u);
        p.extend((1.0 - u[0]).sqrt())
    });
    bench(c, "cosine_hemisphere_by_std_sin_cos", |u| {
        let ((sin, cos), r) = ((core::f32::consts::TAU * u[1]).sin_cos(), u[0].sqrt());
        Vec3::new(r * cos, r * sin, (1.0 - u[0]).sqrt())
    });
    bench(c, "uniform_hemisphere", UniformHemisphere::sample);
    bench(c, "uniform_sphere", UniformSphere::sample);
    let cone = UniformCone::from_one_minus_cos(black_box(0.1));
    bench(c, "cone", |u| cone.sample(u));
    let lobe = VonMisesFisher::new(Vec3::new(0.48, -0.6, 0.64), black_box(50.0));
    bench(c, "vmf", |u| lobe.sample(u));
    let direction = lobe.sample([0.3, 0.6]);
    bench(c, "vmf_density", |_| lobe.density(black_box(direction)));
}

fn microfacets(c: &mut Criterion<CpuTime>) {
    let view = Vec3::new(0.6, -0.48, 0.64);
    let normal = Vec3::new(0.1, 0.2, 1.0).normalize();
    fn distribution(
        c: &mut Criterion<CpuTime>,
        name: &str,
        d: impl MicrofacetDistribution,
        view: Vec3,
        normal: Vec3,
    ) {
        bench(c, &format!("{name}_visible_normal"), |u| {
            d.sample_visible_normal(black_box(view), u)
        });
        bench(c, &format!("{name}_density"), |_| {
            d.visible_normal_density(black_box(view), black_box(normal))
        });
        bench(c, &format!("{name}_masking_shadowing"), |_| {
            d.masking_shadowing(black_box(view), black_box(normal))
        });
    }
    distribution(c, "ggx", Ggx::new(0.2, 0.3), view, normal);
    distribution(c, "beckmann", Beckmann::new(0.2, 0.3), view, normal);
}

fn polygons(c: &mut Criterion<CpuTime>) {
    let vertices = [Vec3::X, Vec3::Y, Vec3::new(0.5, 0.5, 2.0)];
    bench(c, "spherical_triangle_new", |_| {
        SphericalTriangle::new(black_box(vertices))
    });
    let triangle = SphericalTriangle::new(vertices).expect("a proper triangle");
    bench(c, "spherical_triangle", |u| triangle.sample(u));
    let (corner, edges) = (Vec3::new(-0.5, -0.3, 1.0), [Vec3::X * 2.0, Vec3::Y]);
    bench(c, "spherical_rectangle_new", |_| {
        SphericalRectangle::new(black_box(corner), black_box(edges))
    });
    let rectangle = SphericalRectangle::new(corner, edges).expect("a proper rectangle");
    bench(c, "spherical_rectangle", |u| rectangle.sample(u));
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = planar, directions, microfacets, polygons
}
criterion_main!(benches);
