//! Costs of the crate's hot functions as `sampling/<function>/<size>`, each beside the alternatives
//! it was chosen over.
#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_sampling::glam::{Vec2, Vec3};
use lightshed_sampling::{
    AliasTable, CompensatedSum, CounterRng, Frame, PathSeed, PiecewiseConstant1d, PiecewiseConstant2d,
    SobolSampler, choose, octahedral_decode, octahedral_encode, octahedral_pack32, octahedral_unpack32,
    pairwise_sum,
};
use rand::{Rng, SeedableRng};
use rand_pcg::{Pcg32, Pcg64Mcg};

/// A fresh stream a pixel, then `draws` numbers: what a path tracer does.
fn generators(c: &mut Criterion<CpuTime>) {
    let mut group = c.benchmark_group("sampling");
    for draws in [1u32, 8, 64, 1024] {
        group.throughput(Throughput::Elements(u64::from(draws)));
        let mut pixel = 0u32;
        let mut next_pixel = move || {
            pixel = pixel.wrapping_add(1);
            black_box(pixel)
        };
        macro_rules! stream {
            ($name:literal, $new:expr) => {
                group.bench_with_input(BenchmarkId::new($name, draws), &draws, |b, &draws| {
                    b.iter(|| {
                        let mut rng = $new(next_pixel());
                        (0..draws).fold(0, |sum, _| rng.next_u32() ^ sum)
                    });
                });
            };
        }
        stream!("counter_rng", |pixel| CounterRng::new(1, pixel, 2));
        stream!("path_seed_stream", |pixel| PathSeed::new(u64::from(pixel))
            .stream());
        stream!("sobol_sampler", |pixel| SobolSampler::new(1, pixel, 2));
        stream!("rand_pcg32", |pixel| Pcg32::seed_from_u64(u64::from(pixel)));
        stream!("rand_pcg64mcg", |pixel| Pcg64Mcg::seed_from_u64(u64::from(pixel)));
        group.bench_with_input(BenchmarkId::new("counter_rng_at", draws), &draws, |b, &draws| {
            b.iter(|| {
                let pixel = next_pixel();
                (0..draws).fold(0, |sum, d| CounterRng::at(1, pixel, 2, d) ^ sum)
            });
        });
    }
    group.finish();
}

fn weights(n: u32) -> Vec<f32> {
    (0..n)
        .map(|i| CounterRng::new(9, i, 0).next_f32().powi(4))
        .collect()
}

