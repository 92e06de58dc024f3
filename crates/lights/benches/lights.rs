//! Building light structures and choosing from them, alternatives side by side.
//!
//! ```sh
//! cargo bench -p lightshed-lights --features parallel --bench lights
//! cargo bench -p lightshed-lights --features parallel --bench lights -- lights/sample
//! ```
//!
//! Builds are on as many threads as there are processors, by the time of the wall; choosing is on
//! one, by processor time, per choice.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::measurement::Measurement;
use criterion::{
    BenchmarkGroup, BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main,
};
use lightshed_lights::glam::Vec3;
use lightshed_lights::{
    Bounds, BvhBuild, Light, LightBvh, LightSampler, OrientationCone, PerfectTree, PerfectTreeOptions,
    PowerLights, ShadingPoint, Stride, UniformLights, Weighting,
};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_spatial::{Curve, CurveCube};
use rdst::{RadixKey, RadixSort};
use std::hint::black_box;
use std::time::Duration;

/// Small patches strewn through a cube, in clusters of different sizes.
fn lights(count: usize) -> Vec<Light> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(7, i as u32, 0);
            let mut shared = CounterRng::new(7, rng.next_u32() % 64, 1);
            let place =
                |rng: &mut CounterRng| Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
            let size = 0.02 + 0.3 * shared.next_f32();
            let center = place(&mut shared) * 10.0 + place(&mut rng) * 10.0 * size;
            let normal = UniformSphere::sample(rng.next_2d());
            Light {
                bounds: Bounds::new(center - 0.01, center + 0.01),
                intensity: 0.1 + rng.next_f32(),
                cone: Some(OrientationCone::diffuse(normal)),
            }
        })
        .collect()
}

/// A code and the index of its light, as rdst sorts them.
#[derive(Clone, Copy)]
struct Keyed {
    code: u64,
    index: u32,
}

impl RadixKey for Keyed {
    const LEVELS: usize = 8;

    #[inline]
    fn get_level(&self, level: usize) -> u8 {
        (self.code >> (8 * level)) as u8
    }
}

/// Morton codes of the lights' centres.
fn keys(lights: &[Light]) -> Vec<Keyed> {
    let all = Bounds::of_points(lights.iter().map(|light| light.bounds.center()));
    let cube = CurveCube::around(&all);
    let key = |(index, light): (u32, &Light)| Keyed {
        code: Curve::Morton.code(cube.cell(&light.bounds)),
        index,
    };
    (0..).zip(lights).map(key).collect()
}

/// The copy of the lights and the sort of their codes, by rdst, are what any build must do.
fn build(criterion: &mut Criterion) {
    let mut group = group(criterion);
    group.sampling_mode(SamplingMode::Flat);
    for count in [1_000, 10_000, 100_000, 1_000_000, 4_000_000] {
        let lights = lights(count);
        let curve = || LightBvh::with_build(&lights, BvhBuild::AlongCurve).expect("the lights are sound");
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("copy", count), |b| b.iter(|| lights.to_vec()));
        let keys = keys(&lights);
        let mut sorted = keys.clone();
        group.bench_function(BenchmarkId::new("sort_codes", count), |b| {
            b.iter(|| {
                sorted.copy_from_slice(&keys);
                sorted.radix_sort_unstable();
                sorted[0].index
            });
        });
        group.bench_function(BenchmarkId::new("build_perfect", count), |b| {
            b.iter(|| PerfectTree::new(&lights));
        });
        let mut tree = PerfectTree::new(&lights).expect("the lights are sound");
        group.bench_function(BenchmarkId::new("rebuild_perfect", count), |b| {
            b.iter(|| tree.rebuild(&lights));
        });
        group.bench_function(BenchmarkId::new("build_curve_bvh", count), |b| b.iter(curve));
        let mut tree = curve();
        group.bench_function(BenchmarkId::new("rebuild_curve_bvh", count), |b| {
            b.iter(|| tree.rebuild(&lights));
        });
        group.bench_function(BenchmarkId::new("build_bvh", count), |b| {
            b.iter(|| LightBvh::new(&lights));
        });
    }
}

