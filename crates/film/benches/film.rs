//! What the film, the render loop and the metrics cost beside the paths they serve.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_film::{
    Budget, Film, ImageComparison, PixelEstimator, PixelStatistics, RenderOptions, RgbImage, render,
    structural_similarity,
};
use lightshed_sampling::Rgb;
use std::hint::black_box;
use std::sync::atomic::AtomicBool;

/// The cheapest estimator there is, so that only the loop around it is measured.
struct Constant;

impl PixelEstimator for Constant {
    #[inline]
    fn sample(&self, x: u32, y: u32, sample_index: u32, _: u64) -> Rgb {
        Rgb::new(x as f32, y as f32, sample_index as f32)
    }
}

fn film(c: &mut Criterion<CpuTime>) {
    let mut group = c.benchmark_group("film");
    let samples: Vec<Rgb> = (0..1024)
        .map(|i| Rgb::new(i as f32, 1.0 / (i + 1) as f32, 0.5))
        .collect();
    group.throughput(Throughput::Elements(samples.len() as u64));
    group.bench_function(BenchmarkId::new("film_add", samples.len()), |b| {
        b.iter(|| {
            let mut statistics = PixelStatistics::default();
            for &sample in black_box(&samples) {
                statistics.add(sample);
            }
            statistics
        });
    });

    let (width, height, spp) = (256, 256, 16);
    let pixels = u64::from(width * height);
    group.throughput(Throughput::Elements(pixels * u64::from(spp)));
    let options = RenderOptions {
        threads: 1,
        ..RenderOptions::new(width, height, Budget::Samples(spp))
    };
    group.bench_function(BenchmarkId::new("render_loop", pixels * u64::from(spp)), |b| {
        b.iter(|| render(&Constant, black_box(&options), &|_| (), &AtomicBool::new(false)));
    });

    let film = render(&Constant, &options, &|_| (), &AtomicBool::new(false)).map(|outcome| outcome.film);
    let film = film.expect("the options are sound");
    group.throughput(Throughput::Elements(pixels));
    group.bench_function(BenchmarkId::new("film_merge", pixels), |b| {
        b.iter_batched_ref(
            || film.clone(),
            |into: &mut Film| into.merge(black_box(&film)),
            BatchSize::LargeInput,
        );
    });
    group.finish();
}

fn metrics(c: &mut Criterion<CpuTime>) {
    let image = |offset: f32| {
        let value = |x: u32, y: u32| [offset + (x as f32 * 0.1).sin(), y as f32 / 256.0, 0.5];
        RgbImage::from_fn(256, 256, value).expect("the size is sound")
    };
    let (image, reference) = (image(0.1), image(0.0));
    let mut group = c.benchmark_group("film");
    group.throughput(Throughput::Elements(256 * 256));
    group.bench_function(BenchmarkId::new("ssim", 256 * 256), |b| {
        b.iter(|| structural_similarity(black_box(&image), &reference))
    });
    group.bench_function(BenchmarkId::new("comparison", 256 * 256), |b| {
        b.iter(|| ImageComparison::new(black_box(&image), &reference))
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = film, metrics
}
criterion_main!(benches);