/// Inputs come from a table, so that a generator's time is not in the figures.
fn discrete(c: &mut Criterion<CpuTime>) {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let words: Vec<u64> = (0..4096).map(|_| rng.next_u64()).collect();
    let mut i = 0;
    let mut word = move || {
        i = (i + 1) % 4096;
        words[i]
    };
    let mut group = c.benchmark_group("sampling");
    for n in [16u32, 4096, 1 << 16, 1 << 20] {
        let weights = weights(n);
        let table = AliasTable::new(&weights).unwrap();
        let piecewise = PiecewiseConstant1d::new(&weights).unwrap();
        let mut sum = 0.0;
        let cdf: Vec<f64> = weights
            .iter()
            .map(|&weight| {
                sum += f64::from(weight);
                sum
            })
            .collect();
        group.throughput(Throughput::Elements(1));
        group.bench_function(BenchmarkId::new("alias_sample", n), |b| {
            b.iter(|| table.sample(word()))
        });
        group.bench_function(BenchmarkId::new("alias_sample_index", n), |b| {
            b.iter(|| table.sample_index(word()))
        });
        group.bench_function(BenchmarkId::new("binary_search", n), |b| {
            b.iter(|| {
                let u = (word() >> 11) as f64 / (1u64 << 53) as f64 * sum;
                cdf.partition_point(|&x| x <= u)
            })
        });
        group.bench_function(BenchmarkId::new("piecewise1d_sample", n), |b| {
            b.iter(|| piecewise.sample_word(word() as u32))
        });
        if n == 16 {
            group.bench_function(BenchmarkId::new("choose", n), |b| {
                b.iter(|| choose(&weights, (word() >> 40) as f32 / 16_777_216.0))
            });
        }
        group.throughput(Throughput::Elements(u64::from(n)));
        group.bench_function(BenchmarkId::new("alias_build", n), |b| {
            b.iter(|| AliasTable::new(&weights))
        });
        group.bench_function(BenchmarkId::new("piecewise1d_build", n), |b| {
            b.iter(|| PiecewiseConstant1d::new(&weights))
        });
    }
    for (width, height) in [(64u32, 32u32), (4096, 2048)] {
        let map = weights(width * height);
        let density = PiecewiseConstant2d::new(&map, width as usize).unwrap();
        let size = width * height;
        group.throughput(Throughput::Elements(1));
        group.bench_function(BenchmarkId::new("piecewise2d_sample", size), |b| {
            b.iter(|| {
                let word = word();
                density.sample_words([word as u32, (word >> 32) as u32])
            })
        });
        group.bench_function(BenchmarkId::new("piecewise2d_pdf", size), |b| {
            b.iter(|| {
                let word = word();
                density.pdf([word as u32, (word >> 32) as u32].map(|word| word as f32 / 4_294_967_296.0))
            })
        });
        // The flat alternative: one alias table over all cells.
        let table = AliasTable::new(&map).unwrap();
        group.bench_function(BenchmarkId::new("alias2d_sample", size), |b| {
            b.iter(|| table.sample(word()))
        });
        group.throughput(Throughput::Elements(u64::from(size)));
        group.sample_size(10);
        group.bench_function(BenchmarkId::new("piecewise2d_build", size), |b| {
            b.iter(|| PiecewiseConstant2d::new(&map, width as usize))
        });
        group.sample_size(100);
    }
    group.finish();
}

fn geometry(c: &mut Criterion<CpuTime>) {
    let directions: Vec<Vec3> = (0..1024)
        .map(|i| {
            let mut rng = CounterRng::new(3, i, 0);
            Vec3::from_array(core::array::from_fn(|_| rng.next_f32() - 0.5)).normalize()
        })
        .collect();
    let points: Vec<Vec2> = directions.iter().map(|&d| octahedral_encode(d)).collect();
    let packed: Vec<u32> = directions.iter().map(|&d| octahedral_pack32(d)).collect();
    let mut group = c.benchmark_group("sampling");
    macro_rules! over {
        ($name:literal, $items:expr, $f:expr) => {
            group.throughput(Throughput::Elements($items.len() as u64));
            group.bench_function(BenchmarkId::new($name, $items.len()), |b| {
                b.iter(|| {
                    for &item in &$items {
                        black_box($f(item));
                    }
                })
            });
        };
    }
    over!("octahedral_encode", directions, octahedral_encode);
    over!("octahedral_decode", points, octahedral_decode);
    over!("octahedral_pack32", directions, octahedral_pack32);
    over!("octahedral_unpack32", packed, octahedral_unpack32);
    over!("frame_from_normal", directions, Frame::from_normal);
    group.finish();
}

fn sums(c: &mut Criterion<CpuTime>) {
    let terms = weights(65_536);
    let mut group = c.benchmark_group("sampling");
    group.throughput(Throughput::Elements(terms.len() as u64));
    group.bench_function(BenchmarkId::new("plain_sum", terms.len()), |b| {
        b.iter(|| terms.iter().sum::<f32>())
    });
    group.bench_function(BenchmarkId::new("pairwise_sum", terms.len()), |b| {
        b.iter(|| pairwise_sum(&terms))
    });
    group.bench_function(BenchmarkId::new("compensated_sum", terms.len()), |b| {
        b.iter(|| terms.iter().copied().collect::<CompensatedSum<f32>>().value())
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = generators, discrete, geometry, sums
}
criterion_main!(benches);
