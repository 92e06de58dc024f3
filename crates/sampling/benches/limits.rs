//! What the machine itself costs: the limits that hot functions are held against in
//! `docs/performance-rays.md`.
//!
//! ```sh
//! cargo bench -p lightshed-sampling --bench limits
//! ```
//!
//! `random_word`: a word of a counter-based generator, in order. `read_dependent`: a read whose
//! address is what the read before gave, all over so much memory. `read_independent`: reads all
//! over it whose addresses are known beforehand. `copy`: memory copied, bytes a second.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_sampling::CounterRng;
use std::hint::black_box;

/// Kilobytes: of the first cache, the second, the third, and of none.
const SIZES: [usize; 4] = [16, 512, 8 << 10, 256 << 10];
/// Reads in a turn.
const READS: u64 = 4096;

/// One cycle through all cache lines in random order: line `i` says which comes after it (Sattolo's
/// shuffle).
fn cycle(lines: usize) -> Vec<[u64; 8]> {
    let mut rng = CounterRng::new(1, 0, 0);
    let mut next: Vec<u64> = (0..lines as u64).collect();
    for i in (1..lines).rev() {
        next.swap(i, ((u64::from(rng.next_u32()) * i as u64) >> 32) as usize);
    }
    next.into_iter().map(|next| [next, 0, 0, 0, 0, 0, 0, 0]).collect()
}

fn limits(c: &mut Criterion<CpuTime>) {
    let mut group = c.benchmark_group("limits");
    group.throughput(Throughput::Elements(READS));
    group.bench_function(BenchmarkId::new("random_word", READS), |b| {
        let mut rng = CounterRng::new(1, 2, 3);
        b.iter(|| (0..READS).fold(0, |sum, _| sum ^ rng.next_u32()));
    });
    for size in SIZES {
        let lines = size * 1024 / 64;
        let memory = cycle(lines);
        group.throughput(Throughput::Elements(READS));
        let mut place = 0;
        group.bench_function(BenchmarkId::new("read_dependent", size * 1024), |b| {
            b.iter(|| {
                for _ in 0..READS {
                    place = memory[place as usize % lines][0];
                }
                black_box(place)
            });
        });
        let mut rng = CounterRng::new(1, 0, 1);
        let places: Vec<usize> = (0..READS).map(|_| rng.next_u32() as usize % lines).collect();
        let mut turn = 0;
        group.bench_function(BenchmarkId::new("read_independent", size * 1024), |b| {
            b.iter(|| {
                // Other lines each time, where there are others.
                turn = (turn + 4097) % lines;
                places
                    .iter()
                    .fold(0, |sum, place| sum ^ memory[(place + turn) % lines][0])
            });
        });
        let mut target = vec![[0u64; 8]; lines];
        group.throughput(Throughput::Bytes(size as u64 * 1024));
        group.bench_function(BenchmarkId::new("copy", size * 1024), |b| {
            b.iter(|| {
                target.copy_from_slice(&memory);
                black_box(&target);
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = by_cpu_time().sample_size(20);
    targets = limits
}
criterion_main!(benches);
