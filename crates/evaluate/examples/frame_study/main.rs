//! What frames of methods look like to whoever watches them: error of single frames, raw and after
//! a spatiotemporal filter, and covariance over time and space.
//!
//! ```text
//! cargo run --release --example frame_study -- cornell doorway \
//!     --methods path,restir-pt,restir-suffix
//! ```
//!
//! A frame of each method takes the processor time of a frame of the last one: methods of
//! independent samples get as many as fit, and a chain of frames that is cheaper is the mean of as
//! many independent chains (`--once` makes it one). The filter sees frames without the emission
//! that is seen directly, which is known and is added afterwards, as renderers do. With `--move` or
//! `--pan` the camera moves until the last frame, which alone is judged; the pixels whose surfaces
//! came into view within the last five frames are judged for themselves, too. With `--return` it
//! goes away and comes back to its first view, so that it has seen these surfaces before.

#[path = "../moving/mod.rs"]
mod moving;

use clap::Parser;
use lightshed::film::{FrameMethod, process_cpu_seconds, read_exr, write_png};
use lightshed::integrator::{CameraMotion, Method, PathTracer, Stage};
use lightshed::scene::{Rgb, Scene, SceneDescription, builtin, import};
use lightshed_evaluate::{Reference, TemporalStudy};
use moving::{CameraPath, Denoiser, DenoiserKind, Failure, Moving, View, image, started, views};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

#[derive(Parser, Debug)]
#[command(about = "Errors of single frames, raw and filtered, and their covariance over time and space")]
struct Arguments {
    /// Built-in scenes or files.
    #[arg(default_value = "cornell")]
    scenes: Vec<String>,
    /// Methods by name, with options as in path:bvh.
    #[arg(long, value_delimiter = ',', default_value = "path,restir-pt,restir-suffix")]
    methods: Vec<Method>,
    /// Image size.
    #[arg(long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, default_values_t = [96, 96])]
    size: Vec<u32>,
    /// Longest path in edges, instead of the scene's own.
    #[arg(long)]
    max_depth: Option<u32>,
    /// Frames of a chain.
    #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u32).range(2..))]
    frames: u32,
    /// Independent chains.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Number of the first chain, which names its random numbers.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// Frames of a chain whose covariance is taken, after the others; 0 for none.
    #[arg(long, default_value_t = 0)]
    covariance: u32,
    /// Samples of a reference by path tracing.
    #[arg(long, default_value_t = 2048)]
    reference_spp: u32,
    /// Two independent images (OpenEXR) instead, whose mean is the reference of a still camera.
    #[arg(long, value_names = ["FIRST", "SECOND"], num_args = 2, conflicts_with_all = ["moves", "pan"])]
    reference: Vec<PathBuf>,
    /// Moves the camera by this share of the scene's size to the right from frame to frame.
    #[arg(long = "move")]
    moves: Option<f32>,
    /// Turns the camera by this angle in degrees to the right from frame to frame.
    #[arg(long, conflicts_with = "moves")]
    pan: Option<f32>,
    /// Half of the frames away, the other half the same way back.
    #[arg(long = "return")]
    returns: bool,
    /// What filters frames.
    #[arg(long, value_enum, default_value_t = DenoiserKind::Svgf)]
    denoiser: DenoiserKind,
    /// Prints a table of errors instead, relative squared ones unless it says otherwise, of a still
    /// camera and, with `--move`, of a moving one; the least error of a row is bold.
    #[arg(long)]
    table: bool,
    /// One chain of each method, though it is cheaper than a frame of the last one.
    #[arg(long)]
    once: bool,
    /// Folder for (x, t) slices and filtered frames.
    #[arg(long)]
    out: Option<PathBuf>,
}

fn description(arguments: &Arguments, scene: &str) -> Result<SceneDescription, Failure> {
    let mut description = match builtin::by_name(scene) {
        Some(description) => description,
        None => import::load(Path::new(scene), &[])?.description,
    };
    let settings = &mut description.settings;
    (settings.width, settings.height) = (arguments.size[0], arguments.size[1]);
    settings.max_depth = arguments.max_depth.or(settings.max_depth);
    Ok(description)
}

