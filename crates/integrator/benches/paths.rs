//! Paths, trees of candidates, and shifts from pixel to pixel.
//!
//! ```sh
//! cargo bench -p lightshed-integrator --bench paths
//! ```

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_film::{MAX_BATCH, PixelEstimator, SampleId};
use lightshed_integrator::{PathTracer, SceneWorld};
use lightshed_resampling::ShiftMapping;
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Rgb, Scene, builtin};
use lightshed_shift::{Connectability, Finding, PathDomain, PathSample, PathShift, TreeTracer};
use std::hint::black_box;

/// Pixels along an edge of the images.
const SIDE: u32 = 64;
/// Trees that are traced together.
const TREES: usize = 64;

fn scene(name: &str) -> Scene {
    let mut description = builtin::by_name(name).expect("it is built in");
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    Scene::new(&description).expect("built-in scenes are sound")
}

/// A path for each pixel, in batches and alone.
fn paths(criterion: &mut Criterion<CpuTime>) {
    let mut group = criterion.benchmark_group("integrator");
    let ids: Vec<SampleId> = (0..SIDE * SIDE)
        .map(|i| SampleId {
            x: i % SIDE,
            y: i / SIDE,
            index: 0,
        })
        .collect();
    group.throughput(Throughput::Elements(ids.len() as u64));
    group.sample_size(20);
    for name in ["cornell", "cornell-glossy", "many-lights"] {
        let scene = scene(name);
        let tracer = PathTracer::new(&scene, scene.emitters_by_power());
        let mut values = [Rgb::ZERO; MAX_BATCH];
        group.bench_function(BenchmarkId::new(format!("paths_{name}"), ids.len()), |b| {
            b.iter(|| {
                for ids in ids.chunks(MAX_BATCH) {
                    tracer.sample_many(ids, 0, &mut values);
                    black_box(&values);
                }
            });
        });
        group.bench_function(BenchmarkId::new(format!("paths_alone_{name}"), ids.len()), |b| {
            b.iter(|| {
                for id in &ids {
                    black_box(tracer.sample(id.x, id.y, id.index, 0));
                }
            });
        });
    }
}

/// The paths behind what the pixels see; two pixels side by side stand beside each other.
fn domains<'a>(
    world: &'a SceneWorld<'a>,
    connectability: Connectability,
) -> Vec<PathDomain<'a, SceneWorld<'a>>> {
    let scene = world.scene();
    let behind = |i: u32| {
        let film = Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5);
        let ray = scene.camera().ray(film, [0.5; 2]);
        let hit = scene.accelerator().intersect(&ray)?;
        let first = world.arrive(&ray, &hit);
        Some(PathDomain::behind(
            world,
            first,
            -ray.direction,
            connectability,
            8,
        ))
    };
    (0..SIDE * SIDE).filter_map(behind).collect()
}

/// Candidates from trees, and their shifts to the pixel beside and back.
fn shifts(criterion: &mut Criterion<CpuTime>) {
    let mut group = criterion.benchmark_group("shift");
    group.sample_size(20);
    for name in ["cornell", "cornell-glossy"] {
        let scene = scene(name);
        let world = SceneWorld::new(&scene, scene.emitters_by_power());
        let extent = scene.extent();
        let mappings = [
            ("reconnection", Connectability::reconnection(0.02 * extent)),
            ("hybrid", Connectability::hybrid(0.2, 0.02 * extent)),
            ("replay", Ok(Connectability::REPLAY)),
        ];
        for (mapping, connectability) in mappings {
            let domains = domains(&world, connectability.expect("they are thresholds"));
            let mut tracer = TreeTracer::new(u32::MAX);
            let mut found: Vec<(usize, PathSample)> = Vec::new();
            let mut candidates = |found: &mut Vec<(usize, PathSample)>| {
                found.clear();
                for (chunk, domains) in domains.chunks(TREES).enumerate() {
                    let seeds = (0u32..).map(|i| PathSeed::draw(&mut CounterRng::new(1, i, chunk as u32)));
                    let starts: Vec<_> = domains.iter().zip(seeds).collect();
                    tracer.trace(&starts, |tree, finding| {
                        if let Finding::Path(sample, _) = finding {
                            found.push((chunk * TREES + tree, *sample));
                        }
                    });
                }
            };
            group.throughput(Throughput::Elements(domains.len() as u64));
            group.bench_function(
                BenchmarkId::new(format!("trees_{name}_{mapping}"), domains.len()),
                |b| {
                    b.iter(|| candidates(&mut found));
                },
            );
            found.retain(|&(place, _)| place + 1 < domains.len());
            group.throughput(Throughput::Elements(found.len() as u64));
            group.bench_function(
                BenchmarkId::new(format!("shift_{name}_{mapping}"), found.len()),
                |b| {
                    b.iter(|| {
                        for (place, sample) in &found {
                            let (from, to) = (&domains[*place], &domains[place + 1]);
                            let _ = black_box(PathShift::default().shift(sample, from, to));
                        }
                    });
                },
            );
        }
    }
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = paths, shifts
}
criterion_main!(benches);
