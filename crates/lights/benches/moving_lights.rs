//! Lights that move every frame: time of whole frames against error, for each structure and number
//! of lights.
//!
//! ```sh
//! cargo bench -p lightshed-lights --bench moving_lights
//! cargo bench -p lightshed-lights --bench moving_lights -- 1000 100000
//! ```
//!
//! A frame builds the structure and then estimates the irradiance of 480 × 270 points by so many
//! samples each, without shadows; a sample costs another 400 ns for its shadow ray and shading.
//! Errors are those of blocks of 8 × 8 neighbouring points strewn over the floor and the walls of
//! a room, against sums over all lights: `Σ (E − Ê)² / Σ E²`. Printed is their product with
//! the frame's time, as a multiple of that of the light BVH: below one is better than it. Processor
//! time of one thread, the least of several turns.

#[path = "../../bvh/benches/cpu/mod.rs"]
mod cpu;

use cpu::cpu_seconds;
use lightshed_lights::glam::Vec3;
use lightshed_lights::{
    Bounds, BvhBuild, Light, LightBvh, LightChoice, LightSampler, LightSubtrees, Lightcut, OrientationCone,
    PerfectTree, PowerLights, ShadingPoint,
};
use lightshed_sampling::{CounterRng, UniformSphere};
use std::hint::black_box;

/// Shading points of a frame.
const FRAME: f64 = 480.0 * 270.0;
/// What a sample costs beyond its choice, seconds.
const SHADING: f64 = 400e-9;
/// Points that share a cut.
const BLOCK: usize = 64;
const BLOCKS: usize = 12;
const TURNS: u64 = 12;
const SAMPLES: [usize; 4] = [1, 4, 8, 16];

fn main() {
    let wanted: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let counts = [1_000, 10_000, 100_000, 1_000_000];
    println!(
        "{:>9} {:<26} {:>9} {:>9}   product of error and time, in that of the light BVH",
        "lights", "structure", "build ms", "choice ns"
    );
    println!(
        "{:>46} {:>9} {:>9} {:>9} {:>9}   error with 8",
        "", "1 sample", "4", "8", "16"
    );
    for count in counts
        .into_iter()
        .filter(|c| wanted.is_empty() || wanted.contains(c))
    {
        frames(count);
    }
}

/// Groups of lamps of very different brightness, each of them a patch.
fn lights(count: usize, frame: u64) -> Vec<Light> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(7, i as u32, 0);
            let mut shared = CounterRng::new(7, rng.next_u32() % 64, 1);
            let place =
                |rng: &mut CounterRng| Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
            let size = 0.02 + 0.3 * shared.next_f32();
            let drift = 0.02 * frame as f32 * place(&mut shared);
            let center = place(&mut shared) * 9.0 + place(&mut rng) * 9.0 * size + drift;
            let center = center.clamp(Vec3::splat(-9.9), Vec3::splat(9.9));
            let normal = UniformSphere::sample(rng.next_2d());
            Light {
                bounds: Bounds::new(center - 0.01, center + 0.01),
                // From a tenth to ten, most of them dim.
                intensity: 10.0_f32.powf(2.0 * rng.next_f32().powi(3) - 1.0),
                cone: Some(OrientationCone::diffuse(normal)),
            }
        })
        .collect()
}

/// Blocks of neighbouring points on the faces of a cube around the lights.
fn points() -> Vec<ShadingPoint> {
    (0..BLOCK * BLOCKS)
        .map(|i| {
            let (block, within) = (i / BLOCK, i % BLOCK);
            let mut rng = CounterRng::new(3, block as u32, 9);
            let axis = block % 3;
            let mut place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 18.0 - 9.0;
            place[(axis + 1) % 3] += 0.05 * (within % 8) as f32;
            place[(axis + 2) % 3] += 0.05 * (within / 8) as f32;
            let side = if block % 2 == 0 { 1.0 } else { -1.0 };
            place[axis] = -10.0 * side;
            let mut normal = Vec3::ZERO;
            normal[axis] = side;
            ShadingPoint::new(place, normal, 1.0)
        })
        .collect()
}