fn cpu() -> f64 {
    process_cpu_seconds().unwrap_or(0.0)
}

/// Errors of a method's last frames, summed over frames and chains.
#[derive(Default)]
struct Errors {
    frames: f64,
    /// Mean squared and mean squared relative error, raw; the same, filtered.
    sums: [f64; 4],
    /// FLIP, raw and filtered; 0 without the feature.
    flip: [f64; 2],
    /// Relative squared error of young pixels, their squared error, and their number.
    young: [f64; 3],
    /// The method's own figures after the last frame, summed.
    figures: BTreeMap<&'static str, f64>,
    seconds: f64,
    rays: f64,
}

struct Study<'a> {
    arguments: &'a Arguments,
    motion: CameraMotion,
    reference: &'a Reference,
    /// Of each frame; of one frame if the camera is still.
    views: Vec<View>,
}

/// The options' way of the camera; `None` if it does not move.
fn camera_path(
    arguments: &Arguments,
    scene: &Scene,
    description: &SceneDescription,
    moves: bool,
) -> Option<CameraPath> {
    let step = [arguments.moves, arguments.pan];
    let is_moving = moves && step.iter().any(Option::is_some);
    let back_from = arguments.returns.then_some((arguments.frames - 1) / 2);
    is_moving.then(|| CameraPath::new(scene, description, step.map(Option::unwrap_or_default), back_from))
}

impl Study<'_> {
    /// Whose frames are of scenes of their own if the camera moves is started at rest.
    fn started<'b>(
        &self,
        stage: &'b Stage<'_>,
        method: &Method,
        samples: u32,
    ) -> Result<Box<dyn FrameMethod + 'b>, Failure> {
        let motion = match method.capabilities().camera_motion {
            true => self.motion,
            false => CameraMotion::STILL,
        };
        started(stage, method, motion, samples)
    }

    fn chain(
        &self,
        method: &mut dyn FrameMethod,
        seed: u64,
        errors: &mut Errors,
    ) -> Result<Vec<Rgb>, Failure> {
        let Arguments { frames, .. } = self.arguments;
        let size = self.reference.size();
        let mut filter = Denoiser::new(self.arguments.denoiser, size)?;
        let mut frame = vec![Rgb::ZERO; size[0] as usize * size[1] as usize];
        let mut filtered = frame.clone();
        // What is still is judged by several frames.
        let judged = if self.motion.is_still() { frames / 3 } else { 1 };
        for number in 0..*frames {
            let start = cpu();
            let done = method.render_frame(number, seed, &mut frame, &AtomicBool::new(false));
            errors.rays += done
                .ok_or("interrupted")?
                .by_name()
                .map(|(_, rays)| rays)
                .iter()
                .sum::<u64>() as f64
                / f64::from(*frames);
            errors.seconds += (cpu() - start) / f64::from(*frames);
            let view = &self.views[(number as usize).min(self.views.len() - 1)];
            filtered = filter.filter(view, &frame)?;
            if number + judged.max(1) < *frames {
                continue;
            }
            let raw_image = image(size, &frame)?;
            let raw = self.reference.errors(&raw_image)?;
            let smooth = self.reference.errors(&image(size, &filtered)?)?;
            let new = [raw.mse, raw.rel_mse, smooth.mse, smooth.rel_mse];
            errors
                .sums
                .iter_mut()
                .zip(new)
                .for_each(|(sum, value)| *sum += value);
            #[cfg(feature = "flip")]
            for (sum, shown) in errors.flip.iter_mut().zip([&frame, &filtered]) {
                *sum += self.reference.flip(&image(size, shown)?)?;
            }
            errors.frames += 1.0;
            let by_pixel = self.reference.relative_errors(&raw_image)?;
            let truths = self.reference.image().pixels();
            let apart = frame.iter().zip(truths).map(|(value, truth)| {
                let apart = *value - Rgb::from(*truth);
                f64::from(apart.length_squared()) / 3.0
            });
            let seen = by_pixel.iter().zip(apart).zip(filter.ages());
            for (pixel, ((error, squared), age)) in seen.enumerate() {
                if number > 5 && age <= 5.0 && view.reflects(pixel) {
                    errors.young[0] += error * error;
                    errors.young[1] += squared;
                    errors.young[2] += 1.0;
                }
            }
        }
        for (name, figure) in method.figures() {
            *errors.figures.entry(name).or_default() += figure;
        }
        Ok(filtered)
    }
}

