//! Look-ups and claims in a hash table of cells, against one dependent read of the same working
//! set.
//!
//! `cargo bench -p lightshed-spatial --bench hash_grid`

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lightshed_sampling::CounterRng;
use lightshed_spatial::glam::Vec3;
use lightshed_spatial::{CellKey, CellTable, LevelGrid, LevelGridOptions, SpatialIndex, SurfaceSite};
use std::hint::black_box;

fn keys(count: u32) -> Vec<CellKey> {
    let options = LevelGridOptions {
        cell: 1.0,
        growth: 0.0,
        faces: true,
        facets: false,
    };
    let grid = LevelGrid::new(options).unwrap();
    let place = |i: u32| Vec3::new((i % 256) as f32, (i / 256 % 256) as f32, (i / 65_536) as f32);
    (0..count)
        .map(|i| grid.locate(&SurfaceSite::new(place(i), Vec3::Y)).unwrap())
        .collect()
}

/// One cycle through all of `0..count` (Sattolo 1986).
fn cycle(count: usize) -> Vec<u32> {
    let mut next: Vec<u32> = (0..count as u32).collect();
    for i in (1..count).rev() {
        let j = CounterRng::new(1, i as u32, 0).next_u64() % i as u64;
        next.swap(i, j as usize);
    }
    next
}

fn hash_grid(c: &mut Criterion) {
    for (bits, load) in [(16, 50), (22, 50), (22, 90)] {
        let slots = 1usize << bits;
        let keys = keys((slots / 100 * load) as u32);
        let mut table = CellTable::new(slots).unwrap();
        keys.iter().for_each(|&key| table.claim(key));
        table.settle(|_| ());
        println!("{:?}", table.occupancy());
        let found = keys.iter().filter(|&&key| table.find(key).is_some()).count();
        println!("{found} of {} keys, each with a slot of its own", keys.len());
        let mut group = c.benchmark_group(format!("hash_grid/2^{bits} slots at {load} %"));
        const STEPS: u64 = 100_000;
        group.throughput(Throughput::Elements(STEPS));
        let next: Vec<u64> = cycle(slots).into_iter().map(u64::from).collect();
        group.bench_function("dependent read", |b| {
            let mut at = 0;
            b.iter(|| {
                for _ in 0..STEPS {
                    at = next[at as usize];
                }
                black_box(at)
            });
        });
        // All keys in turn, in one random cycle. The next one is not known before the slot is: the
        // slot's highest bit, which is 0, is added. "keys alone" is what the cycle's and the keys'
        // own memory cost.
        let next_key = cycle(keys.len());
        let walk = |mut at: usize, mut op: Box<dyn FnMut(CellKey) -> u32 + '_>| {
            for _ in 0..STEPS {
                let slot = op(keys[at]);
                at = (next_key[at] + (slot >> 31)) as usize;
            }
            at
        };
        group.bench_function("keys alone", |b| {
            let mut at = 0;
            b.iter(|| {
                at = walk(at, Box::new(|key| key.bits() as u32 & 1));
                at
            });
        });
        group.bench_function("find", |b| {
            let mut at = 0;
            b.iter(|| {
                at = walk(at, Box::new(|key| table.find(key).unwrap_or(0)));
                at
            });
        });
        group.bench_function("claim", |b| {
            let mut at = 0;
            b.iter(|| {
                at = walk(
                    at,
                    Box::new(|key| {
                        table.claim(key);
                        0
                    }),
                );
                at
            });
        });
        group.finish();
    }
}

criterion_group!(benches, hash_grid);
criterion_main!(benches);
