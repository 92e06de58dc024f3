//! Rays through each tree, alone and in company: `scene/rays_<query>_<alone|together>/<tree>`; and
//! through a few boxes, without a tree and with one:
//! `scene/few/<query>_<alone|together>/<flat|tree>/<triangles>`.
//!
//! The geometry is a ball of 80 thousand triangles in a box, the rays are what a path tracer asks:
//! from points on the surfaces, in all directions. One iteration is one ray.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{
    Accelerator, AcceleratorKind, HitBatch, Preset, Ray, RayBatch, Sphere, TriangleMesh, builtin,
};
use std::hint::black_box;
use std::time::Duration;

const RAYS: usize = 4096;

fn corners(mesh: &TriangleMesh) -> impl Iterator<Item = [Vec3; 3]> + '_ {
    mesh.indices
        .iter()
        .map(|indices| indices.map(|i| mesh.positions[i as usize]))
}

fn geometry() -> Vec<[Vec3; 3]> {
    let ball = builtin::icosphere(Vec3::new(0.1, -0.2, 0.05), 0.6, 6);
    let room = builtin::cuboid(Affine3A::IDENTITY);
    corners(&ball).chain(corners(&room)).collect()
}

fn rays(triangles: &[[Vec3; 3]]) -> Vec<Ray> {
    let tree = Accelerator::build(triangles, &[], AcceleratorKind::Wide, Preset::Fast);
    let mut rays = Vec::with_capacity(RAYS);
    let mut rng = CounterRng::new(1, 0, 0);
    let mut origin = Vec3::new(0.0, 0.0, 0.9);
    while rays.len() < RAYS {
        let ray = Ray::new(origin, UniformSphere::sample(rng.next_2d()));
        rays.push(ray);
        if let Some(hit) = tree.intersect(&ray) {
            origin = ray.origin + ray.direction * (hit.t * 0.999);
        }
    }
    rays
}

fn bench(criterion: &mut Criterion<CpuTime>) {
    let triangles = geometry();
    let rays = rays(&triangles);
    for &(name, kind) in AcceleratorKind::ALL {
        let tree = Accelerator::build(&triangles, &[], kind, Preset::High);
        let mut alone = criterion.benchmark_group("scene/rays_nearest_alone");
        alone
            .throughput(Throughput::Elements(RAYS as u64))
            .bench_function(BenchmarkId::from_parameter(name), |b| {
                b.iter(|| {
                    rays.iter()
                        .filter(|ray| tree.intersect(black_box(ray)).is_some())
                        .count()
                });
            });
        alone.finish();
        let mut together = criterion.benchmark_group("scene/rays_nearest_together");
        let mut hits = vec![None; RAYS];
        together
            .throughput(Throughput::Elements(RAYS as u64))
            .bench_function(BenchmarkId::from_parameter(name), |b| {
                b.iter(|| tree.intersect_many(black_box(&rays), &mut hits))
            });
        together.finish();
        let mut any = criterion.benchmark_group("scene/rays_any_together");
        let mut occluded = vec![false; RAYS];
        any.throughput(Throughput::Elements(RAYS as u64)).bench_function(
            BenchmarkId::from_parameter(name),
            |b| {
                b.iter(|| tree.occluded_many(black_box(&rays), &mut occluded));
            },
        );
        any.finish();
    }
    let mut build = criterion.benchmark_group("scene/build");
    build.sample_size(10);
    for (name, quality) in [
        ("fast", Preset::Fast),
        ("medium", Preset::Medium),
        ("high", Preset::High),
    ] {
        build.throughput(Throughput::Elements(triangles.len() as u64));
        build.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| Accelerator::build(black_box(&triangles), &[], AcceleratorKind::Wide, quality));
        });
    }
    build.finish();
}

/// Boxes in a box.
fn boxes(count: usize) -> Vec<[Vec3; 3]> {
    let mut rng = CounterRng::new(2, 0, 0);
    let mut triangles: Vec<[Vec3; 3]> = corners(&builtin::cuboid(Affine3A::IDENTITY)).collect();
    for _ in 1..count {
        let place = UniformSphere::sample(rng.next_2d()) * 0.6;
        let turned = Affine3A::from_translation(place)
            * Affine3A::from_rotation_y(rng.next_f32())
            * Affine3A::from_scale(Vec3::splat(0.1 + 0.2 * rng.next_f32()));
        triangles.extend(corners(&builtin::cuboid(turned)));
    }
    triangles
}

fn bench_few(criterion: &mut Criterion<CpuTime>) {
    // A sphere out of reach needs a tree.
    let far = Sphere {
        center: Vec3::splat(100.0),
        radius: 1e-3,
    };
    let mut group = criterion.benchmark_group("scene/few");
    group
        .throughput(Throughput::Elements(RAYS as u64))
        .sample_size(20)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));
    for count in 1..=5 {
        let triangles = boxes(count);
        let rays = rays(&triangles);
        for (name, spheres) in [("flat", &[][..]), ("tree", &[far][..])] {
            let few = Accelerator::build(&triangles, spheres, AcceleratorKind::Wide, Preset::High);
            let id = |query: &str| BenchmarkId::new(format!("{query}/{name}"), triangles.len());
            group.bench_function(id("nearest_alone"), |b| {
                b.iter(|| {
                    rays.iter()
                        .filter(|ray| few.intersect(black_box(ray)).is_some())
                        .count()
                });
            });
            let batches: Vec<RayBatch> = rays
                .chunks(RayBatch::CAPACITY)
                .map(|rays| {
                    let mut batch = RayBatch::NOWHERE;
                    batch.fill(rays);
                    batch
                })
                .collect();
            let mut hits = HitBatch::NONE;
            group.bench_function(id("nearest_together"), |b| {
                b.iter(|| {
                    for batch in &batches {
                        few.intersect_batch(black_box(batch), RayBatch::CAPACITY, &mut hits);
                    }
                });
            });
            group.bench_function(id("any_together"), |b| {
                b.iter(|| {
                    batches.iter().fold(0, |bits, batch| {
                        bits ^ few.occluded_batch(black_box(batch), RayBatch::CAPACITY)
                    })
                });
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = bench, bench_few
}
criterion_main!(benches);
