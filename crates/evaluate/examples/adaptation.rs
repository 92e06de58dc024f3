//! How fast methods that remember follow a lamp that appears, jumps and turns off: error frame by
//! frame, and the frames until it is within a tenth of what it converges to.
//!
//! ```text
//! cargo run --release --example adaptation -- cornell --svg adaptation.svg
//! ```
//!
//! The scene's lamps are dimmed to a hundredth. After `--frames` frames a lamp of the power that
//! the largest one had and `--side` of its sides appears on the left, after as many it is on the
//! right, and after as many again it is off. Direct light alone: paths have two edges.
//!
//! - `mcmm` keeps its chains, and samples no emitters.
//! - `path --guide …` keeps its field, learns after each frame of four samples a pixel, and samples
//!   no emitters either (`LightChoosing::Unfound`), so all depends on the guide.
//! - `restir-di` has candidates by a light tree of the scene as it is now. It is told of the change
//!   and forgets its reservoirs (`RestirDi::change_scene`).
//! - `path` has no memory and no list of lights: what the others gain over.
//!
//! An error is the mean squared relative error of a single frame, its geometric mean over seeds.
//! The converged error is the geometric mean of the last quarter of a period. A period's number is
//! that of its first frame from which on three frames together are within a tenth of it.

use clap::Parser;
use lightshed::film::{FrameMethod, PixelEstimator, RgbImage, SampledFrames};
use lightshed::integrator::{
    FieldRecorder, GuideKind, GuidedPathsOptions, LightChoosing, LightSelection, Mixture, MixtureOptions,
    PathTracer, RestirDi, RestirDiSettings, SceneField,
};
use lightshed::scene::glam::Vec3;
use lightshed::scene::{Geometry, Rgb, Scene, SceneDescription, builtin};
use lightshed_evaluate::{Axis, Plot, Reference};
use serde_json::json;
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

#[derive(Parser, Debug)]
#[command(about = "Error over time after a lamp appears, jumps and turns off")]
struct Arguments {
    /// A built-in scene with a lamp of triangles.
    #[arg(default_value = "cornell")]
    scene: String,
    /// Image size.
    #[arg(long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, default_values_t = [64, 64])]
    size: Vec<u32>,
    /// Frames from one change to the next.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(8..))]
    frames: u32,
    /// Independent seeds.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..))]
    seeds: u64,
    /// Samples of a reference.
    #[arg(long, default_value_t = 1024)]
    reference_spp: u32,
    /// Side of the new lamp, relative to the largest one.
    #[arg(long, default_value_t = 0.3)]
    side: f32,
    /// Prints errors frame by frame as JSON instead of a table.
    #[arg(long)]
    json: bool,
    /// Draws errors over time.
    #[arg(long)]
    svg: Option<PathBuf>,
}

type Failure = Box<dyn Error>;

/// What a period is called, by what its beginning changes.
const PERIODS: [&str; 4] = ["start", "appears", "jumps", "turns off"];
/// What takes part.
const METHODS: [&str; 6] = [
    "mcmm",
    "path --guide mcmm",
    "path --guide mcmm-grid",
    "path --guide places",
    "restir-di:bvh",
    "path",
];
/// Factor of the scene's own lamps.
const DIMMED: f32 = 0.01;
/// Samples in each pixel of a frame of paths.
const SAMPLES: u32 = 4;