/// What a light sends to a point, by its middle.
fn irradiance(light: &Light, at: &ShadingPoint) -> f64 {
    let to = light.bounds.center() - at.position;
    let squared = to.length_squared();
    let emitted = light.cone.map_or(0.0, |cone| -cone.axis.dot(to));
    f64::from(light.intensity * (emitted * at.normal.dot(to)).max(0.0) / (squared * squared))
        * f64::from(u8::from(emitted > 0.0))
}

/// A structure as frames use it.
trait Method {
    fn rebuild(&mut self, lights: &[Light]);

    /// Choices of one block, `samples` for each point, with stratified or independent numbers from
    /// `rng`.
    fn choose(&mut self, at: &[ShadingPoint], samples: usize, turn: u64, choices: &mut [Option<LightChoice>]);
}

/// Stratified numbers from the root.
struct FromRoot<S, B> {
    sampler: S,
    build: B,
}

impl<S: LightSampler, B: Fn(&mut S, &[Light])> Method for FromRoot<S, B> {
    fn rebuild(&mut self, lights: &[Light]) {
        (self.build)(&mut self.sampler, lights);
    }

    fn choose(
        &mut self,
        at: &[ShadingPoint],
        samples: usize,
        turn: u64,
        choices: &mut [Option<LightChoice>],
    ) {
        let mut u = [0; 16];
        for (i, (at, choices)) in at.iter().zip(choices.chunks_mut(samples)).enumerate() {
            let mut rng = CounterRng::new(turn, at.position.x.to_bits(), i as u32);
            let stratum = u64::MAX / samples as u64;
            for (k, u) in (0..).zip(&mut u[..samples]) {
                *u = stratum * k + ((u128::from(rng.next_u64()) * u128::from(stratum)) >> 64) as u64;
            }
            self.sampler.sample_many(at, &u[..samples], choices);
            for choice in choices.iter_mut().flatten() {
                choice.pmf *= samples as f32;
            }
        }
    }
}

/// One light of each subtree of a cut that the block shares.
struct Cuts<T, B> {
    tree: T,
    build: B,
    cut: Lightcut,
}

impl<T: LightSubtrees, B: Fn(&mut T, &[Light])> Method for Cuts<T, B> {
    fn rebuild(&mut self, lights: &[Light]) {
        (self.build)(&mut self.tree, lights);
    }

    fn choose(
        &mut self,
        at: &[ShadingPoint],
        samples: usize,
        turn: u64,
        choices: &mut [Option<LightChoice>],
    ) {
        let one = &at[CounterRng::new(turn, 5, 0).next_u32() as usize % at.len()];
        self.tree.choose_cut(one, samples, &mut self.cut);
        let mut u = [0; 16];
        for (i, (at, choices)) in at.iter().zip(choices.chunks_mut(samples)).enumerate() {
            let mut rng = CounterRng::new(turn, at.position.x.to_bits(), i as u32);
            u[..samples].fill_with(|| rng.next_u64());
            self.tree
                .sample_subtrees(&self.cut, 0, at, &u[..samples], choices);
        }
    }
}

/// Seconds to build, seconds to choose for a point, and squared relative error, for each number of
/// samples.
struct Measured {
    build: f64,
    choose: [f64; SAMPLES.len()],
    error: [f64; SAMPLES.len()],
}

