//! What guiding costs: recording and learning, lookups, samples with their densities.
//!
//! `cargo bench -p lightshed-guiding --features parallel --bench guiding`

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{
    BinaryTree, DirectionalModel, FieldOptions, GuidingField, GuidingSample, Partition, QuadtreeModel,
    QuadtreeOptions, VmfFitOptions, VmfLobe, VmfMixture, VmfModel, WeightedTreeModel, WeightedTreeOptions,
};
use lightshed_sampling::{CounterRng, DirectionDistribution, UniformSphere, VonMisesFisher};
use lightshed_spatial::{AdaptiveOctree, Bounds};
use rayon::prelude::*;
use std::hint::black_box;

const SAMPLES: u32 = 1 << 20;
const BOUNDS: Bounds = Bounds {
    min: Vec3::ZERO,
    max: Vec3::ONE,
};

/// Samples on the faces of a box, lit by a lobe that depends on the place.
fn samples() -> Vec<GuidingSample> {
    (0..SAMPLES)
        .map(|i| {
            let mut rng = CounterRng::new(1, i, 0);
            let mut position = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            position[i as usize % 3] = (i / 3 % 2) as f32;
            let towards = (Vec3::new(0.5, 0.5, 0.9) - position).normalize();
            let direction = UniformSphere::sample(rng.next_2d());
            GuidingSample {
                position,
                direction,
                distance: 1.0,
                weight: 0.01 + VonMisesFisher::new(towards, 30.0).density(direction).value(),
                pdf: UniformSphere::density(),
                scattering_pdf: UniformSphere::density(),
            }
        })
        .collect()
}

fn quadtrees(bits: u32) -> QuadtreeModel {
    QuadtreeModel::new(QuadtreeOptions {
        bits,
        ..QuadtreeOptions::default()
    })
    .unwrap()
}

fn lobes() -> VmfModel {
    VmfModel::new(VmfFitOptions::default()).unwrap()
}

/// Eight lobes of widths from a hemisphere to a degree.
fn eight_lobes(c: &mut Criterion) {
    let lobe = |i: u32| {
        let mut rng = CounterRng::new(4, i, 0);
        VmfLobe {
            weight: 0.1 + rng.next_f32(),
            mean: Vec3::from([0; 3].map(|_| rng.next_f32() - 0.5)),
            concentration: 4f32.powi(i as i32),
        }
    };
    let mixture = VmfMixture::new(&(0..8).map(lobe).collect::<Vec<_>>());
    let numbers: Vec<[f32; 2]> = (0..4096).map(|i| CounterRng::new(5, i, 0).next_2d()).collect();
    let mut group = c.benchmark_group("one_thread");
    group.throughput(Throughput::Elements(4096));
    group.bench_function(BenchmarkId::new("sample_with_density", "eight lobes"), |b| {
        b.iter(|| {
            for u in &numbers {
                black_box(mixture.sample(*u));
            }
        });
    });
    group.finish();
}

fn weighted() -> WeightedTreeModel {
    WeightedTreeModel::new(WeightedTreeOptions::default()).unwrap()
}

/// A field that has settled.
fn trained<M: DirectionalModel, P: Partition>(model: M, samples: &[GuidingSample]) -> GuidingField<M, P> {
    let mut field = GuidingField::new(BOUNDS, model, FieldOptions::default()).unwrap();
    for _ in 0..3 {
        field.record(samples);
        field.update().unwrap();
    }
    field
}

fn learning<M: DirectionalModel + Clone, P: Partition>(c: &mut Criterion, name: &str, model: M) {
    let samples = samples();
    let mut group = c.benchmark_group("record_and_update");
    group
        .throughput(Throughput::Elements(SAMPLES.into()))
        .sample_size(10);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut field = pool.install(|| trained::<M, P>(model.clone(), &samples));
        let mut learn = || {
            // Paths of four vertices.
            let paths = samples.par_chunks(4).with_min_len(1024);
            paths.for_each(|path| field.record(path));
            field.update().unwrap()
        };
        group.bench_function(BenchmarkId::new(name, format!("{threads} threads")), |b| {
            b.iter(|| pool.install(&mut learn));
        });
    }
    group.finish();
}

fn sampling<M: DirectionalModel, P: Partition>(c: &mut Criterion, name: &str, model: M) {
    let samples = samples();
    let field = trained::<M, P>(model, &samples);
    let mut group = c.benchmark_group("one_thread");
    group.throughput(Throughput::Elements(4096));
    let places = || samples.iter().cycle().take(4096).zip(0u32..);
    group.bench_function(BenchmarkId::new("lookup", name), |b| {
        b.iter(|| {
            places()
                .filter(|(sample, _)| field.at(sample.position).is_some())
                .count()
        });
    });
    let known: Vec<_> = places()
        .filter_map(|(sample, _)| field.at(sample.position))
        .collect();
    let numbers: Vec<[f32; 2]> = (0..4096).map(|i| CounterRng::new(3, i, 0).next_2d()).collect();
    group.bench_function(BenchmarkId::new("sample_with_density", name), |b| {
        b.iter(|| {
            for (known, u) in known.iter().zip(&numbers) {
                black_box(known.sample(*u));
            }
        });
    });
    group.bench_function(BenchmarkId::new("density", name), |b| {
        b.iter(|| {
            for (known, sample) in known.iter().zip(&samples) {
                black_box(known.pdf(sample.direction));
            }
        });
    });
    group.finish();
}

fn bench(c: &mut Criterion) {
    for bits in [32, 64, 128, 1024] {
        sampling::<_, AdaptiveOctree>(c, &format!("quadtree of {bits} bits"), quadtrees(bits));
    }
    let still = QuadtreeModel::new(QuadtreeOptions {
        parallax: false,
        ..QuadtreeOptions::default()
    });
    sampling::<_, AdaptiveOctree>(c, "quadtree of 64 bits without parallax", still.unwrap());
    sampling::<_, AdaptiveOctree>(c, "vMF", lobes());
    eight_lobes(c);
    sampling::<_, BinaryTree>(c, "SD-tree", weighted());
    learning::<_, AdaptiveOctree>(c, "quadtree of 64 bits", quadtrees(64));
    learning::<_, AdaptiveOctree>(c, "vMF", lobes());
    learning::<_, BinaryTree>(c, "SD-tree", weighted());
}

criterion_group!(benches, bench);
criterion_main!(benches);