/// A scene for each period.
fn periods(arguments: &Arguments) -> Result<Vec<Scene>, Failure> {
    let mut description = builtin::by_name(&arguments.scene).ok_or("no such built-in scene")?;
    (description.settings.width, description.settings.height) = (arguments.size[0], arguments.size[1]);
    description.settings.max_depth = Some(2);
    let lamp = description.shapes.iter().find(|shape| shape.emission.is_some());
    let lamp = lamp.ok_or("no lamp of triangles")?.clone();
    for shape in &mut description.shapes {
        if let Some(emission) = &mut shape.emission {
            *emission *= DIMMED;
        }
    }
    let extent = Scene::new(&description)?.extent();
    let with_lamp_at = |offset: Vec3| -> Result<SceneDescription, Failure> {
        let mut changed = description.clone();
        let mut new = lamp.clone();
        let Geometry::Mesh(mesh) = &mut new.geometry else {
            return Err("the lamp is no mesh".into());
        };
        let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
        for position in &mut mesh.positions {
            *position = middle + offset + arguments.side * (*position - middle);
        }
        new.emission = new
            .emission
            .map(|emission| emission / (arguments.side * arguments.side));
        changed.shapes.push(new);
        Ok(changed)
    };
    let aside = Vec3::new(0.2, -0.08, 0.0) * extent;
    let across = Vec3::new(-aside.x, aside.y, aside.z);
    let descriptions = [
        description.clone(),
        with_lamp_at(aside)?,
        with_lamp_at(across)?,
        description.clone(),
    ];
    let scenes = descriptions.iter().map(Scene::new).collect::<Result<_, _>>()?;
    Ok(scenes)
}

/// A scene with what methods need of it.
struct Period<'a> {
    scene: &'a Scene,
    list: LightSelection<'a>,
    unfound: LightSelection<'a>,
    reference: Reference,
}

