//! Run time against error: path tracing, path reuse and ReSTIR path tracing on one scene, in one
//! run.
//!
//! ```text
//! cargo run --release --example restir_race -- cornell-glossy --seconds 20 --json
//! ```
//!
//! Methods take turns frame by frame until each has had its processor time; errors are those of the
//! luminance, at times that double, and speed-ups say how much longer path tracing would take. Of
//! the real-time chain single frames are judged, after 20 others, against as many path-traced
//! samples as fit into the time of one.

use clap::Parser;
use lightshed::film::{FrameMethod, SampledFrames, read_exr};
use lightshed::integrator::{
    CameraMotion, Neighbourhood, PathMapping, PathReuse, PathTracer, RestirPt, RestirPtOptions, SceneWorld,
};
use lightshed::scene::{Scene, builtin, import};
use lightshed_evaluate::{
    ContestOptions, Contestant, EvaluateError, Metric, Reference, SingleFrames, run as contest,
};
use serde_json::{Value, json};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

#[derive(Parser, Debug)]
#[command(about = "Run time against error of path tracing, path reuse and ReSTIR path tracing")]
struct Arguments {
    /// A built-in scene or a file.
    #[arg(default_value = "cornell-glossy")]
    scene: String,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
    /// Processor seconds for each method in each repeat.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Independent repeats, for intervals.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(2..))]
    repeats: u32,
    /// Image size.
    #[arg(long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, default_values_t = [128, 128])]
    size: Vec<u32>,
    /// Show the middle of an image so many times as wide and high: pixels that are neighbours then
    /// see places as close as they are in a large image.
    #[arg(long, default_value_t = 1.0, value_parser = zoom)]
    zoom: f32,
    /// Longest path in edges, instead of the scene's own.
    #[arg(long)]
    max_depth: Option<u32>,
    /// OpenEXR image of that size to compare with, or two independent ones of like precision, whose
    /// noise is then known; path-traced with --reference-spp where there is none.
    #[arg(long, num_args = 1..=2)]
    reference: Vec<PathBuf>,
    /// Setting of restir-pt-offline to race as well, hybrid: trees, rounds, neighbours of a disk (0
    /// for all of a square) and its radius in pixels, such as 16,3,12,10. May be repeated.
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
        ..RestirPtOptions::offline_published(PathMapping::Hybrid)
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

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
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
    let never = AtomicBool::new(false);
    let reference = match &arguments.reference[..] {
        [] => {
            let size = [arguments.size[0], arguments.size[1]];
            Reference::rendered(
                &PathTracer::new(&scene, scene.emitters_by_power()),
                size,
                arguments.reference_spp,
                &|_| (),
                &never,
            )?
        }
        [one] => Reference::stored(read_exr(one)?)?,
        [one, other] => Reference::of_halves([read_exr(one)?, read_exr(other)?])?,
        _ => return Err("a reference is one image, or two independent ones".into()),
    };
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let size = [arguments.size[0], arguments.size[1]];
    let plain = |samples| {
        let frames = SampledFrames::new(PathTracer::new(&scene, scene.emitters_by_power()), size, samples);
        Ok(Box::new(frames) as Box<dyn FrameMethod + '_>)
    };
    let shared =
        || Ok(Box::new(PathReuse::new(&scene, scene.emitters_by_power())) as Box<dyn FrameMethod + '_>);
    let mut contestants = vec![
        Contestant::new("path", || plain(SAMPLES)),
        Contestant::new("path-reuse", shared),
    ];
    let world = &world;
    let mut add = |name: String, options: RestirPtOptions| {
        let start = move || {
            let method = RestirPt::new(world, options, CameraMotion::STILL);
            let method = method.map_err(|error| EvaluateError::Contest(error.to_string()))?;
            Ok(Box::new(method) as Box<dyn FrameMethod + '_>)
        };
        contestants.push(Contestant::new(name, start));
    };
    for (name, mapping) in [
        ("reconnection", PathMapping::Reconnection),
        ("hybrid", PathMapping::Hybrid),
    ] {
        add(
            format!("restir-pt-offline {name}"),
            RestirPtOptions::offline(mapping),
        );
        add(
            format!("restir-pt-offline {name}, published"),
            RestirPtOptions::offline_published(mapping),
        );
    }
    for options in &arguments.setting {
        add(name(options), *options);
    }
    let options = ContestOptions {
        seconds: arguments.seconds,
        repeats: arguments.repeats,
        seed: 11,
    };
    let contested = contest(
        &arguments.scene,
        &contestants,
        &reference,
        options,
        None,
        &|_| (),
        &never,
    )?;
    let record = contested.record;
    let mut chains = Vec::new();
    for (name, mapping) in [
        ("reconnection", PathMapping::Reconnection),
        ("hybrid", PathMapping::Hybrid),
    ] {
        let mut method = RestirPt::new(world, RestirPtOptions::real_time(mapping), CameraMotion::STILL)?;
        chains.push((
            name,
            SingleFrames::run(&mut method, &plain, &reference, 21, &never)?,
        ));
    }

    for metric in Metric::ALL {
        let file = format!("{}.svg", metric.name().to_lowercase());
        std::fs::write(arguments.plots.join(file), record.plot(metric).svg())?;
    }
    if arguments.json {
        let chains: Vec<Value> = chains
            .iter()
            .map(|(name, single)| json!({ "shift": name, "single_frames": single }))
            .collect();
        let standings = record.standings();
        println!(
            "{}",
            json!({ "record": record, "standings": standings, "real_time": chains })
        );
    } else {
        for standing in record.standings() {
            print!("{:<44} {:6.0} frames", standing.name, standing.frames);
            for by_metric in &standing.by_metric {
                let error = by_metric
                    .error
                    .map_or("-".to_owned(), |error| format!("{:.3e}", error.mid));
                let speedup = by_metric.speedup.map_or("-".to_owned(), |speedup| {
                    format!("{:.2}x ({:.2}-{:.2})", speedup.mid, speedup.low, speedup.high)
                });
                print!("  {} {error} {speedup}", by_metric.metric.name());
            }
            println!();
        }
        for (name, single) in &chains {
            println!(
                "a frame of restir-pt {name} ({:.2} s): MAPE {:.4}; path tracing in that time ({} samples): {:.4}; {:+.0} %",
                single.seconds,
                single.errors.mape,
                single.plain_samples,
                single.plain_errors.mape,
                100.0 * (single.errors.mape / single.plain_errors.mape - 1.0)
            );
        }
        println!("plots in {}", arguments.plots.display());
    }
    Ok(())
}

/// Samples of a pixel in a frame of path tracing in the contest.
const SAMPLES: u32 = 4;
