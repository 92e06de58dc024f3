//! What the parameters of offline ReSTIR path tracing do at equal time: the exploration of Lin 2022
//! §B.7.
//!
//! ```text
//! cargo run --release --example restir_parameters -- --json
//! ```
//!
//! Each setting gets the same processor time, a frame at a time in turns, so that a busy machine
//! treats all alike. The error is that of the luminance against a path-traced reference, whose own
//! variance is subtracted.

mod measure;

use clap::Parser;
use lightshed::integrator::{Neighbourhood, PathMapping, PathTracer, RestirPtOptions};
use lightshed::scene::{Scene, builtin, import};
use lightshed_evaluate::{Axis, Plot, Reference};
use measure::{Measured, race};
use serde_json::json;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

#[derive(Parser, Debug)]
#[command(about = "Candidates, neighbours and rounds of ReSTIR path tracing against error at equal time")]
struct Arguments {
    /// A built-in scene or a file.
    #[arg(default_value = "cornell-glossy")]
    scene: String,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
    /// Processor seconds for each setting.
    #[arg(long, default_value_t = 1.5)]
    seconds: f64,
    /// Side of the image, in pixels.
    #[arg(long, default_value_t = 96, value_parser = clap::value_parser!(u32).range(8..=1024))]
    size: u32,
    /// Samples a pixel of the reference.
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(2..))]
    reference: u32,
    /// Folder for the plots.
    #[arg(long, default_value = "target/restir_parameters")]
    plots: PathBuf,
}

const CANDIDATES: [u32; 5] = [1, 4, 16, 32, 64];
const WINDOWS: [u32; 4] = [1, 2, 3, 4];
const ROUNDS: [u32; 3] = [1, 2, 3];
const NEIGHBOURS: [u32; 4] = [3, 6, 10, 20];
const RADII: [f32; 3] = [5.0, 10.0, 20.0];

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn describe(name: &str) -> Result<lightshed::scene::SceneDescription, Box<dyn Error>> {
    match builtin::by_name(name) {
        Some(description) => Ok(description),
        None => Ok(import::load(Path::new(name), &[])?.description),
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if !(arguments.seconds > 0.0 && arguments.seconds.is_finite()) {
        return Err("--seconds must be positive".into());
    }
    std::fs::create_dir_all(&arguments.plots)?;
    let mut description = describe(&arguments.scene)?;
    (description.settings.width, description.settings.height) = (arguments.size, arguments.size);
    let scene = Scene::new(&description)?;
    let never = AtomicBool::new(false);
    let reference = Reference::rendered(
        &PathTracer::new(&scene, scene.emitters_by_power()),
        [arguments.size; 2],
        arguments.reference,
        &|_| (),
        &never,
    )?;
    let base = RestirPtOptions::offline_published(PathMapping::Hybrid);
    let dense: Vec<RestirPtOptions> = CANDIDATES
        .iter()
        .flat_map(|&candidates| {
            WINDOWS.map(|radius| RestirPtOptions {
                candidates,
                rounds: 1,
                neighbourhood: Neighbourhood::Window { radius },
                ..base
            })
        })
        .collect();
    let sparse: Vec<RestirPtOptions> = ROUNDS
        .iter()
        .flat_map(|&rounds| NEIGHBOURS.map(|count| (rounds, count)))
        .flat_map(|(rounds, count)| {
            RADII.map(|radius| RestirPtOptions {
                rounds,
                neighbourhood: Neighbourhood::Disk { radius, count },
                ..base
            })
        })
        .collect();
    let mut settings = dense.clone();
    settings.extend(&sparse);
    let measured = race(&scene, &reference, &settings, arguments.seconds)?;
    let (dense_found, sparse_found) = measured[1..].split_at(dense.len());

    let windows = |series: &dyn Fn(&Measured) -> f64| -> Vec<(String, Vec<(f64, f64)>)> {
        let rows = CANDIDATES.iter().zip(dense_found.chunks(WINDOWS.len()));
        rows.map(|(candidates, row)| {
            let places = WINDOWS.map(|radius| f64::from((2 * radius + 1).pow(2)));
            let points = places.into_iter().zip(row.iter().map(series)).collect();
            (format!("{candidates} candidates"), points)
        })
        .collect()
    };
    let plots = [
        ("frame", "one frame", windows(&|m| m.mse * f64::from(m.frames))),
        ("equal_time", "equal time", windows(&|m| m.mse)),
    ];
    for (file, title, series) in plots {
        let plot = Plot {
            title: format!("{}: dense windows, {title}", arguments.scene),
            x: Axis::Logarithmic("pixels reused from"),
            y: Axis::Logarithmic("MSE of luminance"),
            series,
        };
        std::fs::write(arguments.plots.join(format!("dense_{file}.svg")), plot.svg())?;
    }
    let rounds = ROUNDS
        .iter()
        .zip(sparse_found.chunks(NEIGHBOURS.len() * RADII.len()));
    let plot = Plot {
        title: format!(
            "{}: sparse neighbours within 10 pixels, equal time",
            arguments.scene
        ),
        x: Axis::Logarithmic("neighbours in each round"),
        y: Axis::Logarithmic("MSE of luminance"),
        series: rounds
            .map(|(rounds, row)| {
                let at_ten = row.iter().skip(1).step_by(RADII.len());
                let points = NEIGHBOURS
                    .iter()
                    .map(|&n| f64::from(n))
                    .zip(at_ten.map(|m| m.mse));
                (format!("{rounds} rounds"), points.collect())
            })
            .collect(),
    };
    std::fs::write(arguments.plots.join("sparse_equal_time.svg"), plot.svg())?;

    let best = |found: &[Measured]| found.iter().min_by(|a, b| a.mse.total_cmp(&b.mse)).cloned();
    let (best_dense, best_sparse) = (best(dense_found), best(sparse_found));
    if arguments.json {
        let list = |found: &[Measured]| found.iter().map(Measured::json).collect::<Vec<_>>();
        println!(
            "{}",
            json!({
                "scene": arguments.scene,
                "size": arguments.size,
                "seconds": arguments.seconds,
                "path": measured[0].json(),
                "dense": list(dense_found),
                "sparse": list(sparse_found),
                "best_dense": best_dense.map(|m| m.json()),
                "best_sparse": best_sparse.map(|m| m.json()),
                "plots": arguments.plots,
            })
        );
    } else {
        for found in &measured {
            println!("{}", found.text());
        }
        for (name, found) in [("dense", best_dense), ("sparse", best_sparse)] {
            if let Some(found) = found {
                println!("best {name}: {}", found.text());
            }
        }
        println!("plots in {}", arguments.plots.display());
    }
    Ok(())
}
