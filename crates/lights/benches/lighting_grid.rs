//! The lighting grid hierarchy: construction by gather against scatter, updates against
//! construction, and what a shading point costs, each for growing numbers of lights, on one thread.
//!
//! ```sh
//! cargo bench -p lightshed-lights --bench lighting_grid
//! ```
//!
//! Numbers of levels, of grid lights and of lights visited at a point are printed before the times,
//! which are per light: of all, that moves, or that is visited.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{
    BatchSize, BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main,
};
use glam::Vec3;
use lightshed_lights::{Bounds, Construction, GridChange, GridOptions, GridQuery, LightingGrid, PointLight};
use lightshed_sampling::{CounterRng, UniformSphere};
use std::hint::black_box;
use std::time::Duration;

const COUNTS: [u32; 4] = [1_000, 10_000, 100_000, 1_000_000];

/// Lights on the walls of a room of 4×3×5 and on a ball in it.
fn light(i: u32) -> PointLight {
    let mut rng = CounterRng::new(1, i, 0);
    let [u, v] = rng.next_2d();
    let intensity = Vec3::new(1.0, rng.next_f32(), rng.next_f32());
    let face = rng.next_u32() % 7;
    if face == 6 {
        let normal = UniformSphere::sample([u, v]);
        return PointLight::lambertian(Vec3::new(1.3, 0.8, 2.0) + 0.7 * normal, normal, intensity);
    }
    let size = Vec3::new(4.0, 3.0, 5.0);
    let (axis, far) = (face as usize / 2, face % 2 == 1);
    let (mut position, mut normal) = (Vec3::ZERO, Vec3::ZERO);
    (position[axis], normal[axis]) = if far { (size[axis], -1.0) } else { (0.0, 1.0) };
    position[(axis + 1) % 3] = u * size[(axis + 1) % 3];
    position[(axis + 2) % 3] = v * size[(axis + 2) % 3];
    PointLight::lambertian(position, normal, intensity)
}

fn options(alpha: f32, construction: Construction) -> GridOptions {
    GridOptions {
        alpha,
        construction,
        bounds: Some(Bounds::new(Vec3::ZERO, Vec3::new(4.0, 3.0, 5.0))),
        ..GridOptions::default()
    }
}

fn lights(count: u32) -> Vec<PointLight> {
    (0..count).map(light).collect()
}

/// Few and short samples: constructions are long.
fn group(criterion: &mut Criterion<CpuTime>) -> BenchmarkGroup<'_, CpuTime> {
    let mut group = criterion.benchmark_group("lights");
    group.sample_size(10);
    group.warm_up_time(Duration::from_millis(100));
    group.measurement_time(Duration::from_millis(1000));
    group
}

/// Construction, and updates of one light, of a thousandth, a hundredth and a tenth of them.
fn construction(criterion: &mut Criterion<CpuTime>) {
    let mut group = group(criterion);
    for count in COUNTS {
        let lights = lights(count);
        let mut gathered = LightingGrid::new(&lights, &options(1.0, Construction::Gather)).unwrap();
        let (levels, finest) = (gathered.level_count(), gathered.grid_lights(1).len());
        println!("{count} lights: {levels} levels, {finest} grid lights in the finest");
        group.throughput(Throughput::Elements(u64::from(count)));
        group.bench_function(BenchmarkId::new("grid_gather", count), |b| {
            b.iter(|| gathered.rebuild(black_box(&lights)));
        });
        let mut scattered = LightingGrid::new(&lights, &options(1.0, Construction::Scatter)).unwrap();
        group.bench_function(BenchmarkId::new("grid_scatter", count), |b| {
            b.iter(|| scattered.rebuild(black_box(&lights)));
        });
        let mut next = count;
        for (share, name) in [
            (count, "one"),
            (1_000, "permille"),
            (100, "percent"),
            (10, "tenth"),
        ] {
            let mut changes = || -> Vec<GridChange> {
                let change = |_| {
                    next += 1;
                    GridChange {
                        index: next.wrapping_mul(7919) % count,
                        light: light(next),
                    }
                };
                (0..count / share).map(change).collect()
            };
            group.throughput(Throughput::Elements(u64::from(count / share)));
            group.bench_function(BenchmarkId::new(format!("grid_move_{name}"), count), |b| {
                b.iter_batched(
                    &mut changes,
                    |changes| gathered.update(&changes),
                    BatchSize::LargeInput,
                );
            });
        }
    }
}

/// Cost of a shading point on the surfaces, and of the sum over all lights there.
fn queries(criterion: &mut Criterion<CpuTime>) {
    let mut group = group(criterion);
    let points: Vec<(Vec3, Vec3)> = (0..400)
        .map(|i| {
            let on = light(1_000_000_000 + i);
            let normal = UniformSphere::sample(CounterRng::new(2, i, 0).next_2d());
            (on.position + 1e-3 * on.normal, normal)
        })
        .collect();
    for count in COUNTS {
        let lights = lights(count);
        let few = &points[..4];
        group.throughput(Throughput::Elements(few.len() as u64 * u64::from(count)));
        group.bench_function(BenchmarkId::new("irradiance_of_all", count), |b| {
            b.iter(|| {
                few.iter()
                    .map(|&(point, normal)| irradiance_of_all(&lights, point, normal))
                    .sum::<Vec3>()
            });
        });
        for (alpha, first_level) in [(1.0, 1), (1.0, 0), (2.0, 1)] {
            let grid = LightingGrid::new(&lights, &options(alpha, Construction::Gather)).unwrap();
            let query = GridQuery {
                first_level,
                ..GridQuery::default()
            };
            let mut visited = 0u64;
            for &(point, _) in &points {
                grid.visit(point, &query, |_| visited += 1);
            }
            let mean = visited as f64 / points.len() as f64;
            println!(
                "{count} lights, α = {alpha}, from level {first_level}: {mean:.0} lights visited at a point"
            );
            group.throughput(Throughput::Elements(visited));
            let function = format!("grid_irradiance_alpha{alpha}_from{first_level}");
            group.bench_function(BenchmarkId::new(function, count), |b| {
                b.iter(|| {
                    for &(point, normal) in &points {
                        let mut sum = Vec3::ZERO;
                        grid.visit(point, &query, |influence| {
                            let cosine = normal.dot(influence.direction).max(0.0);
                            sum += influence.intensity * (cosine / influence.distance_squared.max(1e-6));
                        });
                        black_box(sum);
                    }
                });
            });
        }
    }
}

fn irradiance_of_all(lights: &[PointLight], point: Vec3, normal: Vec3) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for light in lights {
        let to_light = light.position - point;
        let squared = to_light.length_squared().max(1e-6);
        let direction = to_light / squared.sqrt();
        let cosine = normal.dot(direction).max(0.0);
        sum += light.intensity * (light.emission(-direction) * cosine / squared);
    }
    sum
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = construction, queries
}
criterion_main!(benches);