fn measure(method: &mut dyn Method, frames: &[Vec<Light>], at: &[ShadingPoint], exact: &[f64]) -> Measured {
    let mut build = f64::INFINITY;
    for lights in frames.iter().chain(frames).rev() {
        let start = cpu_seconds();
        method.rebuild(lights);
        build = build.min(cpu_seconds() - start);
    }
    let lights = &frames[0];
    let (mut choose, mut error) = ([f64::INFINITY; SAMPLES.len()], [0.0; SAMPLES.len()]);
    let mut choices = vec![None; BLOCK * 16];
    for (k, samples) in SAMPLES.into_iter().enumerate() {
        let mut squared = 0.0;
        for turn in 0..TURNS {
            let mut seconds = 0.0;
            for (at, exact) in at.chunks(BLOCK).zip(exact.chunks(BLOCK)) {
                let start = cpu_seconds();
                let choices = &mut choices[..BLOCK * samples];
                method.choose(at, samples, turn, choices);
                black_box(&choices);
                seconds += cpu_seconds() - start;
                for ((at, exact), choices) in at.iter().zip(exact).zip(choices.chunks(samples)) {
                    let sent = |choice: &LightChoice| {
                        irradiance(&lights[choice.light as usize], at) / f64::from(choice.pmf)
                    };
                    let estimate: f64 = choices.iter().flatten().map(sent).sum();
                    squared += (estimate - exact).powi(2);
                }
            }
            choose[k] = choose[k].min(seconds / at.len() as f64);
        }
        error[k] = squared / TURNS as f64 / exact.iter().map(|e| e * e).sum::<f64>();
    }
    Measured { build, choose, error }
}

fn frames(count: usize) {
    let at = points();
    let frames: Vec<Vec<Light>> = (0..3).map(|frame| lights(count, frame)).collect();
    let exact: Vec<f64> = at
        .iter()
        .map(|at| frames[0].iter().map(|light| irradiance(light, at)).sum())
        .collect();
    let sound = "the lights are sound";
    let perfect = || PerfectTree::new(&frames[0]).expect(sound);
    let bvh = |build| LightBvh::with_build(&frames[0], build).expect(sound);
    let again = |tree: &mut PerfectTree, lights: &[Light]| tree.rebuild(lights).expect(sound);
    let bvh_again = |bvh: &mut LightBvh, lights: &[Light]| bvh.rebuild(lights).expect(sound);
    let power_again =
        |power: &mut PowerLights, lights: &[Light]| *power = PowerLights::new(lights).expect(sound);
    let root = |build| FromRoot {
        sampler: bvh(build),
        build: bvh_again,
    };
    let cuts = |build| Cuts {
        tree: bvh(build),
        build: bvh_again,
        cut: Lightcut::default(),
    };
    let mut methods: Vec<(&str, Box<dyn Method + '_>)> = vec![
        ("light BVH", Box::new(root(BvhBuild::Binned))),
        (
            "power",
            Box::new(FromRoot {
                sampler: PowerLights::new(&frames[0]).expect(sound),
                build: power_again,
            }),
        ),
        (
            "perfect tree",
            Box::new(FromRoot {
                sampler: perfect(),
                build: again,
            }),
        ),
        (
            "perfect tree, cuts",
            Box::new(Cuts {
                tree: perfect(),
                build: again,
                cut: Lightcut::default(),
            }),
        ),
        ("BVH along a curve", Box::new(root(BvhBuild::AlongCurve))),
        ("BVH along a curve, cuts", Box::new(cuts(BvhBuild::AlongCurve))),
        ("light BVH, cuts", Box::new(cuts(BvhBuild::Binned))),
    ];
    if count <= 100_000 {
        methods.push(("agglomerative", Box::new(root(BvhBuild::Agglomerative))));
    }
    let product = |m: &Measured, k: usize| {
        let time = m.build + FRAME * (m.choose[k] + SHADING * SAMPLES[k] as f64);
        time * m.error[k]
    };
    let mut baseline = None;
    for (name, mut method) in methods {
        let found = measure(method.as_mut(), &frames, &at, &exact);
        let per_choice = found.choose[2] * 1e9 / SAMPLES[2] as f64;
        print!(
            "{count:>9} {name:<26} {:>8.2} {per_choice:>9.0}",
            found.build * 1e3
        );
        let base = baseline.get_or_insert_with(|| [0, 1, 2, 3].map(|k| product(&found, k)));
        for (k, base) in base.iter().enumerate() {
            print!(" {:>9.2}", product(&found, k) / base);
        }
        println!("   {:.2e}", found.error[2]);
    }
}