/// Few and short samples: there are many benchmarks.
fn group<M: Measurement>(criterion: &mut Criterion<M>) -> BenchmarkGroup<'_, M> {
    let mut group = criterion.benchmark_group("lights");
    group.sample_size(12);
    group.warm_up_time(Duration::from_millis(100));
    group.measurement_time(Duration::from_millis(600));
    group
}

fn choose(criterion: &mut Criterion<CpuTime>) {
    let mut group = group(criterion);
    for count in [1_000, 10_000, 100_000, 1_000_000] {
        let lights = lights(count);
        let plain = PerfectTreeOptions::default();
        let perfect = |options| PerfectTree::with_options(&lights, options).expect("the lights are sound");
        let uniform = UniformLights::new(count).expect("there are some");
        let power = PowerLights::new(&lights).expect("the lights are sound");
        let curve = LightBvh::with_build(&lights, BvhBuild::AlongCurve).expect("the lights are sound");
        let bvh = LightBvh::new(&lights).expect("the lights are sound");
        time(&mut group, "uniform", count, &uniform);
        time(&mut group, "power", count, &power);
        time(&mut group, "perfect", count, &perfect(plain));
        let by_one = perfect(plain.with_stride(Stride::One));
        time(&mut group, "perfect_by_binary_steps", count, &by_one);
        // Eqs. 4.1 and 4.2 alone.
        let min_max = perfect(plain.with_weighting(Weighting::MinMax));
        time(&mut group, "perfect_min_max", count, &min_max);
        time(&mut group, "curve_bvh", count, &curve);
        time(&mut group, "bvh", count, &bvh);
    }
}

/// Choices one by one, one for each of many points, several for one point, and probabilities.
fn time<S: LightSampler>(group: &mut BenchmarkGroup<'_, CpuTime>, name: &str, count: usize, sampler: &S) {
    const POINTS: usize = 1024;
    let points: Vec<ShadingPoint> = (0..POINTS as u32)
        .map(|i| {
            let mut rng = CounterRng::new(3, i, 9);
            let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 20.0 - 10.0;
            ShadingPoint::new(place, UniformSphere::sample(rng.next_2d()), 1.0)
        })
        .collect();
    let numbers: Vec<u64> = (0..POINTS as u32)
        .map(|i| CounterRng::new(1, i, 0).next_u64())
        .collect();
    let id = |function: &str| BenchmarkId::new(format!("{function}_{name}"), count);
    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function(id("sample"), |b| {
        b.iter(|| {
            for (at, &u) in points.iter().zip(&numbers) {
                black_box(sampler.sample(at, u));
            }
        });
    });
    let mut choices = vec![None; POINTS];
    group.bench_function(id("sample_each"), |b| {
        b.iter(|| {
            sampler.sample_each(&points, &numbers, &mut choices);
            black_box(&choices);
        });
    });
    for each in [4usize, 16, 64] {
        let u: Vec<u64> = numbers
            .iter()
            .flat_map(|number| {
                let stratum = u64::MAX / each as u64;
                let within = move |k: u64| number.rotate_left(17 * k as u32) % stratum;
                (0..each as u64).map(move |k| stratum * k + within(k))
            })
            .collect();
        let mut choices = vec![None; each];
        group.throughput(Throughput::Elements((POINTS * each) as u64));
        group.bench_function(id(&format!("sample_{each}")), |b| {
            b.iter(|| {
                for (at, u) in points.iter().zip(u.chunks(each)) {
                    sampler.sample_many(at, u, &mut choices);
                    black_box(&choices);
                }
            });
        });
    }
    let chosen: Vec<u32> = points
        .iter()
        .zip(&numbers)
        .map(|(at, &u)| sampler.sample(at, u).map_or(0, |choice| choice.light))
        .collect();
    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function(id("pmf"), |b| {
        b.iter(|| {
            for (at, &light) in points.iter().zip(&chosen) {
                black_box(sampler.pmf(at, light));
            }
        });
    });
}

criterion_group!(builds, build);
criterion_group! {
    name = choices;
    config = by_cpu_time();
    targets = choose
}
criterion_main!(builds, choices);
