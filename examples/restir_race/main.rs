//! Run time against error: path tracing, path reuse and ReSTIR path tracing on one scene, in one run.
//!
//! ```text
//! cargo run --release --example restir_race -- cornell-glossy --seconds 20 --json
//! ```
//!
//! Methods take turns frame by frame until each has had its processor time; errors are those of the luminance, at times that
//! double. Of the real-time chain single frames are judged, after 20 others, against as many path-traced samples as fit into the
//! time of one.

#[path = "../common/reference.rs"]
mod reference;

use clap::Parser;
use lightshed::integrator::{
    CameraMotion, FrameMethod, Neighbourhood, PathMapping, PathReuse, RestirPt, RestirPtOptions, SceneWorld,
    read_exr,
};
use lightshed::scene::{Rgb, Scene, builtin, import};
use lightshed_evaluate::Plot;
use reference::{PlainFrames, Reference, clock, image_luminance};
use serde_json::{Value, json};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

#[derive(Parser, Debug)]
#[command(about = "Run time against error of path tracing, path reuse and ReSTIR path tracing")]
struct Arguments {
    /// A built-in scene or a file.
    #[arg(default_value = "cornell-glossy")]
    scene: String,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
    /// Processor seconds for each method.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Image size.
    #[arg(long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, default_values_t = [128, 128])]
    size: Vec<u32>,
    /// Show the middle of an image so many times as wide and high: pixels that are neighbours then see places as close as they are
    /// in a large image.
    #[arg(long, default_value_t = 1.0, value_parser = zoom)]
    zoom: f32,
    /// Longest path in edges, instead of the scene's own.
    #[arg(long)]
    max_depth: Option<u32>,
    /// OpenEXR image of that size to compare with; path-traced with --reference-spp where there is none.
    #[arg(long)]
    reference: Option<PathBuf>,
    /// Setting of restir-pt-offline to race as well, hybrid: trees, rounds, neighbours of a disk (0 for all of a square) and its
    /// radius in pixels, such as 16,3,12,10. May be repeated.
    #[arg(long, value_name = "TREES,ROUNDS,NEIGHBOURS,RADIUS", value_parser = setting)]
    setting: Vec<RestirPtOptions>,
    /// Samples a pixel of the reference.
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(2..))]
    reference_spp: u32,
    /// Folder for the plots.
    #[arg(long, default_value = "target/restir_race")]
    plots: PathBuf,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Reads `--zoom`.
fn zoom(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(zoom) if (1.0..1e6).contains(&zoom) => Ok(zoom),
        _ => Err("a number from 1 on is needed".into()),
    }
}

/// Reads a `--setting`.
fn setting(text: &str) -> Result<RestirPtOptions, String> {
    let parts: Vec<u32> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| format!("{part:?} is no number")))
        .collect::<Result<_, _>>()?;
    let [candidates, rounds, count, radius] = parts[..] else {
        return Err("four numbers are needed".into());
    };
    Ok(RestirPtOptions {
        candidates,
        rounds,
        neighbourhood: if count == 0 {
            Neighbourhood::Window { radius }
        } else {
            let radius = radius as f32;
            Neighbourhood::Disk { radius, count }
        },
        ..RestirPtOptions::offline(PathMapping::Hybrid)
    })
}

/// What a setting is called.
fn name(options: &RestirPtOptions) -> String {
    let RestirPtOptions {
        candidates, rounds, ..
    } = options;
    match options.neighbourhood {
        Neighbourhood::Window { radius } => {
            let side = 2 * radius + 1;
            format!("restir-pt-offline {candidates} trees, {rounds}x{side}x{side}")
        }
        Neighbourhood::Disk { radius, count } => {
            format!("restir-pt-offline {candidates} trees, {rounds}x{count} in {radius}")
        }
    }
}

/// A method in the race.
struct Runner<'a> {
    name: String,
    method: Box<dyn FrameMethod + 'a>,
    sum: Vec<f64>,
    frames: u32,
    cpu_seconds: f64,
    /// Processor time, MSE and MAPE.
    curve: Vec<[f64; 3]>,
}

impl<'a> Runner<'a> {
    fn new(name: impl Into<String>, method: impl FrameMethod + 'a, pixels: usize) -> Self {
        Self {
            name: name.into(),
            method: Box::new(method),
            sum: vec![0.0; pixels],
            frames: 0,
            cpu_seconds: 0.0,
            curve: Vec::new(),
        }
    }

