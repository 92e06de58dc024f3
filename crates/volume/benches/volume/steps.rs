//! Nanoseconds per lookup.

use crate::support::{Medium, camera, chords, cloud, least};
use lightshed_sampling::{CounterRng, f64_from_u64};
use lightshed_volume::*;
use std::hint::black_box;

const TURNS: u32 = 5;

/// Runs `work` on every chord, on one thread and on two at a time, and prints what a lookup takes.
fn row(
    name: &str,
    rays: &[(FieldRay, Interval)],
    work: impl Fn(&FieldRay, Interval, &mut CounterRng) -> u32 + Sync,
) {
    let pass = |rays: &[(FieldRay, Interval)]| {
        let mut lookups = 0u64;
        for (i, (ray, interval)) in rays.iter().enumerate() {
            let mut rng = CounterRng::new(9, i as u32, 0);
            lookups += u64::from(black_box(work(ray, *interval, &mut rng)));
        }
        lookups
    };
    let lookups = pass(rays);
    let alone = least(TURNS, || {
        black_box(pass(rays));
    });
    // Two threads, each with all rays; CPU time of the slower.
    let both = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2)
            .map(|_| {
                scope.spawn(|| {
                    least(TURNS, || {
                        black_box(pass(rays));
                    })
                })
            })
            .collect();
        threads
            .into_iter()
            .map(|t| t.join().expect("no panics"))
            .fold(0.0, f64::max)
    });
    println!(
        "{name:<34} {:>8.1} {:>10.1} {:>10.1}",
        lookups as f64 / rays.len() as f64,
        1e9 * alone / lookups as f64,
        2e-6 * lookups as f64 / both
    );
}

pub fn run() {
    let medium = Medium::new("cloud", cloud(256, 0.7), 1.0);
    let chords = chords(&medium.grid, 4096);
    let camera = camera(&medium.grid, 64);
    let nearest = medium.grid.clone().with_filter(Filter::Nearest);
    let k = medium.extinction;
    let majorants = &medium.majorants;
    println!("steps on 256³: lookups a ray, ns a lookup, million lookups per second on two cores");
    for (name, rays) in [("camera rays", &camera), ("random chords", &chords)] {
        println!("{name}");

        row("random words", rays, |_, _, rng| {
            let mut sum = 0u32;
            for _ in 0..320 {
                sum ^= rng.next_u32();
            }
            black_box(sum);
            320
        });
        row("dependent additions", rays, |_, _, _| {
            let mut x = black_box(1.0f32);
            for _ in 0..320 {
                x += 1e-3;
            }
            black_box(x);
            320
        });
        row("majorant segments", rays, |ray, interval, _| {
            let mut count = 0;
            let mut sum = 0.0;
            for s in majorants.segments(ray, interval) {
                count += 1;
                sum += s.majorant * (s.t1 - s.t0);
            }
            black_box(sum);
            count
        });
        row("tentative collisions, no lookup", rays, |ray, interval, rng| {
            let mut count = 0;
            let mut collisions = TentativeCollisions::new(majorants.segments(ray, interval), k);
            while let Some(c) = collisions.next(rng) {
                black_box(c.t);
                count += 1;
            }
            count
        });
        for (name, grid) in [("trilinear", &medium.grid), ("nearest", &nearest)] {
            let label = |tracker: &str| format!("{tracker}, {name}");
            row(&label("lookups alone"), rays, |ray, interval, _| {
                let mut density = grid.accessor();
                let step = 0.37;
                let steps = (interval.t1 / step) as u32;
                let mut sum = 0.0;
                for i in 0..steps {
                    sum += density.density(ray.at(i as f32 * step));
                }
                black_box(sum);
                steps
            });
            row(&label("ratio"), rays, |ray, interval, rng| {
                let estimate = ratio_tracking(
                    &mut grid.accessor(),
                    ray,
                    majorants.segments(ray, interval),
                    k,
                    rng,
                );
                black_box(estimate.value);
                estimate.lookups
            });
            row(&label("ratio, one majorant"), rays, |ray, interval, rng| {
                let whole = majorants.whole_segment(ray, interval).into_iter();
                let estimate = ratio_tracking(&mut grid.accessor(), ray, whole, k, rng);
                black_box(estimate.value);
                estimate.lookups
            });
            row(&label("residual ratio"), rays, |ray, interval, rng| {
                let segments = majorants.segments(ray, interval);
                let density = &mut grid.accessor();
                let estimate = residual_ratio_tracking(density, ray, segments, k, Control::Minorant, rng);
                black_box(estimate.value);
                estimate.lookups
            });
            row(&label("delta"), rays, |ray, interval, rng| {
                let flight = delta_tracking(
                    &mut grid.accessor(),
                    ray,
                    majorants.segments(ray, interval),
                    k,
                    rng,
                );
                black_box(flight.distance);
                flight.lookups
            });
            row(&label("regular depth"), rays, |ray, interval, _| {
                let depth = regular_depth(grid, ray, interval);
                black_box(depth.depth);
                depth.lookups
            });
            row(&label("regular flight"), rays, |ray, interval, rng| {
                let flight = regular_flight(grid, ray, interval, k, f64_from_u64(rng.next_u64()));
                black_box(flight.depth);
                flight.lookups
            });
        }
    }
}
