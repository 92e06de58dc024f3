//! Cost of a streamed candidate, beside what it cannot do without, and of merges by family.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_resampling::{
    Counting, Domain, DomainReservoir, IdentityShift, Input, JumpSelection, Mis, Reservoir, Ris, Selection,
    SelectionRecord, Tractable, WithoutReplacement, merge,
};
use lightshed_sampling::{CounterRng, f64_from_u64};
use std::hint::black_box;

const CANDIDATES: u64 = 4096;

fn weights() -> Vec<f64> {
    let mut rng = CounterRng::new(1, 0, 0);
    (0..CANDIDATES)
        .map(|_| f64_from_u64(rng.next_u64()) + 0.01)
        .collect()
}

fn streaming(criterion: &mut Criterion<CpuTime>) {
    let weights = weights();
    let mut group = criterion.benchmark_group("resampling");
    group.throughput(Throughput::Elements(CANDIDATES));
    // What any streaming selection has to do: one uniform, one addition, one comparison.
    group.bench_function(BenchmarkId::new("candidate_baseline", CANDIDATES), |bencher| {
        let mut rng = CounterRng::new(2, 0, 0);
        bencher.iter(|| {
            let (mut sum, mut taken) = (0.0, 0u32);
            for &w in black_box(&weights) {
                sum += w;
                taken += u32::from(f64_from_u64(rng.next_u64()) * sum < w);
            }
            (sum, taken)
        });
    });
    group.bench_function(BenchmarkId::new("candidate_selection", CANDIDATES), |bencher| {
        let mut rng = CounterRng::new(2, 0, 0);
        bencher.iter(|| {
            let mut selection = Selection::new();
            for (i, &w) in black_box(&weights).iter().enumerate() {
                selection.offer(i as u32, w, &mut rng);
            }
            selection
        });
    });
    group.bench_function(
        BenchmarkId::new("candidate_jump_selection", CANDIDATES),
        |bencher| {
            let mut rng = CounterRng::new(2, 0, 0);
            bencher.iter(|| {
                let mut selection = JumpSelection::new();
                for (i, &w) in black_box(&weights).iter().enumerate() {
                    selection.offer(i as u32, w, &mut rng);
                }
                selection
            });
        },
    );
    group.bench_function(BenchmarkId::new("candidate_ris", CANDIDATES), |bencher| {
        let mut rng = CounterRng::new(2, 0, 0);
        let weight = Tractable::<Counting>::from_density(0.5).unwrap().weight();
        bencher.iter(|| {
            let mut ris = Ris::<u32, Counting>::new();
            for (i, &target) in black_box(&weights).iter().enumerate() {
                ris.candidate(i as u32, target, weight, &mut rng);
            }
            ris.finish::<f32>(1.0)
        });
    });
    group.bench_function(
        BenchmarkId::new("candidate_selection_record", CANDIDATES),
        |bencher| {
            let mut rng = CounterRng::new(2, 0, 0);
            bencher.iter(|| {
                let mut record = SelectionRecord::default();
                for (i, &w) in black_box(&weights).iter().enumerate() {
                    record.offer(i as u32, w as f32, rng.next_f32());
                }
                record
            });
        },
    );
    group.bench_function(
        BenchmarkId::new("candidate_without_replacement", CANDIDATES),
        |bencher| {
            let mut rng = CounterRng::new(2, 0, 0);
            bencher.iter_batched_ref(
                || WithoutReplacement::new(8),
                |sample| {
                    for (i, &w) in black_box(&weights).iter().enumerate() {
                        sample.offer(i as u32, w, &mut rng);
                    }
                },
                BatchSize::SmallInput,
            );
        },
    );
    group.finish();
}

/// The cheapest domain there is: what remains is the merge itself.
struct Cheap(f64);

impl Domain for Cheap {
    type Sample = u32;
    type Space = Counting;
    #[inline]
    fn target(&self, &x: &u32) -> f64 {
        self.0 + f64::from(x & 15)
    }
}

fn merging(criterion: &mut Criterion<CpuTime>) {
    let mut group = criterion.benchmark_group("resampling");
    let families = [
        ("merge_constant_biased", Mis::ConstantBiased),
        ("merge_constant_debiased", Mis::ConstantDebiased),
        ("merge_balance", Mis::Balance),
        ("merge_pairwise_uniform", Mis::PAIRWISE_UNIFORM),
        ("merge_pairwise_defensive", Mis::PAIRWISE_DEFENSIVE),
    ];
    for count in [2usize, 4, 9, 25, 49] {
        let domains: Vec<Cheap> = (0..count).map(|i| Cheap(1.0 + i as f64)).collect();
        let reservoirs: Vec<DomainReservoir<Cheap>> = (0..count)
            .map(|i| Reservoir::from_density(i as u32, 0.25, 4.0).unwrap())
            .collect();
        let mut inputs = vec![Input::canonical(&domains[0], &reservoirs[0])];
        inputs.extend(
            domains
                .iter()
                .zip(&reservoirs)
                .skip(1)
                .map(|(d, r)| Input::neighbour(d, r)),
        );
        for (name, mis) in families {
            group.bench_function(BenchmarkId::new(name, count), |bencher| {
                let mut rng = CounterRng::new(3, 0, 0);
                bencher.iter(|| merge(&domains[0], &IdentityShift, black_box(&inputs), mis, &mut rng));
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = streaming, merging
}
criterion_main!(benches);
