//! What a choice costs: from a full bucket of 32 lights, beside 32 evaluations of their weights and
//! a light BVH; and a sample of a vMF mixture with its density.
//!
//! ```sh
//! cargo bench -p lightshed-guiding --bench selection
//! ```

use criterion::{Criterion, criterion_group, criterion_main};
use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{LightCache, LightCacheOptions, LightRecord, VmfLobe, VmfMixture};
use lightshed_lights::{Bounds, Light, LightBvh, LightSampler, OrientationCone, ShadingPoint};
use lightshed_sampling::{CounterRng, DirectionDistribution};
use std::hint::black_box;

const LIGHTS: usize = 32;

fn lamps() -> Vec<Light> {
    (0..LIGHTS as u32)
        .map(|i| {
            let mut rng = CounterRng::new(1, i, 0);
            let center = Vec3::new(rng.next_f32(), 1.0, rng.next_f32());
            Light {
                bounds: Bounds::new(center - 0.01, center + 0.01),
                intensity: 0.5 + rng.next_f32(),
                cone: Some(OrientationCone::diffuse(Vec3::NEG_Y)),
            }
        })
        .collect()
}

/// The weight of a light as a cache has it.
fn weight(light: &Light, at: &ShadingPoint) -> f32 {
    let (d, radius) = (light.bounds.center() - at.position, 0.018);
    let normal = light.cone.map_or(Vec3::ZERO, |cone| cone.axis);
    let clamped = d.length_squared().max(radius * radius);
    let emitted = (radius - normal.dot(d)).max(0.0) / clamped;
    light.intensity * emitted * (at.normal.dot(d) + radius).max(0.0) / clamped
}

fn selection(c: &mut Criterion) {
    let lights = lamps();
    let points: Vec<ShadingPoint> = (0..1024)
        .map(|i| {
            let mut rng = CounterRng::new(2, i, 0);
            ShadingPoint::new(Vec3::new(rng.next_f32(), 0.0, rng.next_f32()), Vec3::Y, 1.0)
        })
        .collect();
    let options = LightCacheOptions {
        unit_size: 0.0,
        learn_share: false,
        share: 0.02,
        split_above: 1 << 20,
        ..LightCacheOptions::default()
    };
    let mut cache =
        LightCache::new(Bounds::new(Vec3::ZERO, Vec3::ONE), &lights, options).expect("sound options");
    let all = points.iter().zip((0..LIGHTS as u32).cycle());
    let records: Vec<LightRecord> = all
        .map(|(&at, light)| LightRecord {
            at,
            light,
            pmf: 1.0 / LIGHTS as f32,
            contribution: 1.0,
            visible: true,
        })
        .collect();
    cache.update(&records);
    assert_eq!(
        (
            cache.lights_at(points[0].position).len(),
            cache.buckets_at(points[0].position)
        ),
        (LIGHTS, 1)
    );
    let bvh = LightBvh::new(&lights).expect("sound lights");
    let numbers: Vec<u64> = (0..1024).map(|i| CounterRng::new(3, i, 0).next_u64()).collect();
    let mut group = c.benchmark_group("1,024 choices among 32 lights");
    group.bench_function("32 weights each, one by one", |b| {
        b.iter(|| {
            points
                .iter()
                .map(|at| lights.iter().map(|light| weight(light, at)).sum::<f32>())
                .sum::<f32>()
        })
    });
    let mut choices = vec![None; 1024];
    group.bench_function("light cache", |b| {
        b.iter(|| cache.sample_each(black_box(&points), &numbers, &mut choices))
    });
    group.bench_function("light cache, the probability of a light", |b| {
        b.iter(|| {
            points
                .iter()
                .zip(&numbers)
                .map(|(at, &u)| cache.pmf(at, u as u32 % 32))
                .sum::<f32>()
        })
    });
    group.bench_function("light BVH", |b| {
        b.iter(|| bvh.sample_each(black_box(&points), &numbers, &mut choices))
    });
    group.finish();
}

fn mixtures(c: &mut Criterion) {
    let lobe = |i: u32| {
        let mut rng = CounterRng::new(4, i, 0);
        VmfLobe {
            weight: 0.1 + rng.next_f32(),
            mean: Vec3::from([0; 3].map(|_| rng.next_f32() - 0.5)),
            concentration: 2f32.powi(i as i32),
        }
    };
    let mixture = VmfMixture::new(&(0..8).map(lobe).collect::<Vec<_>>());
    let numbers: Vec<[f32; 2]> = (0..1024).map(|i| CounterRng::new(5, i, 0).next_2d()).collect();
    let mut group = c.benchmark_group("1,024 samples of 8 vMF lobes");
    group.bench_function("sample with density", |b| {
        b.iter(|| {
            numbers
                .iter()
                .filter_map(|&u| mixture.sample(black_box(u)))
                .map(|(_, p)| p.value())
                .sum::<f32>()
        })
    });
    group.finish();
}

criterion_group!(benches, selection, mixtures);
criterion_main!(benches);
