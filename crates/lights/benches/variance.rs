//! Each structure's time to build beside the variance of its choices, for many lights that do not
//! move.
//!
//! ```sh
//! cargo bench -p lightshed-lights --bench variance
//! cargo bench -p lightshed-lights --bench variance -- 100000
//! ```
//!
//! The variance is that of one choice, `Σ (Σᵢ fᵢ² / pᵢ − F²) / Σ F²` over points on the walls of a
//! room, with `f` what a light sends to a point without shadows and `F` its sum over all lights,
//! which is computed. `Σᵢ fᵢ² / pᵢ = F E[f / p]` over lights drawn in proportion to `f` is a mean
//! of 4096 stratified draws, the same for all structures. Build times are processor time of one
//! thread, the least of several builds, in fresh memory and in memory that the structure has.

#[path = "../../bvh/benches/cpu/mod.rs"]
mod cpu;

use cpu::cpu_seconds;
use lightshed_lights::glam::Vec3;
use lightshed_lights::{
    Bounds, BvhBuild, Light, LightBvh, LightError, LightSampler, OrientationCone, PerfectTree, PowerLights,
    ShadingPoint,
};
use lightshed_sampling::{CounterRng, UniformSphere};

const POINTS: u32 = 48;
const DRAWS: usize = 4096;

fn main() -> Result<(), LightError> {
    let wanted: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    println!("| lights | structure | build, ms | again, ms | variance |");
    println!("|---|---|---|---|---|");
    for count in [100_000, 1_000_000, 4_000_000] {
        if wanted.is_empty() || wanted.contains(&count) {
            rows(count)?;
        }
    }
    Ok(())
}

/// Groups of lamps of very different brightness, each of them a patch.
fn lights(count: usize) -> Vec<Light> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(7, i as u32, 0);
            let mut shared = CounterRng::new(7, rng.next_u32() % 64, 1);
            let place =
                |rng: &mut CounterRng| Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
            let size = 0.02 + 0.3 * shared.next_f32();
            let center = place(&mut shared) * 9.0 + place(&mut rng) * 9.0 * size;
            let center = center.clamp(Vec3::splat(-9.9), Vec3::splat(9.9));
            Light {
                bounds: Bounds::new(center - 0.01, center + 0.01),
                // From a tenth to ten, most of them dim.
                intensity: 10.0_f32.powf(2.0 * rng.next_f32().powi(3) - 1.0),
                cone: Some(OrientationCone::diffuse(UniformSphere::sample(rng.next_2d()))),
            }
        })
        .collect()
}

/// On the faces of a cube around the lights.
fn point(index: u32) -> ShadingPoint {
    let mut rng = CounterRng::new(3, index, 9);
    let axis = index as usize % 3;
    let side = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
    let mut place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 18.0 - 9.0;
    place[axis] = -10.0 * side;
    let mut normal = Vec3::ZERO;
    normal[axis] = side;
    ShadingPoint::new(place, normal, 1.0)
}

/// What a light sends to a point, by its middle.
fn irradiance(light: &Light, at: &ShadingPoint) -> f64 {
    let to = light.bounds.center() - at.position;
    let squared = to.length_squared();
    let emitted = light.cone.map_or(0.0, |cone| -cone.axis.dot(to)).max(0.0);
    f64::from(light.intensity * emitted * at.normal.dot(to).max(0.0) / (squared * squared))
}

/// A point, what all lights send to it, and lights in proportion to what they send.
struct Receiver {
    at: ShadingPoint,
    total: f64,
    drawn: Vec<u32>,
}

impl Receiver {
    fn new(lights: &[Light], index: u32) -> Self {
        let at = point(index);
        let sent: Vec<f64> = lights.iter().map(|light| irradiance(light, &at)).collect();
        let total: f64 = sent.iter().sum();
        let mut rng = CounterRng::new(5, index, 0);
        let (mut drawn, mut sum, mut next) = (Vec::new(), 0.0, f64::from(rng.next_f32()));
        for (light, &sent) in (0u32..).zip(&sent) {
            sum += sent;
            while sent > 0.0 && drawn.len() < DRAWS && next * total < sum * DRAWS as f64 {
                drawn.push(light);
                next = drawn.len() as f64 + f64::from(rng.next_f32());
            }
        }
        Self { at, total, drawn }
    }

    /// `Σ f² / p`.
    fn second_moment(&self, lights: &[Light], sampler: &dyn LightSampler) -> f64 {
        let ratio = |&light: &u32| {
            irradiance(&lights[light as usize], &self.at) / f64::from(sampler.pmf(&self.at, light))
        };
        self.total * self.drawn.iter().map(ratio).sum::<f64>() / self.drawn.len() as f64
    }
}

/// Builds and rebuilds, and prints a row.
fn row<S: LightSampler>(
    name: &str,
    lights: &[Light],
    receivers: &[Receiver],
    build: impl Fn() -> Result<S, LightError>,
    rebuild: impl Fn(&mut S) -> Result<(), LightError>,
) -> Result<(), LightError> {
    let runs = if name == "agglomerative" {
        1
    } else {
        (3_000_000 / lights.len()).clamp(3, 20)
    };
    let (mut fresh, mut again) = (f64::INFINITY, f64::INFINITY);
    let mut sampler = build()?;
    for _ in 0..runs {
        let start = cpu_seconds();
        let built = build()?;
        fresh = fresh.min(cpu_seconds() - start);
        sampler = built;
    }
    for _ in 0..runs {
        let start = cpu_seconds();
        rebuild(&mut sampler)?;
        again = again.min(cpu_seconds() - start);
    }
    let squares: f64 = receivers.iter().map(|r| r.total * r.total).sum();
    let moments: f64 = receivers.iter().map(|r| r.second_moment(lights, &sampler)).sum();
    println!(
        "| {} | {name} | {:.1} | {:.1} | {:.3} |",
        lights.len(),
        fresh * 1e3,
        again * 1e3,
        (moments - squares) / squares
    );
    Ok(())
}

fn rows(count: usize) -> Result<(), LightError> {
    let lights = lights(count);
    let receivers: Vec<Receiver> = (0..POINTS).map(|i| Receiver::new(&lights, i)).collect();
    let (lights, receivers) = (&lights[..], &receivers[..]);
    row(
        "by power",
        lights,
        receivers,
        || PowerLights::new(lights),
        |power| {
            *power = PowerLights::new(lights)?;
            Ok(())
        },
    )?;
    row(
        "perfect tree",
        lights,
        receivers,
        || PerfectTree::new(lights),
        |tree| tree.rebuild(lights),
    )?;
    for (name, build) in [
        ("along the curve", BvhBuild::AlongCurve),
        ("stochastic subset", BvhBuild::Stochastic),
        ("binned", BvhBuild::Binned),
    ] {
        let built = || LightBvh::with_build(lights, build);
        row(name, lights, receivers, built, |bvh| bvh.rebuild(lights))?;
    }
    // Minutes for more.
    if count <= 100_000 {
        let built = || LightBvh::with_build(lights, BvhBuild::Agglomerative);
        row("agglomerative", lights, receivers, built, |bvh| {
            bvh.rebuild(lights)
        })?;
    }
    Ok(())
}
