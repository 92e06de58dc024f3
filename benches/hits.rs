//! Nanoseconds a ray: nearest hits and shadow rays of path-traced streams, by themselves or beside
//! Intel's Embree in the same run, on one thread.
//!
//! ```sh
//! cargo bench --bench hits
//! cargo bench --bench hits -- --embree PATH/libembree4.so.4
//! ```
//!
//! Embree is a shared library of its own: a release of Embree 4 has it, and so has the Python wheel
//! `embreex` (`pip download embreex`, which is a ZIP file). Scene files are in the folder that the
//! environment variable `LIGHTSHED_SCENES` names; those that are not there are left out.
//!
//! All get the same rays, in the batches in which a path tracer asks for them, and take turns over
//! the whole stream. No packet of Embree's has rays of two batches. Only queries are timed, by CPU
//! time: rays are put into each one's own structures before, a thousand at a time, so that they are
//! in the cache. The share of rays with the same answer is told, too.
//!
//! Embree's scenes have high build quality. They are measured robust (no ray slips between two
//! triangles, which holds for ours) and fast (without flags).

#[path = "measure/cases.rs"]
mod cases;
#[path = "measure/contenders.rs"]
mod contenders;
#[path = "measure/embree.rs"]
mod embree;
#[path = "measure/ray_streams.rs"]
mod ray_streams;

use cases::{CASES, Case, describe, file};
use clap::Parser;
use contenders::{Contender, Query, alone, packets, together};
use embree::{Embree, EmbreeScene};
use lightshed::film::process_cpu_seconds;
use lightshed::scene::glam::Vec3;
use lightshed::scene::{Accelerator, Scene};
use ray_streams::{Batch, Paths, record};
use serde_json::{Value, json};
use std::error::Error;
use std::hint::black_box;
use std::path::PathBuf;

#[derive(Parser)]
struct Options {
    /// Scenes; all where none is named.
    scenes: Vec<String>,
    /// Embree's shared library to compare with.
    #[arg(long)]
    embree: Option<PathBuf>,
    /// Configuration of Embree's device.
    #[arg(long, default_value = "threads=1,hugepages=1")]
    configuration: String,
    /// Turns of each contender.
    #[arg(long, default_value_t = 15)]
    repeats: usize,
    /// About how many rays there are of a kind.
    #[arg(long, default_value_t = 200_000)]
    rays: usize,
    /// Samples a pixel.
    #[arg(long, default_value_t = 16)]
    spp: u32,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Given by cargo; of no meaning here.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Batches that are put into place before they are timed.
const CHUNK: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let named = |name: &String| CASES.iter().any(|case| case.0 == name);
    if let Some(unknown) = options.scenes.iter().find(|name| !named(name)) {
        let names = CASES.map(|case| case.0).join(", ");
        return Err(format!("no scene is called '{unknown}'; there are {names}").into());
    }
    let embree = match &options.embree {
        Some(file) => Some(Embree::open(file, &options.configuration)?),
        None => None,
    };
    if !options.json {
        if let Some(embree) = &embree {
            println!("Embree {}", embree.version()?);
        }
        println!(
            "ns a ray, median (quartiles) of {} turns; over ours together; same answers",
            options.repeats
        );
    }
    let mut all = Vec::new();
    let wanted = |case: &&Case| options.scenes.is_empty() || options.scenes.iter().any(|name| name == case.0);
    for &(name, width, height, max_depth) in CASES.iter().filter(wanted) {
        let file = file(name);
        let Some(mut description) = describe(name, file.as_deref())? else {
            eprintln!("{name:<14} SKIPPED: set LIGHTSHED_SCENES to the folder with the scene");
            continue;
        };
        (description.settings.width, description.settings.height) = (width, height);
        let scene = Scene::new(&description)?;
        let mut others = Vec::new();
        if let Some(embree) = &embree {
            let triangles = corners(name, &scene)?;
            for (flags, robust) in [("robust", true), ("fast", false)] {
                others.push((flags, embree.scene(&triangles, robust)?));
            }
        }
        let figures = measure(name, &scene, &others, &options, max_depth)?;
        if !options.json {
            figures.iter().for_each(|figure| println!("{}", line(figure)));
        }
        all.extend(figures);
    }
    if options.json {
        println!("{}", serde_json::to_string_pretty(&all)?);
    }
    Ok(())
}

/// Corners of all triangles.
///
/// # Errors
/// If there is anything else.
fn corners(name: &str, scene: &Scene) -> Result<Vec<[Vec3; 3]>, Box<dyn Error>> {
    if scene.sphere_count() + scene.instance_count() > 0 {
        return Err(format!("{name} is not of triangles alone").into());
    }
    Ok((0..scene.triangle_count() as u32)
        .map(|index| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|place| scene.locate(index, place).position))
        .collect())
}

/// CPU-seconds for the rays of a stream.
fn turn(contender: &mut dyn Contender, stream: &[Batch]) -> Result<f64, Box<dyn Error>> {
    let mut seconds = 0.0;
    for batches in stream.chunks(CHUNK) {
        contender.take(batches);
        let start = cpu_seconds()?;
        black_box(&mut *contender).answer();
        seconds += cpu_seconds()? - start;
    }
    Ok(seconds)
}

