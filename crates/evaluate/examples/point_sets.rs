//! Point sets beside each other: squared error raw and after a small Gaussian filter, which stands
//! for an eye at some distance, and processor time.
//!
//! ```text
//! cargo run --release --example point_sets -- cornell doorway --method path --samples 1,4,16,64
//! ```
//!
//! Methods of samples take so many samples a pixel, methods of frames so many frames. Errors are
//! those of the luminance against two independent halves of a reference, so its noise is in
//! neither: `(G(x − a))·(G(x − b))` has the expectation of `(G(x − μ))²`, with `G` the filter or
//! nothing. `ratio` columns are those of the first set over the other; `±` is the standard error of
//! their logarithm, from the seeds.

use clap::Parser;
use lightshed::film::process_cpu_seconds;
use lightshed::integrator::{Method, Motion, Stage};
use lightshed::sampling::{PointSet, luminance};
use lightshed::scene::{Rgb, Scene, builtin, import};
use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

#[derive(Parser, Debug)]
#[command(about = "Errors of point sets, raw and after a small Gaussian filter")]
struct Arguments {
    /// Built-in scenes or files.
    #[arg(default_value = "cornell")]
    scenes: Vec<String>,
    /// Method by name, with options as in path:bvh.
    #[arg(long, default_value = "path")]
    method: Method,
    /// Method of the reference, if not the same.
    #[arg(long)]
    reference: Option<Method>,
    /// Point sets, the one that others are compared with first.
    #[arg(long, value_delimiter = ',', default_value = "sobol,blue-noise")]
    sets: Vec<PointSet>,
    /// Samples a pixel, or frames.
    #[arg(long, value_delimiter = ',', default_value = "1,4,16,64")]
    samples: Vec<u32>,
    /// Image size.
    #[arg(long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, default_values_t = [96, 96])]
    size: Vec<u32>,
    /// Longest path in edges, instead of the scene's own.
    #[arg(long)]
    max_depth: Option<u32>,
    /// Independent seeds.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(2..))]
    seeds: u32,
    /// Samples or frames of a reference.
    #[arg(long, default_value_t = 4096)]
    reference_samples: u32,
    /// Standard deviation of the filter, in pixels.
    #[arg(long, default_value_t = 1.0)]
    sigma: f64,
}

type Failure = Box<dyn Error>;

/// The luminance of an image, and the processor time that it took.
fn render(
    stage: &Stage<'_>,
    (method, samples): (&Method, u32),
    size: [u32; 2],
    seed: u64,
) -> Result<(Vec<f64>, f64), Failure> {
    let frames = if method.capabilities().frames { samples } else { 1 };
    let started = method.start(stage, Motion::STILL)?;
    let mut started = started.into_frames(size, samples / frames);
    let mut image = vec![Rgb::ZERO; size[0] as usize * size[1] as usize];
    let mut sum = vec![0.0; image.len()];
    let clock = || process_cpu_seconds().unwrap_or(0.0);
    let before = clock();
    for frame in 0..frames {
        let done = started.render_frame(frame, seed, &mut image, &AtomicBool::new(false));
        done.ok_or("interrupted")?;
        for (sum, &value) in sum.iter_mut().zip(&image) {
            *sum += f64::from(luminance(value)) / f64::from(frames);
        }
    }
    Ok((sum, clock() - before))
}

/// A Gaussian over the image; at its border over the part of it that is there.
fn blurred(values: &[f64], [width, height]: [u32; 2], sigma: f64) -> Vec<f64> {
    let [width, height] = [width as i32, height as i32];
    let reach = (3.0 * sigma).ceil() as i32;
    let weights: Vec<f64> = (-reach..=reach)
        .map(|at| (-0.5 * (f64::from(at) / sigma).powi(2)).exp())
        .collect();
    let along = |values: &[f64], horizontal: bool| -> Vec<f64> {
        let at = |x: i32, y: i32| {
            let (mut sum, mut total) = (0.0, 0.0);
            for (offset, weight) in (-reach..).zip(&weights) {
                let (u, v) = if horizontal {
                    (x + offset, y)
                } else {
                    (x, y + offset)
                };
                if (0..width).contains(&u) && (0..height).contains(&v) {
                    sum += weight * values[(v * width + u) as usize];
                    total += weight;
                }
            }
            sum / total
        };
        (0..width * height)
            .map(|index| at(index % width, index / width))
            .collect()
    };
    along(&along(values, true), false)
}

/// Raw and filtered mean squared error.
fn errors(image: &[f64], halves: &[Vec<f64>; 2], size: [u32; 2], sigma: f64) -> [f64; 2] {
    let off = |half: &[f64]| image.iter().zip(half).map(|(x, a)| x - a).collect::<Vec<f64>>();
    let [a, b] = [off(&halves[0]), off(&halves[1])];
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
    let [c, d] = [blurred(&a, size, sigma), blurred(&b, size, sigma)];
    [product(&a, &b), product(&c, &d)]
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().sum::<f64>() / values.count() as f64
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let size = [arguments.size[0], arguments.size[1]];
    println!("| scene | samples | set | MSE | filtered | ratio raw | ± | ratio filtered | ± | CPU s |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for name in &arguments.scenes {
        let mut description = match builtin::by_name(name) {
            Some(description) => description,
            None => import::load(Path::new(name), &[])?.description,
        };
        let settings = &mut description.settings;
        (settings.width, settings.height) = (size[0], size[1]);
        settings.max_depth = arguments.max_depth.or(settings.max_depth);
        let scene = Scene::new(&description)?;
        let stage = Stage::new(&scene);
        let truth = arguments.reference.as_ref().unwrap_or(&arguments.method);
        let half = |seed| render(&stage, (truth, arguments.reference_samples / 2), size, seed);
        let halves = [half(u64::MAX - 1)?.0, half(u64::MAX - 2)?.0];
        let title = Path::new(name).parent().and_then(Path::file_name);
        let title = title.map_or(name.clone(), |title| title.to_string_lossy().into_owned());
        for &samples in &arguments.samples {
            let mut first = Vec::new();
            for set in &arguments.sets {
                let mut method = arguments.method.clone();
                method.set("points", set.name())?;
                let (mut found, mut seconds) = (Vec::new(), 0.0);
                for seed in 0..u64::from(arguments.seeds) {
                    let (image, spent) = render(&stage, (&method, samples), size, seed)?;
                    found.push(errors(&image, &halves, size, arguments.sigma));
                    seconds += spent / f64::from(arguments.seeds);
                }
                if first.is_empty() {
                    first.clone_from(&found);
                }
                let [raw, filtered] = [0, 1].map(|which| mean(found.iter().map(|errors| errors[which])));
                print!("| `{title}` | {samples} | {set} | {raw:.3e} | {filtered:.3e} |");
                for which in [0, 1] {
                    let ratio = mean(first.iter().map(|errors| errors[which])) / [raw, filtered][which];
                    // Seeds of different sets are independent of each other.
                    let spread = |found: &[[f64; 2]]| {
                        let logs = || found.iter().map(move |errors| errors[which].max(1e-300).ln());
                        let middle = mean(logs());
                        let count = found.len() as f64;
                        logs().map(|log| (log - middle).powi(2)).sum::<f64>() / (count * (count - 1.0))
                    };
                    print!(" {ratio:.2} | {:.2} |", (spread(&first) + spread(&found)).sqrt());
                }
                println!(" {seconds:.3} |");
            }
        }
    }
    Ok(())
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("point_sets: {error}");
            ExitCode::FAILURE
        }
    }
}
