//! Trees over boxes on a GPU: builds and refits kernel by kernel, by its own clock, beside the
//! CPU's.
//!
//! ```text
//! cargo bench -p lightshed-gpu --bench bvhs -- [BOXES]...
//! ```
//!
//! 100,000 and 1,000,000 boxes where none are given. Where a processor stands in for a GPU, its
//! time tells more than the clock. Says SKIPPED where there is no adapter, or none with a clock.

mod builds;
mod opening;

use builds::{BUILDS, Fastest, counts, fastest_on_cpu};
use lightshed_gpu::lightshed_bvh::glam::Vec3;
use lightshed_gpu::lightshed_bvh::{Bounds, Builder, Bvh, Interior, Method, Node, SubsetOptions};
use lightshed_gpu::{BvhBuilder, BvhSubsetBuilder, Gpu, GpuBvh, GpuBvhSubset};
use lightshed_sampling::CounterRng;

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
    let Some(gpu) = opening::clocked_gpu() else {
        return Ok(());
    };
    let builder = BvhBuilder::new(&gpu)?;
    println!("{}, fastest of {BUILDS} builds\n", gpu.description());
    println!(
        "| boxes | build (ms) | processor time of it (ms) | kernels (ms) | refit (ms) | CPU build, processor time (ms) | tree (MB) | scratch (MB) | nodes that differ |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for count in counts() {
        row(&gpu, &builder, count)?;
    }
    let subsets = BvhSubsetBuilder::new(&gpu)?;
    println!(
        "\n| boxes, by a subset | build (ms) | processor time of it (ms) | kernels (ms) | CPU build, processor time (ms) | more scratch (MB) | nodes that differ |"
    );
    println!("|---|---|---|---|---|---|---|");
    for count in counts() {
        subset_row(&gpu, &subsets, count)?;
    }
    Ok(())
}

fn subset_row(gpu: &Gpu, builder: &BvhSubsetBuilder, count: usize) -> Result<(), Box<dyn std::error::Error>> {
    let options = SubsetOptions {
        interior: Interior::Curve,
        ..SubsetOptions::windowed()
    };
    let boxes = boxes(count);
    let buffer = gpu.buffer("boxes", &boxes)?;
    let tree = GpuBvh::new(gpu, count)?;
    let subset = GpuBvhSubset::new(gpu, &tree, &options)?;
    let build = Fastest::of(gpu, |work| {
        if let Err(error) = builder.build(work, &buffer, &tree, &subset) {
            println!("{error}");
        }
    })?;
    let (mut cpu, mut truth) = (Builder::new(Method::Subset(options).into())?, Bvh::default());
    let cpu_build = fastest_on_cpu(|| cpu.rebuild(&boxes, &mut truth))?;
    let found: Vec<Node> = gpu.read(&tree.nodes, 2 * count - 1)?;
    let differ = found.iter().zip(truth.nodes()).filter(|(a, b)| a != b).count();
    println!(
        "| {count} | {:.1} | {:.1} | {} | {cpu_build:.1} | {:.1} | {differ} |",
        build.device,
        build.processor,
        build.kernels(),
        subset.bytes() as f64 / 1e6,
    );
    Ok(())
}

fn row(gpu: &Gpu, builder: &BvhBuilder, count: usize) -> Result<(), Box<dyn std::error::Error>> {
    let boxes = boxes(count);
    let buffer = gpu.buffer("boxes", &boxes)?;
    let tree = GpuBvh::new(gpu, count)?;
    let build = Fastest::of(gpu, |work| builder.build(work, &buffer, &tree))?;
    let refit = Fastest::of(gpu, |work| builder.refit(work, &buffer, &tree))?;
    let (mut cpu, mut truth) = (Builder::new(Method::Curve.into())?, Bvh::default());
    let cpu_build = fastest_on_cpu(|| cpu.rebuild(&boxes, &mut truth))?;
    let found: Vec<Node> = gpu.read(&tree.nodes, 2 * count - 1)?;
    let differ = found.iter().zip(truth.nodes()).filter(|(a, b)| a != b).count();
    println!(
        "| {count} | {:.1} | {:.1} | {} | {:.1} | {cpu_build:.1} | {:.1} | {:.1} | {differ} |",
        build.device,
        build.processor,
        build.kernels(),
        refit.device,
        tree.bytes() as f64 / 1e6,
        tree.scratch_bytes() as f64 / 1e6,
    );
    Ok(())
}