fn cpu_seconds() -> Result<f64, Box<dyn Error>> {
    process_cpu_seconds().ok_or_else(|| "this platform does not tell a process its CPU time".into())
}

/// All answers.
fn answers(contender: &mut dyn Contender, stream: &[Batch]) -> Vec<f32> {
    let mut distances = Vec::new();
    for batches in stream.chunks(CHUNK) {
        contender.take(batches);
        contender.answer();
        contender.tell(&mut distances);
    }
    distances
}

/// A contender and what it is called.
type Named<'a> = (String, Box<dyn Contender + 'a>);

/// Whom the rays of a kind are asked of: ours in batches first, which the others are compared with.
fn contenders<'a>(
    (kind, query): (&str, Query),
    tree: &'a Accelerator,
    embree: &'a [(&'static str, EmbreeScene<'a>)],
) -> Result<Vec<Named<'a>>, Box<dyn Error>> {
    let mut all = vec![
        ("lightshed, together".to_owned(), together(tree, query)),
        ("lightshed, alone".to_owned(), alone(tree, query)),
    ];
    for (flags, scene) in embree {
        let mut add = |how: &str, contender| all.push((format!("Embree {flags}, {how}"), contender));
        add("alone", packets::<1>(scene, query, false)?);
        add("8", packets::<8>(scene, query, false)?);
        add("16", packets::<16>(scene, query, false)?);
        // Rays in all directions take twice as long if they are announced as coherent.
        if kind == CAMERA {
            add("8 coherent", packets::<8>(scene, query, true)?);
            add("16 coherent", packets::<16>(scene, query, true)?);
        }
    }
    Ok(all)
}

/// The kind of rays that go the same way.
const CAMERA: &str = "camera";

/// All turns at a scene: figures of each contender.
fn measure(
    name: &str,
    scene: &Scene,
    embree: &[(&'static str, EmbreeScene<'_>)],
    options: &Options,
    max_depth: u32,
) -> Result<Vec<Value>, Box<dyn Error>> {
    let streams = record(
        scene,
        &Paths {
            max_depth,
            samples: options.spp,
            rays: options.rays,
        },
    );
    let mut figures = Vec::new();
    for (kind, query, batches) in [
        (CAMERA, Query::Nearest, &streams.camera),
        ("bounces", Query::Nearest, &streams.bounces),
        ("shadows", Query::Any, &streams.shadows),
    ] {
        let mut contenders = contenders((kind, query), scene.accelerator(), embree)?;
        let rays: usize = batches.iter().map(|batch| batch.count).sum();
        let mut told = Vec::new();
        for (_, contender) in &mut contenders {
            told.push(answers(&mut **contender, batches));
        }
        let mut times = vec![Vec::new(); contenders.len()];
        for number in 0..options.repeats {
            for place in 0..contenders.len() {
                let place = (place + number) % contenders.len();
                let seconds = turn(&mut *contenders[place].1, batches)?;
                times[place].push(seconds * 1e9 / rays as f64);
            }
        }
        for (((contender, _), own), answers) in contenders.iter().zip(&times).zip(&told) {
            let ratios = own.iter().zip(&times[0]).map(|(own, ours)| own / ours);
            figures.push(json!({
                "scene": name,
                "kind": kind,
                "contender": contender,
                "rays": rays,
                "batches": batches.len(),
                "nanoseconds": quartiles(own.iter().copied()),
                "ratio": quartiles(ratios),
                "agreement": agreement(&told[0], answers),
            }));
        }
    }
    Ok(figures)
}

/// Share of rays with the same answer: nothing, or a distance that is the same but for a
/// thousandth.
fn agreement(ours: &[f32], theirs: &[f32]) -> f64 {
    let same = |(a, b): &(&f32, &f32)| a == b || (**a - **b).abs() <= 1e-3 * a.abs();
    ours.iter().zip(theirs).filter(same).count() as f64 / ours.len().max(1) as f64
}

/// Lower quartile, median and upper quartile.
fn quartiles(values: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    [1, 2, 3].map(|quarter| sorted.get(last * quarter / 4).copied().unwrap_or(f64::NAN))
}

/// A figure as a line.
fn line(figure: &Value) -> String {
    let of = |name: &str| [0, 1, 2].map(|place| figure[name][place].as_f64().unwrap_or(f64::NAN));
    let ([low, time, high], [least, ratio, most]) = (of("nanoseconds"), of("ratio"));
    format!(
        "{:<14} {:<8} {:<27} {time:6.1} ({low:.1} - {high:.1}); {ratio:.2} ({least:.2} - {most:.2}); {:.3} %",
        figure["scene"].as_str().unwrap_or_default(),
        figure["kind"].as_str().unwrap_or_default(),
        figure["contender"].as_str().unwrap_or_default(),
        100.0 * figure["agreement"].as_f64().unwrap_or(f64::NAN),
    )
}
