//! Trackers on a grid of 256³: nanoseconds a lookup, lookups a second of one thread.
//!
//! ```sh
//! cargo bench -p lightshed-volume --bench trackers
//! ```
//!
//! `volume/<what>_<filter>_<rays>/256`: rays of a camera in front of the grid, neighbours one after
//! the other, and random chords of its box. How many lookups a ray takes is printed before.

#[path = "../../../benches/measure/cpu_time.rs"]
mod cpu_time;
#[path = "volume/fields.rs"]
mod fields;

use cpu_time::{CpuTime, by_cpu_time};
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fields::{Medium, camera, chords, cloud};
use lightshed_sampling::{CounterRng, f64_from_u64};
use lightshed_volume::*;
use std::hint::black_box;
use std::time::Duration;

/// Voxels along an edge.
const SIDE: u32 = 256;

/// One benchmark: `work` on every ray, which says how many lookups it took.
fn time(
    group: &mut BenchmarkGroup<'_, CpuTime>,
    name: &str,
    rays: &[(FieldRay, Interval)],
    work: impl Fn(&FieldRay, Interval, &mut CounterRng) -> u32,
) {
    let pass = || {
        let mut lookups = 0;
        for (i, (ray, interval)) in (0..).zip(rays) {
            let mut rng = CounterRng::new(9, i, 0);
            lookups += u64::from(black_box(work(ray, *interval, &mut rng)));
        }
        lookups
    };
    let lookups = pass();
    println!("{name}: {:.1} lookups a ray", lookups as f64 / rays.len() as f64);
    group.throughput(Throughput::Elements(lookups));
    group.bench_function(BenchmarkId::new(name, SIDE), |b| b.iter(pass));
}

fn trackers(criterion: &mut Criterion<CpuTime>) {
    let mut group = criterion.benchmark_group("volume");
    group.sample_size(10);
    group.warm_up_time(Duration::from_millis(200));
    group.measurement_time(Duration::from_millis(1000));
    let medium = Medium::new(cloud(SIDE, 0.7), 1.0);
    let nearest = medium.grid.clone().with_filter(Filter::Nearest);
    let (k, majorants) = (medium.extinction, &medium.majorants);
    let rays = [
        ("camera", camera(&medium.grid, 64)),
        ("chords", chords(&medium.grid, 4096)),
    ];
    for (kind, rays) in &rays {
        let group = &mut group;
        time(group, &format!("segments_{kind}"), rays, |ray, interval, _| {
            let (mut count, mut sum) = (0, 0.0);
            for segment in majorants.segments(ray, interval) {
                count += 1;
                sum += segment.majorant * (segment.t1 - segment.t0);
            }
            black_box(sum);
            count
        });
        time(
            group,
            &format!("tentative_collisions_{kind}"),
            rays,
            |ray, interval, rng| {
                let mut count = 0;
                let mut collisions = TentativeCollisions::new(majorants.segments(ray, interval), k);
                while let Some(collision) = collisions.next(rng) {
                    black_box(collision.t);
                    count += 1;
                }
                count
            },
        );
        for (filter, grid) in [("trilinear", &medium.grid), ("nearest", &nearest)] {
            let name = |what: &str| format!("{what}_{filter}_{kind}");
            time(group, &name("lookups"), rays, |ray, interval, _| {
                let mut density = grid.accessor();
                let (step, mut sum) = (0.37, 0.0);
                let steps = (interval.t1 / step) as u32;
                for i in 0..steps {
                    sum += density.density(ray.at(i as f32 * step));
                }
                black_box(sum);
                steps
            });
            time(group, &name("ratio"), rays, |ray, interval, rng| {
                let segments = majorants.segments(ray, interval);
                let estimate = ratio_tracking(&mut grid.accessor(), ray, segments, k, rng);
                black_box(estimate.value);
                estimate.lookups
            });
            time(group, &name("ratio_one_majorant"), rays, |ray, interval, rng| {
                let whole = majorants.whole_segment(ray, interval).into_iter();
                let estimate = ratio_tracking(&mut grid.accessor(), ray, whole, k, rng);
                black_box(estimate.value);
                estimate.lookups
            });
            time(group, &name("residual_ratio"), rays, |ray, interval, rng| {
                let (segments, density) = (majorants.segments(ray, interval), &mut grid.accessor());
                let estimate = residual_ratio_tracking(density, ray, segments, k, Control::Minorant, rng);
                black_box(estimate.value);
                estimate.lookups
            });
            time(group, &name("delta"), rays, |ray, interval, rng| {
                let segments = majorants.segments(ray, interval);
                let flight = delta_tracking(&mut grid.accessor(), ray, segments, k, rng);
                black_box(flight.distance);
                flight.lookups
            });
            time(group, &name("regular_depth"), rays, |ray, interval, _| {
                let depth = regular_depth(grid, ray, interval);
                black_box(depth.depth);
                depth.lookups
            });
            time(group, &name("regular_flight"), rays, |ray, interval, rng| {
                let flight = regular_flight(grid, ray, interval, k, f64_from_u64(rng.next_u64()));
                black_box(flight.depth);
                flight.lookups
            });
        }
    }
}

criterion_group! {
    name = benches;
    config = by_cpu_time();
    targets = trackers
}
criterion_main!(benches);