/// A row for each method, with a camera that moves or not.
fn run(arguments: &Arguments, name: &str, moves: bool) -> Result<Vec<Value>, Failure> {
    let mut rows = Vec::new();
    let description = description(arguments, name)?;
    let scene = Scene::new(&description)?;
    let path = camera_path(arguments, &scene, &description, moves);
    let last = arguments.frames - 1;
    let motion = match path {
        Some(path) => path.motion(&description)?,
        None => CameraMotion::STILL,
    };
    let moved = match path {
        Some(path) => Scene::new(&path.moved(&description, last))?,
        None => Scene::new(&description)?,
    };
    let size = [arguments.size[0], arguments.size[1]];
    let never = AtomicBool::new(false);
    let reference = match arguments.reference.as_slice() {
        [first, second] => Reference::of_halves([read_exr(first)?, read_exr(second)?])?,
        _ => {
            let tracer = PathTracer::new(&moved, moved.emitters_by_power());
            Reference::rendered(&tracer, size, arguments.reference_spp, &|_| (), &never)?
        }
    };
    if reference.size() != size {
        return Err(format!("the reference has {:?} pixels", reference.size()).into());
    }
    let mean = reference.image().mean().iter().sum::<f64>() / 3.0;
    let study = Study {
        arguments,
        motion,
        reference: &reference,
        views: views(&scene, motion, arguments.frames),
    };
    let (stage, moved_stage) = (Stage::new(&scene), Stage::new(&moved));
    // The yardstick: a frame of the last method, after its first ones.
    let yardstick = arguments.methods.last().ok_or("no method")?;
    let mut method = study.started(&stage, yardstick, 1)?;
    let mut frame = vec![Rgb::ZERO; size[0] as usize * size[1] as usize];
    let mut budget = 0.0;
    for number in 0..4 {
        let start = cpu();
        method
            .render_frame(number, 1, &mut frame, &never)
            .ok_or("interrupted")?;
        budget = cpu() - start;
    }
    drop(method);
    for method in &arguments.methods {
        let is_plain = !method.capabilities().frames;
        let follows = method.capabilities().camera_motion;
        let stage = if follows { &stage } else { &moved_stage };
        // A few first frames, and the ones that are timed.
        let tried = if is_plain { 8 } else { 1 };
        let mut trial = study.started(stage, method, tried)?;
        let (mut cost, frames) = (0.0, if is_plain { 2 } else { 4 });
        for number in 0..frames {
            let start = cpu();
            trial
                .render_frame(number, 1, &mut frame, &never)
                .ok_or("interrupted")?;
            cost = cpu() - start;
        }
        drop(trial);
        let mut samples = ((f64::from(tried) * budget / cost).round() as u32).max(1);
        if !is_plain && (arguments.once || method.to_string() == yardstick.to_string()) {
            samples = 1;
        }
        let mut errors = Errors::default();
        let mut filtered = Vec::new();
        for repeat in 0..arguments.repeats {
            let mut chain: Box<dyn FrameMethod + '_> = match path {
                Some(path) if !follows => Box::new(Moving::new(method, samples, &description, path)),
                _ => study.started(stage, method, samples)?,
            };
            filtered = study.chain(&mut *chain, u64::from(arguments.first + repeat) + 1, &mut errors)?;
        }
        let [mse, rel_mse, filtered_mse, filtered_rel_mse] = errors.sums.map(|sum| sum / errors.frames);
        let mut row = json!({
            "scene": name, "method": method.to_string(), "samples": samples,
            "cpu_seconds": errors.seconds / f64::from(arguments.repeats),
            "rays_a_pixel": errors.rays / f64::from(arguments.repeats) / frame.len() as f64,
            "mse": mse, "rel_mse": rel_mse, "filtered_mse": filtered_mse, "filtered_rel_mse": filtered_rel_mse,
        });
        if cfg!(feature = "flip") {
            let [raw, filtered] = errors.flip.map(|sum| sum / errors.frames);
            (row["flip"], row["filtered_flip"]) = (json!(raw), json!(filtered));
        }
        let [young_rel_mse, young_mse, young] = errors.young;
        if young > 0.0 {
            row["young_rel_mse"] = json!(young_rel_mse / young);
            row["young_mse"] = json!(young_mse / young);
            row["young_pixels"] = json!(young / errors.frames);
        }
        for (name, figure) in &errors.figures {
            row[name] = json!(figure / f64::from(arguments.repeats));
        }
        if arguments.covariance > 1 {
            let mut chain = study.started(stage, method, samples)?;
            let temporal = TemporalStudy::run(
                &mut *chain,
                arguments.frames,
                arguments.covariance,
                9 + u64::from(arguments.first),
                &never,
            )?;
            let covariance = temporal.autocovariance(32, 16);
            let scale = 1.0 / (mean * mean);
            row["in_time"] = json!(
                covariance
                    .in_time
                    .iter()
                    .map(|value| value * scale)
                    .collect::<Vec<_>>()
            );
            row["in_space"] = json!(
                covariance
                    .in_space
                    .iter()
                    .map(|value| value * scale)
                    .collect::<Vec<_>>()
            );
            if let Some(folder) = &arguments.out {
                let name = method.to_string().replace([':', '='], "-");
                let file = File::create(folder.join(format!("{name}-slice.png")))?;
                write_png(&temporal.slice()?, 0.0, file)?;
            }
        }
        if let Some(folder) = &arguments.out {
            let name = method.to_string().replace([':', '='], "-");
            let file = File::create(folder.join(format!("{name}-filtered.png")))?;
            write_png(&image(size, &filtered)?, 0.0, file)?;
        }
        if !arguments.table {
            println!("{row}");
        }
        rows.push(row);
    }
    Ok(rows)
}

