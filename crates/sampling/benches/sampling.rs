//! Costs of the crate's hot functions, each beside the alternatives it was chosen over.
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use lightshed_sampling::CounterRng;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;

fn rng(c: &mut Criterion) {
    let mut group = c.benchmark_group("sampling/rng");
    for draws in [1u32, 8, 64, 1024] {
        group.bench_function(format!("counter_rng/{draws}"), |b| {
            let mut pixel = 0;
            b.iter(|| {
                pixel += 1;
                let mut rng = CounterRng::new(1, pixel, 2);
                (0..draws).fold(0, |sum, _| rng.next_u32() ^ sum)
            });
        });
        group.bench_function(format!("at/{draws}"), |b| {
            let mut pixel = 0;
            b.iter(|| {
                pixel += 1;
                (0..draws).fold(0, |sum, d| CounterRng::at(1, pixel, 2, d) ^ sum)
            });
        });
        group.bench_function(format!("rand_pcg/{draws}"), |b| {
            let mut pixel = 0;
            b.iter(|| {
                pixel += 1;
                let mut rng = Pcg32::seed_from_u64(black_box(pixel));
                (0..draws).fold(0, |sum, _| rng.next_u32() ^ sum)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, rng);
criterion_main!(benches);
