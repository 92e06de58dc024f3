//! Choosing points on emitters, directions to the sky, and looking textures up.
//!
//! ```sh
//! cargo bench -p lightshed-scene --bench emitters
//! ```
//!
//! Sizes are numbers of emitters, or of texels.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_scene::glam::{Affine2, Vec2, Vec3};
use lightshed_scene::{Filter, Image, ImageTexture, Ray, Rgb, Scene, SurfacePoint, Wrap, builtin};
use std::hint::black_box;
use std::sync::Arc;

const CALLS: usize = 1024;

/// Numbers of a call.
type Numbers = (u64, [f32; 2]);

fn numbers() -> Vec<Numbers> {
    (0..CALLS as u32)
        .map(|i| {
            let mut rng = CounterRng::new(1, i, 0);
            (rng.next_u64(), rng.next_2d())
        })
        .collect()
}

/// Points on the surfaces that the camera sees, one after the other along the rows of its image.
fn seen(scene: &Scene) -> Vec<SurfacePoint> {
    let size = Vec2::new(scene.settings().width as f32, scene.settings().height as f32);
    let at = |i: u32| Vec2::new((i % 32) as f32, (i / 32 % 32) as f32) / 32.0 * size;
    let points = (0..).map(at).map(|film| scene.camera().ray(film, [0.5; 2]));
    points
        .filter_map(|ray| scene.intersect(&ray))
        .take(CALLS)
        .collect()
}

fn emitters(criterion: &mut Criterion<CpuTime>) {
    let mut group = criterion.benchmark_group("scene");
    group.throughput(Throughput::Elements(CALLS as u64));
    let numbers = numbers();
    for name in ["cornell", "many-lights"] {
        let scene = Scene::new(&builtin::by_name(name).expect("it is built in")).expect("it is sound");
        let (emitters, points) = (scene.emitters_by_power(), seen(&scene));
        let size = scene.emitters().len();
        group.bench_function(BenchmarkId::new("emitter_sample", size), |b| {
            b.iter(|| {
                for (point, &(u_select, u)) in points.iter().zip(&numbers) {
                    black_box(emitters.sample(point.position, u_select, u));
                }
            });
        });
        // What a scattered ray meets.
        let met: Vec<SurfacePoint> = points
            .iter()
            .zip(&numbers)
            .filter_map(|(point, &(u_select, u))| {
                let light = emitters.sample(point.position, u_select, u)?;
                scene.intersect(&Ray::new(
                    point.position + light.direction * 1e-3,
                    light.direction,
                ))
            })
            .filter(|met| met.emitter != SurfacePoint::NO_EMITTER)
            .collect();
        let met: Vec<&SurfacePoint> = met.iter().cycle().take(CALLS).collect();
        group.bench_function(BenchmarkId::new("emitter_pdf", size), |b| {
            b.iter(|| {
                for (point, met) in points.iter().zip(&met) {
                    black_box(emitters.pdf(point.position, met));
                }
            });
        });
    }
    let scene = Scene::new(&builtin::by_name("cloud").expect("it is built in")).expect("it is sound");
    let sky = scene.emitters().environment().expect("the cloud has a sky");
    let directions: Vec<Vec3> = numbers.iter().map(|&(_, u)| UniformSphere::sample(u)).collect();
    group.bench_function(BenchmarkId::new("sky_sample", "cloud"), |b| {
        b.iter(|| {
            for &(_, u) in &numbers {
                black_box(sky.sample(u));
            }
        });
    });
    group.bench_function(BenchmarkId::new("sky_radiance", "cloud"), |b| {
        b.iter(|| {
            for &direction in &directions {
                black_box(sky.radiance(direction));
            }
        });
    });
    group.bench_function(BenchmarkId::new("sky_pdf", "cloud"), |b| {
        b.iter(|| {
            for &direction in &directions {
                black_box(sky.pdf(direction));
            }
        });
    });
}

fn textures(criterion: &mut Criterion<CpuTime>) {
    let mut group = criterion.benchmark_group("scene");
    group.throughput(Throughput::Elements(CALLS as u64));
    let numbers = numbers();
    for side in [64u32, 1024, 4096] {
        let codes = (0..side * side)
            .map(|i| [i as u8, (i >> 8) as u8, (i >> 16) as u8])
            .collect();
        let image = Arc::new(Image::from_srgb8(side, side, codes).expect("as many as it says"));
        for (name, filter) in [("bilinear", Filter::Bilinear), ("nearest", Filter::Nearest)] {
            let texture = ImageTexture {
                image: Arc::clone(&image),
                to_uv: Affine2::IDENTITY,
                filter,
                wrap: Wrap::Repeat,
                scale: Rgb::ONE,
            };
            group.bench_function(BenchmarkId::new(format!("texture_{name}"), side * side), |b| {
                b.iter(|| {
                    for &(_, u) in &numbers {
                        black_box(texture.at(Vec2::from(u)));
                    }
                });
            });
        }
    }
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = emitters, textures
}
criterion_main!(benches);
