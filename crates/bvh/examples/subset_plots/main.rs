//! The figures of Dittebrandt 2025 ch. 8, measured here: SVG files in a folder.
//!
//! - `speed_up.svg` (fig. 8.5): the model's speed-up over the number of primitives, and the
//!   measured one beside binned builds;
//! - `fractions.svg` (fig. 8.7): the cost of 50 seeds for fractions from 5 to 95 per cent, beside
//!   the binned tree's, for both ways of insertion;
//! - `levels.svg` and `throughput.svg` (fig. 8.8): how many primitives each level touches, from a
//!   subset and without, and how many a second.
//!
//! Times are processor times where the system has a clock for them.
//!
//! `cargo run --release -p lightshed-bvh --example subset_plots -- FOLDER [THOUSANDS]`

mod levels;
#[path = "../../../evaluate/src/plot.rs"]
mod plot;

use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{BuildError, BuildOptions, Builder, Bvh, Insertion, Method, SubsetOptions};
use lightshed_sampling::CounterRng;
use plot::{Axis, Plot};
use std::path::Path;

/// Small triangles in heaps, and a few large ones.
fn triangles(count: usize) -> Vec<[Vec3; 3]> {
    (0..count as u32)
        .map(|index| {
            let heap = CounterRng::new(2, index % 300, 0).next_2d();
            let mut rng = CounterRng::new(1, index, 0);
            let mut vector = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) - 0.5;
            let size = if index % 1000 == 0 { 0.2 } else { 0.002 };
            let at = Vec3::new(heap[0], 0.0, heap[1]) * 10.0 + vector();
            [at, at + vector() * size, at + vector() * size]
        })
        .collect()
}

/// Processor time of this process so far, in seconds.
#[cfg(unix)]
fn seconds_so_far() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn seconds_so_far() -> f64 {
    static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    START.elapsed().as_secs_f64()
}

/// Least seconds of several runs: at least so many, and small ones for a third of a second.
fn least_seconds(times: usize, mut run: impl FnMut() -> Result<(), BuildError>) -> Result<f64, BuildError> {
    let (mut best, mut total, mut runs) = (f64::INFINITY, 0.0, 0);
    while runs < times || total < 0.3 {
        let start = seconds_so_far();
        run()?;
        let seconds = seconds_so_far() - start;
        best = best.min(seconds);
        total += seconds;
        runs += 1;
    }
    Ok(best)
}

/// Least seconds of builds in memory that is there, and the tree.
fn build(triangles: &[[Vec3; 3]], options: BuildOptions, times: usize) -> Result<(f64, Bvh), BuildError> {
    let (mut builder, mut tree) = (Builder::new(options)?, Bvh::default());
    let seconds = least_seconds(times, || builder.rebuild(triangles, &mut tree))?;
    Ok((seconds, tree))
}

/// `n log n / (m log m + n log (n / m) + α n log m)`.
fn model(count: f64, fraction: f64, alpha: f64) -> f64 {
    let subset = count * fraction;
    let ours = subset * subset.log2() + count * (count / subset).log2() + alpha * count * subset.log2();
    count * count.log2() / ours
}

fn speed_up(folder: &Path, most: usize) -> Result<(), Box<dyn std::error::Error>> {
    let fraction = SubsetOptions::default().fraction;
    let sizes: Vec<usize> = (0..10).map(|i| most >> i).filter(|&n| n >= 1000).rev().collect();
    let mut measured = Vec::new();
    for &size in &sizes {
        let triangles = triangles(size);
        let (binned, _) = build(&triangles, Method::Binned.into(), 4)?;
        let (ours, _) = build(&triangles, Method::Subset(SubsetOptions::default()).into(), 4)?;
        println!("{size} triangles: {:.2} times as fast", binned / ours);
        measured.push((size as f64, binned / ours));
    }
    let mut lines = vec![("measured".to_owned(), measured)];
    for alpha in [0.0, 0.2, 0.4, 0.7] {
        let points = sizes
            .iter()
            .map(|&n| (n as f64, model(n as f64, f64::from(fraction), alpha)));
        lines.push((format!("model, overhead {alpha}"), points.collect()));
    }
    let plot = Plot {
        title: "Speed-up of a stochastic subset over binned builds".into(),
        x: Axis::Logarithmic("primitives"),
        y: Axis::Linear("times as fast"),
        series: lines,
    };
    Ok(std::fs::write(folder.join("speed_up.svg"), plot.svg())?)
}

/// Costs of 50 seeds, from the least to the greatest, as shares of `reference`.
fn costs(triangles: &[[Vec3; 3]], options: SubsetOptions, reference: f64) -> Result<Vec<f64>, BuildError> {
    const SEEDS: u64 = 50;
    let mut costs = Vec::new();
    for seed in 0..SEEDS {
        let tree = Bvh::build(triangles, Method::Subset(SubsetOptions { seed, ..options }))?;
        costs.push(tree.sah_cost(1.0, 1.0) / reference);
    }
    costs.sort_by(f64::total_cmp);
    Ok(costs)
}

fn fractions(folder: &Path, triangles: &[[Vec3; 3]]) -> Result<(), Box<dyn std::error::Error>> {
    let reference = Bvh::build(triangles, Method::Binned)?.sah_cost(1.0, 1.0);
    let mut lines = Vec::new();
    for (name, insertion) in [("planes", Insertion::Planes), ("windows", Insertion::Window)] {
        let [mut least, mut mean, mut most] = [const { Vec::new() }; 3];
        for percent in (5..100).step_by(10) {
            let options = SubsetOptions {
                fraction: percent as f32 / 100.0,
                insertion,
                sweep: 0,
                ..SubsetOptions::default()
            };
            let costs = costs(triangles, options, reference)?;
            let average = costs.iter().sum::<f64>() / costs.len() as f64;
            let (low, high) = (costs[0], costs[costs.len() - 1]);
            println!(
                "{name}, {percent} %: cost {average:.4} of the binned tree's, from {low:.4} to {high:.4}"
            );
            let x = f64::from(percent);
            least.push((x, low));
            mean.push((x, average));
            most.push((x, high));
        }
        lines.push((format!("by {name}, greatest"), most));
        lines.push((format!("by {name}, mean"), mean));
        lines.push((format!("by {name}, least"), least));
    }
    let plot = Plot {
        title: "Cost of trees from subsets, 50 seeds each".into(),
        x: Axis::Linear("primitives in the subset, %"),
        y: Axis::Linear("cost, of the binned tree's"),
        series: lines,
    };
    Ok(std::fs::write(folder.join("fractions.svg"), plot.svg())?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("a folder for the plots is missing")?;
    let thousands: usize = arguments.next().map_or(Ok(500), |n| n.parse())?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let most = thousands * 1000;
    speed_up(folder, most)?;
    fractions(folder, &triangles(most / 10))?;
    levels::draw(folder, &triangles(most))
}