    /// One frame more; a point of the curve at each doubling of time.
    fn step(&mut self, reference: &Reference, image: &mut [Rgb], start: Instant) {
        let before = clock(start);
        self.method
            .render_frame(self.frames, 11, image, &AtomicBool::new(false));
        self.cpu_seconds += clock(start) - before;
        self.frames += 1;
        for (sum, value) in self.sum.iter_mut().zip(image_luminance(image)) {
            *sum += value;
        }
        if self
            .curve
            .last()
            .is_none_or(|last| self.cpu_seconds >= 2.0 * last[0])
        {
            self.note(reference);
        }
    }

    fn note(&mut self, reference: &Reference) {
        let errors = [
            reference.mse(&self.sum, self.frames),
            reference.mape(&self.sum, self.frames),
        ];
        self.curve.push([self.cpu_seconds, errors[0], errors[1]]);
    }

    /// Processor time that path tracing would take for the last MSE and MAPE, over that taken: errors fall as one over time and
    /// as one over its root.
    fn speedup(&self, path: &Self) -> Option<[f64; 2]> {
        let ([time, mse, mape], [path_time, path_mse, path_mape]) =
            (*self.curve.last()?, *path.curve.last()?);
        Some([
            path_mse * path_time / (mse * time),
            (path_mape / mape).powi(2) * path_time / time,
        ])
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if !(arguments.seconds > 0.0 && arguments.seconds.is_finite()) {
        return Err("--seconds must be positive".into());
    }
    std::fs::create_dir_all(&arguments.plots)?;
    let mut description = match builtin::by_name(&arguments.scene) {
        Some(description) => description,
        None => import::load(Path::new(&arguments.scene), &[])?.description,
    };
    let settings = &mut description.settings;
    (settings.width, settings.height) = (arguments.size[0], arguments.size[1]);
    settings.max_depth = arguments.max_depth.or(settings.max_depth);
    let fov_x = &mut description.camera.fov_x;
    *fov_x = 2.0 * ((0.5 * *fov_x).tan() / arguments.zoom).atan();
    let scene = Scene::new(&description)?;
    let reference = match &arguments.reference {
        Some(path) => {
            let image = read_exr(path)?;
            if [image.width(), image.height()] != arguments.size[..] {
                return Err("the reference is of another size".into());
            }
            let values: Vec<Rgb> = image.pixels().iter().map(|&value| Rgb::from(value)).collect();
            Reference::known(image_luminance(&values), 0.0)
        }
        None => Reference::new(&scene, arguments.reference_spp)?,
    };
    let (world, pixels) = (SceneWorld::new(&scene), reference.pixels());
    let restir = |options| RestirPt::new(&world, options, CameraMotion::STILL);
    let mut runners = vec![
        Runner::new("path", PlainFrames { scene: &scene }, pixels),
        Runner::new("path-reuse", PathReuse::new(&scene), pixels),
        Runner::new(
            "restir-pt-offline reconnection",
            restir(RestirPtOptions::offline(PathMapping::Reconnection))?,
            pixels,
        ),
        Runner::new(
            "restir-pt-offline hybrid",
            restir(RestirPtOptions::offline(PathMapping::Hybrid))?,
            pixels,
        ),
    ];
    for options in &arguments.setting {
        runners.push(Runner::new(name(options), restir(*options)?, pixels));
    }
    let (start, mut image) = (Instant::now(), vec![Rgb::ZERO; pixels]);
    while runners
        .iter()
        .any(|runner| runner.cpu_seconds < arguments.seconds)
    {
        for runner in runners
            .iter_mut()
            .filter(|runner| runner.cpu_seconds < arguments.seconds)
        {
            runner.step(&reference, &mut image, start);
        }
    }
    runners.iter_mut().for_each(|runner| runner.note(&reference));
    let chains = [PathMapping::Reconnection, PathMapping::Hybrid].map(|mapping| {
        let method = restir(RestirPtOptions::real_time(mapping))?;
        Ok::<_, Box<dyn Error>>(real_time(method, &scene, &reference, start))
    });
    let [reconnection, hybrid] = chains;
    let chains = [("reconnection", reconnection?), ("hybrid", hybrid?)];

    for (file, label, axis) in [("mse", "MSE of luminance", 1), ("mape", "MAPE of luminance", 2)] {
        let series = runners.iter().map(|runner| {
            let points = runner.curve.iter().map(|point| (point[0], point[axis]));
            (runner.name.clone(), points.collect())
        });
        let plot = Plot {
            title: format!("{}: run time against error", arguments.scene),
            x_label: "processor seconds",
            y_label: label,
            series: series.collect(),
        };
        std::fs::write(arguments.plots.join(format!("{file}.svg")), plot.svg())?;
    }
    let found: Vec<Value> = runners
        .iter()
        .map(|runner| {
            let speedup = runner.speedup(&runners[0]);
            json!({
                "method": runner.name,
                "frames": runner.frames,
                "curve": runner.curve,
                "speedup_mse": speedup.map(|s| s[0]),
                "speedup_mape": speedup.map(|s| s[1]),
            })
        })
        .collect();
    if arguments.json {
        let chains: Vec<Value> = chains.iter().map(|(name, chain)| chain.json(name)).collect();
        println!(
            "{}",
            json!({ "scene": arguments.scene, "size": arguments.size, "methods": found, "real_time": chains })
        );
    } else {
        for runner in &runners {
            let ([time, mse, mape], [by_mse, by_mape]) = (
                runner.curve.last().copied().unwrap_or_default(),
                runner.speedup(&runners[0]).unwrap_or_default(),
            );
            println!(
                "{:<44} {:5} frames {time:6.1} s  MSE {mse:.3e} ({by_mse:.2}x)  MAPE {mape:.4} ({by_mape:.2}x)",
                runner.name, runner.frames
            );
        }
        for (name, chain) in &chains {
            println!("{}", chain.text(name));
        }
        println!("plots in {}", arguments.plots.display());
    }
    Ok(())
}

/// Single frames of a chain, and path tracing in the time of one.
struct RealTime {
    cpu_seconds: f64,
    mse: f64,
    mape: f64,
    path_samples: u32,
    path_mse: f64,
    path_mape: f64,
}

impl RealTime {
    fn json(&self, shift: &str) -> Value {
        json!({
            "method": "restir-pt",
            "shift": shift,
            "cpu_seconds_per_frame": self.cpu_seconds,
            "mse": self.mse,
            "mape": self.mape,
            "path_samples": self.path_samples,
            "path_mse": self.path_mse,
            "path_mape": self.path_mape,
        })
    }

