//! Building light structures and choosing from them, alternatives side by side.
//!
//! ```sh
//! cargo bench -p lightshed-lights --features parallel --bench lights
//! cargo bench -p lightshed-lights --features parallel --bench lights -- build
//! ```
//!
//! Times are the least of several turns, since what other processes take only adds; builds are on as many threads as there are
//! processors, choosing is on one.

use lightshed_lights::glam::Vec3;
use lightshed_lights::{
    Bounds, BvhBuild, Light, LightBvh, LightSampler, OrientationCone, PerfectTree, PerfectTreeOptions,
    PowerLights, ShadingPoint, Stride, UniformLights, Weighting,
};
use lightshed_sampling::{CounterRng, MortonGrid, UniformSphere};
use rdst::{RadixKey, RadixSort};
use std::hint::black_box;
use std::time::Instant;

fn main() {
    let wanted = |part: &str| {
        let mut given = std::env::args()
            .skip(1)
            .filter(|a| !a.starts_with('-'))
            .peekable();
        given.peek().is_none() || given.any(|g| g == part)
    };
    if wanted("build") {
        build();
    }
    if wanted("choose") {
        choose();
    }
}

/// Small patches strewn through a cube, in clusters of different sizes.
fn lights(count: usize) -> Vec<Light> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(7, i as u32, 0);
            let mut shared = CounterRng::new(7, rng.next_u32() % 64, 1);
            let place =
                |rng: &mut CounterRng| Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
            let size = 0.02 + 0.3 * shared.next_f32();
            let center = place(&mut shared) * 10.0 + place(&mut rng) * 10.0 * size;
            let normal = UniformSphere::sample(rng.next_2d());
            Light {
                bounds: Bounds::new(center - 0.01, center + 0.01),
                intensity: 0.1 + rng.next_f32(),
                cone: Some(OrientationCone::diffuse(normal)),
            }
        })
        .collect()
}