/// The table of a scene: raw and filtered errors, those of pixels that have just come into view,
/// and the time of a frame.
fn table(arguments: &Arguments, name: &str) -> Result<(), Failure> {
    // A file is called as its folder.
    let path = Path::new(name);
    let folder = path.parent().and_then(Path::file_name);
    let title = folder.map_or(name.into(), |folder| folder.to_string_lossy());
    let is_moving = arguments.moves.is_some() || arguments.pan.is_some();
    let cameras = [("still", false), ("moving", true)];
    for (camera, moves) in cameras.into_iter().filter(|(_, moves)| !moves || is_moving) {
        let rows = run(arguments, name, moves)?;
        let errors = [
            ("raw", "rel_mse", 1.0),
            ("filtered", "filtered_rel_mse", 1.0),
            ("filtered, 10⁻⁶ squared", "filtered_mse", 1e6),
            ("raw, FLIP", "flip", 1.0),
            ("filtered, FLIP", "filtered_flip", 1.0),
            ("raw, just in view", "young_rel_mse", 1.0),
            ("CPU time, ms", "cpu_seconds", 1e3),
        ];
        for (what, key, scale) in errors {
            let values = rows.iter().filter_map(|row| row[key].as_f64());
            let values: Vec<f64> = values.map(|value| value * scale).collect();
            if values.len() < rows.len() {
                continue;
            }
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let cells = values.iter().zip(&rows).map(|(&value, row)| {
                let is_error = key != "cpu_seconds";
                let bold = if is_error && value == least { "**" } else { "" };
                let digits = (2 - value.log10().floor().clamp(-9.0, 2.0) as i32) as usize;
                format!(" {bold}{value:.digits$}{bold} ({}) |", row["samples"])
            });
            println!("| `{title}` | {camera} | {what} |{}", cells.collect::<String>());
        }
    }
    Ok(())
}

fn study(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.table {
        let names = arguments.methods.iter().map(|method| format!(" `{method}` |"));
        println!("| scene | camera | error |{}", names.collect::<String>());
        println!("|---|---|---|{}", "---|".repeat(arguments.methods.len()));
    }
    for name in &arguments.scenes {
        match arguments.table {
            true => table(arguments, name)?,
            false => drop(run(arguments, name, true)?),
        }
    }
    Ok(())
}

fn main() -> ExitCode {
    match study(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("frame_study: {error}");
            ExitCode::FAILURE
        }
    }
}