    fn text(&self, shift: &str) -> String {
        format!(
            "restir-pt {shift}: a frame {:.2} s  MSE {:.3e}  MAPE {:.4};  path tracing, {} samples  MSE {:.3e}  MAPE {:.4}: \
             MAPE {:+.0} %",
            self.cpu_seconds,
            self.mse,
            self.mape,
            self.path_samples,
            self.path_mse,
            self.path_mape,
            100.0 * (self.mape / self.path_mape - 1.0)
        )
    }
}

/// Frames to fill the history with, and frames that are judged.
const WARM: u32 = 20;
const JUDGED: u32 = 4;

fn real_time(mut method: impl FrameMethod, scene: &Scene, reference: &Reference, start: Instant) -> RealTime {
    let mut image = vec![Rgb::ZERO; reference.pixels()];
    let never = AtomicBool::new(false);
    let mut found = RealTime {
        cpu_seconds: 0.0,
        mse: 0.0,
        mape: 0.0,
        path_samples: 1,
        path_mse: 0.0,
        path_mape: 0.0,
    };
    for frame in 0..WARM + JUDGED {
        let before = clock(start);
        method.render_frame(frame, 21, &mut image, &never);
        if frame >= WARM {
            let values = image_luminance(&image);
            found.cpu_seconds += (clock(start) - before) / f64::from(JUDGED);
            found.mse += reference.mse(&values, 1) / f64::from(JUDGED);
            found.mape += reference.mape(&values, 1) / f64::from(JUDGED);
        }
    }
    let mut path = PlainFrames { scene };
    let before = clock(start);
    for frame in 0..4 {
        path.render_frame(frame, 1, &mut image, &never);
    }
    let sample_seconds = (clock(start) - before) / 4.0;
    found.path_samples = (found.cpu_seconds / sample_seconds).round().max(1.0) as u32;
    for repeat in 0..JUDGED {
        let mut sum = vec![0.0; image.len()];
        for sample in 0..found.path_samples {
            path.render_frame(repeat * found.path_samples + sample, 31, &mut image, &never);
            for (sum, value) in sum.iter_mut().zip(image_luminance(&image)) {
                *sum += value;
            }
        }
        found.path_mse += reference.mse(&sum, found.path_samples) / f64::from(JUDGED);
        found.path_mape += reference.mape(&sum, found.path_samples) / f64::from(JUDGED);
    }
    found
}
