//! Trees over boxes on a GPU: builds and refits kernel by kernel, by its own clock, beside the
//! CPU's.
//!
//! ```text
//! cargo bench -p lightshed-gpu --bench bvhs -- [BOXES]...
//! ```
//!
//! 100,000 and 1,000,000 boxes where none are given. Where a processor stands in for a GPU, its
//! time tells more than the clock. Says SKIPPED where there is no adapter, or none with a clock.

mod opening;

use lightshed_film::process_cpu_seconds;
use lightshed_gpu::lightshed_bvh::glam::Vec3;
use lightshed_gpu::lightshed_bvh::{Bounds, Builder, Bvh, Method, Node};
use lightshed_gpu::{BvhBuilder, Gpu, GpuBvh, Work};
use lightshed_sampling::CounterRng;
use std::collections::BTreeMap;

/// Builds after the first, of which the fastest counts.
const BUILDS: u32 = 5;

/// Small boxes all over a cube.
fn boxes(count: usize) -> Vec<Bounds> {
    let mut rng = CounterRng::new(1, count as u32, 0);
    let mut vector = || Vec3::from_array([(); 3].map(|()| rng.next_f32()));
    let mut next = |_| {
        let low = vector() * 100.0;
        Bounds::new(low, low + vector() * 0.5)
    };
    (0..count).map(&mut next).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut counts: Vec<usize> = std::env::args()
        .skip(1)
        .filter_map(|argument| argument.parse().ok())
        .collect();
    if counts.is_empty() {
        counts = vec![100_000, 1_000_000];
    }
    let Some(gpu) = opening::clocked_gpu() else {
        return Ok(());
    };
    let builder = BvhBuilder::new(&gpu)?;
    println!("{}, fastest of {BUILDS} builds\n", gpu.description());
    println!(
        "| boxes | build (ms) | processor time of it (ms) | kernels (ms) | refit (ms) | CPU build, processor time (ms) | tree (MB) | scratch (MB) | nodes that differ |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for count in counts {
        row(&gpu, &builder, count)?;
    }
    Ok(())
}

/// Of the whole process; NaN where it is not known.
fn cpu_seconds() -> f64 {
    process_cpu_seconds().unwrap_or(f64::NAN)
}

/// Milliseconds of the fastest run.
struct Fastest {
    /// By the device's clock.
    device: f64,
    /// Of the processor.
    processor: f64,
    /// Each kernel's, by the device's clock.
    kernels: BTreeMap<String, f64>,
}

fn fastest(gpu: &Gpu, record: impl Fn(&mut Work)) -> Result<Fastest, Box<dyn std::error::Error>> {
    let mut best = Fastest {
        device: f64::INFINITY,
        processor: f64::INFINITY,
        kernels: BTreeMap::new(),
    };
    for _ in 0..=BUILDS {
        let start = cpu_seconds();
        let mut work = gpu.timed_work();
        record(&mut work);
        let mut kernels: BTreeMap<String, f64> = BTreeMap::new();
        for pass in work.finish()? {
            *kernels.entry(pass.label).or_insert(0.0) += 1e3 * pass.seconds;
        }
        best.processor = best.processor.min(1e3 * (cpu_seconds() - start));
        let total = kernels.values().sum();
        if total < best.device {
            (best.device, best.kernels) = (total, kernels);
        }
    }
    Ok(best)
}

fn row(gpu: &Gpu, builder: &BvhBuilder, count: usize) -> Result<(), Box<dyn std::error::Error>> {
    let boxes = boxes(count);
    let buffer = gpu.buffer("boxes", &boxes)?;
    let tree = GpuBvh::new(gpu, count)?;
    let build = fastest(gpu, |work| builder.build(work, &buffer, &tree))?;
    let refit = fastest(gpu, |work| builder.refit(work, &buffer, &tree))?;
    let kernels: Vec<String> = build
        .kernels
        .iter()
        .map(|(name, ms)| format!("{name} {ms:.2}"))
        .collect();

    let (mut cpu, mut truth) = (Builder::new(Method::Curve.into())?, Bvh::default());
    let mut cpu_build = f64::INFINITY;
    for _ in 0..BUILDS {
        let start = cpu_seconds();
        cpu.rebuild(&boxes, &mut truth)?;
        cpu_build = cpu_build.min(1e3 * (cpu_seconds() - start));
    }
    let found: Vec<Node> = gpu.read(&tree.nodes, 2 * count - 1)?;
    let differ = found.iter().zip(truth.nodes()).filter(|(a, b)| a != b).count();
    println!(
        "| {count} | {:.1} | {:.1} | {} | {:.1} | {cpu_build:.1} | {:.1} | {:.1} | {differ} |",
        build.device,
        build.processor,
        kernels.join(", "),
        refit.device,
        tree.bytes() as f64 / 1e6,
        tree.scratch_bytes() as f64 / 1e6,
    );
    Ok(())
}