/// Least seconds of `turns`.
fn least(turns: u32, mut work: impl FnMut()) -> f64 {
    (0..turns)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

/// A code and the index of its light, as rdst sorts them.
#[derive(Clone, Copy)]
struct Keyed {
    code: u64,
    index: u32,
}

impl RadixKey for Keyed {
    const LEVELS: usize = 8;

    #[inline]
    fn get_level(&self, level: usize) -> u8 {
        (self.code >> (8 * level)) as u8
    }
}

/// Morton codes of the lights' centres.
fn keys(lights: &[Light]) -> Vec<Keyed> {
    let all = Bounds::of_points(lights.iter().map(|light| light.bounds.center()));
    let grid = MortonGrid::new(all.min, all.max).expect("the lights are finite");
    let key = |(index, light): (u32, &Light)| Keyed {
        code: grid.encode63(light.bounds.center()),
        index,
    };
    (0..).zip(lights).map(key).collect()
}

fn build() {
    println!("build, ms; the copy and the sort of codes, by rdst, are what any build must do");
    println!(
        "{:>9} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}",
        "lights", "copy", "sort", "perfect", "again", "curve", "again", "bvh"
    );
    for count in [1_000, 10_000, 100_000, 1_000_000, 4_000_000] {
        let lights = lights(count);
        let turns = if count > 200_000 { 5 } else { 12 };
        let copy = least(turns, || {
            black_box(lights.to_vec());
        });
        let keys = keys(&lights);
        let mut sorted = keys.clone();
        let sort = least(turns, || {
            sorted.copy_from_slice(&keys);
            sorted.radix_sort_unstable();
            black_box(sorted[0].index);
        });
        let perfect = least(turns, || {
            black_box(PerfectTree::new(&lights).expect("the lights are sound"));
        });
        let mut tree = PerfectTree::new(&lights).expect("the lights are sound");
        let again = least(turns, || tree.rebuild(&lights).expect("the lights are sound"));
        let bvh = least(turns.min(6), || {
            black_box(LightBvh::new(&lights).expect("the lights are sound"));
        });
        let along_curve =
            || LightBvh::with_build(&lights, BvhBuild::AlongCurve).expect("the lights are sound");
        let curve = least(turns, || {
            black_box(along_curve());
        });
        let mut tree = along_curve();
        let curve_again = least(turns, || tree.rebuild(&lights).expect("the lights are sound"));
        let row = [copy, sort, perfect, again, curve, curve_again, bvh]
            .map(|seconds| format!("{:>10.3}", seconds * 1e3));
        println!("{count:>9} {}", row.join(" "));
    }
}

fn choose() {
    println!("choosing a light, ns: one alone, one for each of many points, and 4, 16 and 64 for one point");
    println!(
        "{:>9} {:<24} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "lights", "sampler", "alone", "each", "4", "16", "64", "pmf"
    );
    for count in [1_000, 10_000, 100_000, 1_000_000] {
        let lights = lights(count);
        let plain = PerfectTreeOptions::default();
        let perfect = |options| PerfectTree::with_options(&lights, options).expect("the lights are sound");
        time(
            "uniform",
            count,
            &UniformLights::new(count).expect("there are some"),
        );
        time(
            "power",
            count,
            &PowerLights::new(&lights).expect("the lights are sound"),
        );
        time("perfect tree", count, &perfect(plain));
        time(
            "  by binary steps",
            count,
            &perfect(plain.with_stride(Stride::One)),
        );
        time(
            "  eqs. 4.1, 4.2",
            count,
            &perfect(plain.with_weighting(Weighting::MinMax)),
        );
        time(
            "BVH along a curve",
            count,
            &LightBvh::with_build(&lights, BvhBuild::AlongCurve).expect("the lights are sound"),
        );
        time(
            "light BVH",
            count,
            &LightBvh::new(&lights).expect("the lights are sound"),
        );
    }
}

fn time<S: LightSampler>(name: &str, count: usize, sampler: &S) {
    const POINTS: usize = 1024;
    let points: Vec<ShadingPoint> = (0..POINTS as u32)
        .map(|i| {
            let mut rng = CounterRng::new(3, i, 9);
            let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 20.0 - 10.0;
            ShadingPoint::new(place, UniformSphere::sample(rng.next_2d()), 1.0)
        })
        .collect();
    let per_choice = |seconds: f64, each: usize| seconds * 1e9 / (POINTS * each) as f64;
    let numbers: Vec<u64> = (0..POINTS as u32)
        .map(|i| CounterRng::new(1, i, 0).next_u64())
        .collect();
    let alone = least(25, || {
        for (at, &u) in points.iter().zip(&numbers) {
            black_box(sampler.sample(at, u));
        }
    });
    let mut choices = vec![None; POINTS];
    let each_point = least(25, || {
        sampler.sample_each(&points, &numbers, &mut choices);
        black_box(&choices);
    });
    let mut row = vec![per_choice(alone, 1), per_choice(each_point, 1)];
    for each in [4usize, 16, 64] {
        let u: Vec<u64> = numbers
            .iter()
            .flat_map(|number| {
                let stratum = u64::MAX / each as u64;
                let within = move |k: u64| number.rotate_left(17 * k as u32) % stratum;
                (0..each as u64).map(move |k| stratum * k + within(k))
            })
            .collect();
        let mut choices = vec![None; each];
        let seconds = least(10, || {
            for (at, u) in points.iter().zip(u.chunks(each)) {
                sampler.sample_many(at, u, &mut choices);
                black_box(&choices);
            }
        });
        row.push(per_choice(seconds, each));
    }
    let chosen: Vec<u32> = points
        .iter()
        .zip(&numbers)
        .map(|(at, &u)| sampler.sample(at, u).map_or(0, |choice| choice.light))
        .collect();
    let pmf = least(25, || {
        for (at, &light) in points.iter().zip(&chosen) {
            black_box(sampler.pmf(at, light));
        }
    });
    print!("{count:>9} {name:<24}");
    for ns in row.iter().chain([&per_choice(pmf, 1)]) {
        print!(" {ns:>8.0}");
    }
    println!();
}
