//! Paths per CPU-second, by themselves or beside Mitsuba 3's path tracer in the same run.
//!
//! ```sh
//! cargo bench --bench throughput
//! cargo bench --bench throughput -- --compare python3
//! ```
//!
//! The second form needs a Python with Mitsuba 3 in it (`pip install mitsuba`), and for the variant `llvm_ad_rgb` an LLVM
//! library. It also needs scene files, in the folder that the environment variable `LIGHTSHED_SCENES` names; those that are
//! not there are left out. The two renderers take turns, with different seeds and the same number of threads, and what
//! counts is CPU-seconds of the process while it renders: loading, building and compiling are left out on both sides.

use clap::Parser;
use lightshed::integrator::{Budget, PathTracer, RenderOptions, render};
use lightshed::scene::{AcceleratorKind, BuildOptions, Scene, SceneDescription, builtin, import};
use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::AtomicBool;

#[derive(Parser)]
struct Options {
    /// Python interpreter with Mitsuba 3 to compare with.
    #[arg(long)]
    compare: Option<PathBuf>,
    /// Mitsuba's variant.
    #[arg(long, default_value = "llvm_ad_rgb")]
    variant: String,
    /// Turns of each renderer.
    #[arg(long, default_value_t = 5)]
    repeats: u32,
    /// Samples a pixel in each turn.
    #[arg(long, default_value_t = 64)]
    spp: u32,
    /// Tree to trace rays through: wide, bvh2 or cwbvh.
    #[arg(long, default_value = "wide")]
    tree: String,
    /// Given by cargo; of no meaning here.
    #[arg(long, hide = true)]
    bench: bool,
}

/// What is rendered: name, width, height, longest path in edges.
const CASES: [(&str, u32, u32, u32); 3] = [
    ("cornell", 256, 256, 8),
    ("sponza_crytek", 240, 135, 6),
    ("classroom", 240, 135, 6),
];

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let accelerator = match options.tree.as_str() {
        "wide" => AcceleratorKind::Wide,
        "bvh2" => AcceleratorKind::Bvh2,
        "cwbvh" => AcceleratorKind::Cwbvh,
        other => return Err(format!("no tree is called '{other}'").into()),
    };
    let folder = std::env::var_os("LIGHTSHED_SCENES").map(PathBuf::from);
    let mut mitsuba = match &options.compare {
        Some(python) => Some(Mitsuba::start(python, &options.variant)?),
        None => None,
    };
    println!(
        "M paths per CPU-second, median (least - greatest) of {} turns",
        options.repeats
    );
    for (name, width, height, max_depth) in CASES {
        let file = folder
            .as_ref()
            .map(|folder| folder.join(name).join("scene.xml"))
            .filter(|path| path.is_file());
        let Some(mut description) = describe(name, file.as_deref())? else {
            println!("{name:<14} SKIPPED: set LIGHTSHED_SCENES to the folder with the scene");
            continue;
        };
        (description.settings.width, description.settings.height) = (width, height);
        let scene = Scene::with_options(
            &description,
            BuildOptions {
                accelerator,
                ..BuildOptions::default()
            },
        )?;
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for turn in 0..options.repeats {
            ours.push(our_turn(&scene, max_depth, options.spp, u64::from(turn))?);
            if let (Some(mitsuba), Some(file)) = (&mut mitsuba, &file) {
                let size = (width, height);
                theirs.push(mitsuba.turn(file, size, max_depth, options.spp, turn + 1_000)?);
            }
        }
        let mut line = format!("{name:<14} lightshed {}", Spread::of(&ours));
        if !theirs.is_empty() {
            let ratios: Vec<f64> = ours
                .iter()
                .zip(&theirs)
                .map(|(ours, theirs)| ours / theirs)
                .collect();
            line += &format!(
                "   mitsuba {}   ratio {}",
                Spread::of(&theirs),
                Spread::of(&ratios)
            );
        }
        println!("{line}");
    }
    Ok(())
}

/// The scene in its file where there is one, else the built-in of that name.
fn describe(name: &str, file: Option<&Path>) -> Result<Option<SceneDescription>, Box<dyn Error>> {
    Ok(match file {
        Some(file) => Some(import::load(file, &[])?.description),
        None => builtin::by_name(name),
    })
}

/// Millions of paths per CPU-second.
fn our_turn(scene: &Scene, max_depth: u32, spp: u32, seed: u64) -> Result<f64, Box<dyn Error>> {
    let settings = scene.settings();
    let tracer = PathTracer::with_depths(scene, Some(max_depth), u32::MAX);
    let options = RenderOptions {
        seed,
        ..RenderOptions::new(settings.width, settings.height, Budget::Samples(spp))
    };
    let outcome = render(&tracer, &options, &|_| (), &AtomicBool::new(false))?;
    let seconds = outcome
        .cpu_seconds
        .ok_or("this platform does not tell a process its CPU time")?;
    Ok(outcome.film.samples() as f64 / seconds / 1e6)
}

/// Mitsuba in a process of its own, which renders when asked.
struct Mitsuba {
    process: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Mitsuba {
    fn start(python: &Path, variant: &str) -> Result<Self, Box<dyn Error>> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/mitsuba_throughput.py");
        let mut process = Command::new(python)
            .arg(script)
            .arg(variant)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("cannot start {}: {error}", python.display()))?;
        let requests = process.stdin.take().ok_or("no pipe to Python")?;
        let answers = BufReader::new(process.stdout.take().ok_or("no pipe from Python")?);
        Ok(Self {
            process,
            requests,
            answers,
        })
    }

    /// Millions of paths per CPU-second.
    fn turn(
        &mut self,
        scene: &Path,
        (width, height): (u32, u32),
        max_depth: u32,
        spp: u32,
        seed: u32,
    ) -> Result<f64, Box<dyn Error>> {
        writeln!(
            self.requests,
            "{} {width} {height} {max_depth} {spp} {seed}",
            scene.display()
        )?;
        self.requests.flush()?;
        let mut answer = String::new();
        self.answers.read_line(&mut answer)?;
        let figures: Vec<f64> = answer
            .split_whitespace()
            .map(str::parse)
            .collect::<Result<_, _>>()?;
        match figures[..] {
            [samples, seconds, ..] if seconds > 0.0 => Ok(samples / seconds / 1e6),
            _ => Err(format!("Mitsuba did not answer for {}", scene.display()).into()),
        }
    }
}

impl Drop for Mitsuba {
    fn drop(&mut self) {
        // It also ends by itself when its input does; nothing is lost if it has already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Median and extremes.
struct Spread([f64; 3]);

impl Spread {
    fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Self([sorted[sorted.len() / 2], sorted[0], sorted[sorted.len() - 1]])
    }
}

impl std::fmt::Display for Spread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [median, least, greatest] = self.0;
        write!(f, "{median:.3} ({least:.3} - {greatest:.3})")
    }
}