/// A method with its memory.
enum Runner<'a> {
    Mixture(Mixture<'a, &'a LightSelection<'a>>),
    Restir(RestirDi<'a, &'a LightSelection<'a>>),
    /// Paths with their field, and samples that only explore.
    Guided(SceneField, u32),
    Plain,
}

impl<'a> Runner<'a> {
    fn new(method: &str, first: &'a Period<'a>) -> Result<Self, Failure> {
        Ok(match method {
            "mcmm" => Self::Mixture(Mixture::new(
                first.scene,
                &first.unfound,
                MixtureOptions::default(),
            )?),
            "restir-di:bvh" => {
                let settings = RestirDiSettings::UNBIASED;
                Self::Restir(RestirDi::new(first.scene, &first.list, settings)?)
            }
            "path" => Self::Plain,
            guided => {
                let kind = guided.rsplit(' ').next().unwrap_or_default();
                let options = GuidedPathsOptions::new(kind.parse::<GuideKind>()?);
                Self::Guided(SceneField::new(first.scene, &options)?, options.exploring)
            }
        })
    }

    /// From now on frames are of another scene.
    fn change(&mut self, period: &'a Period<'a>) -> Result<(), Failure> {
        match self {
            Self::Mixture(mixture) => mixture.set_scene(period.scene, &period.unfound),
            Self::Restir(restir) => restir.change_scene(period.scene, &period.list)?,
            Self::Guided(..) | Self::Plain => (),
        }
        Ok(())
    }

    fn render(
        &mut self,
        period: &Period<'_>,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
    ) -> Result<(), Failure> {
        let never = AtomicBool::new(false);
        let settings = period.scene.settings();
        let paths = |tracer: &(dyn PixelEstimator + Send), samples, seed, image: &mut [Rgb]| {
            let size = [settings.width, settings.height];
            SampledFrames::new(tracer, size, samples).render_frame(frame, seed, image, &never)
        };
        let tracer = || PathTracer::new(period.scene, &period.unfound);
        let done = match self {
            Self::Mixture(mixture) => mixture.render_frame(frame, seed, image, &never),
            Self::Restir(restir) => restir.render_frame(frame, seed, image, &never),
            Self::Plain => paths(&tracer(), SAMPLES, seed, image),
            Self::Guided(field, exploring) => {
                let recorder = FieldRecorder::new(field, 1.0);
                let guided = tracer().with_guide(&*field).with_observer(recorder);
                let done = paths(&guided, SAMPLES, seed, image);
                if *exploring > 0 {
                    let explorer = tracer().with_observer(FieldRecorder::exploring(field));
                    let mut unused = vec![Rgb::ZERO; image.len()];
                    paths(&explorer, *exploring, seed ^ 1 << 63, &mut unused);
                }
                field.update()?;
                done
            }
        };
        done.map(|_| ()).ok_or_else(|| "interrupted".into())
    }
}

/// Geometric mean.
fn mean(values: &[f64]) -> f64 {
    (values.iter().map(|value| value.max(1e-12).ln()).sum::<f64>() / values.len() as f64).exp()
}

/// Errors of all frames of a method: geometric means over the seeds.
fn errors(arguments: &Arguments, method: &str, periods: &[Period<'_>]) -> Result<Vec<f64>, Failure> {
    let size = [arguments.size[0], arguments.size[1]];
    let mut logarithms = vec![0.0; periods.len() * arguments.frames as usize];
    for seed in 1..=arguments.seeds {
        let mut runner = Runner::new(method, &periods[0])?;
        let mut image = vec![Rgb::ZERO; size[0] as usize * size[1] as usize];
        let mut frame = 0;
        for period in periods {
            runner.change(period)?;
            for _ in 0..arguments.frames {
                runner.render(period, frame, seed, &mut image)?;
                let pixels = image.iter().map(|value| value.to_array()).collect();
                let shown = RgbImage::new(size[0], size[1], pixels)?;
                let error = period.reference.errors(&shown)?.rel_mse.max(1e-12);
                logarithms[frame as usize] += error.ln() / arguments.seeds as f64;
                frame += 1;
            }
        }
    }
    Ok(logarithms.into_iter().map(f64::exp).collect())
}

/// What the errors of a period converge to, and the first frame from which on three are within a
/// tenth of it.
fn adapted(errors: &[f64]) -> (f64, Option<usize>) {
    let converged = mean(&errors[errors.len() * 3 / 4..]);
    let within = |frames: &[f64]| mean(frames) <= 1.1 * converged;
    (converged, errors.windows(3).position(within))
}

fn study(arguments: &Arguments) -> Result<(), Failure> {
    let scenes = periods(arguments)?;
    let size = [arguments.size[0], arguments.size[1]];
    let never = AtomicBool::new(false);
    let periods = scenes
        .iter()
        .map(|scene| -> Result<_, Failure> {
            let list = LightSelection::new(scene, LightChoosing::Bvh)?;
            let tracer = PathTracer::new(scene, &list);
            let reference = Reference::rendered(&tracer, size, arguments.reference_spp, &|_| (), &never)?;
            Ok(Period {
                scene,
                unfound: LightSelection::new(scene, LightChoosing::Unfound)?,
                list,
                reference,
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    let mut curves = Vec::new();
    for method in METHODS {
        curves.push((method, errors(arguments, method, &periods)?));
    }
    if let Some(file) = &arguments.svg {
        let points = |errors: &[f64]| (0..).map(f64::from).zip(errors.iter().copied()).collect();
        let plot = Plot {
            title: format!("{}: a lamp appears, jumps, turns off", arguments.scene),
            x: Axis::Linear("frame"),
            y: Axis::Logarithmic("relative squared error of a frame"),
            series: curves
                .iter()
                .map(|(method, errors)| ((*method).to_owned(), points(errors)))
                .collect(),
        };
        std::fs::write(file, plot.svg())?;
    }
    let frames = arguments.frames as usize;
    if arguments.json {
        let rows = curves.iter().map(|(method, errors)| {
            let of_period = |errors: &[f64]| {
                let (converged, frames) = adapted(errors);
                json!({ "converged": converged, "frames": frames })
            };
            let periods: Vec<_> = errors.chunks(frames).map(of_period).collect();
            json!({ "method": method, "periods": periods, "errors": errors })
        });
        println!(
            "{}",
            json!({ "scene": arguments.scene, "methods": rows.collect::<Vec<_>>() })
        );
        return Ok(());
    }
    println!(
        "| method |{}",
        PERIODS.map(|period| format!(" {period} |")).concat()
    );
    println!("|---|{}", "---|".repeat(PERIODS.len()));
    for (method, errors) in &curves {
        let cells = errors.chunks(frames).map(|errors| {
            let (converged, frames) = adapted(errors);
            let frames = frames.map_or("never".to_owned(), |frames| frames.to_string());
            format!(" {frames} ({:.3} to {converged:.3}) |", errors[0])
        });
        println!("| `{method}` |{}", cells.collect::<String>());
    }
    Ok(())
}

fn main() -> ExitCode {
    match study(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("adaptation: {error}");
            ExitCode::FAILURE
        }
    }
}
