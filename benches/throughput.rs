//! Paths per CPU-second, by themselves or beside Mitsuba 3's path tracer in the same run.
//!
//! ```sh
//! cargo bench --bench throughput
//! cargo bench --bench throughput -- --compare python3
//! ```
//!
//! The second form needs a Python with Mitsuba 3 in it (`pip install mitsuba`), and for the variant
//! `llvm_ad_rgb` an LLVM library. It also needs scene files, in the folder that the environment
//! variable `LIGHTSHED_SCENES` names; those that are not there are left out. The two renderers take
//! turns, with different seeds and the same number of threads, and what counts is CPU-seconds of
//! the process while it renders: loading, building and compiling are left out on both sides.

#[path = "measure/cases.rs"]
mod cases;
#[path = "measure/turns.rs"]
mod turns;

use cases::{CASES, Case, describe, file};
use clap::Parser;
use lightshed::integrator::PathTracer;
use lightshed::scene::{AcceleratorKind, BuildOptions, Scene};
use std::error::Error;
use turns::{Spread, Turns, summary};

#[derive(Parser)]
struct Options {
    #[command(flatten)]
    turns: Turns,
    /// Tree to trace rays through: wide; with the feature `obvhs` bvh2 and cwbvh too.
    #[arg(long, default_value = "wide")]
    tree: String,
    /// Only the scene of this name.
    #[arg(long)]
    only: Option<String>,
    /// Given by cargo; of no meaning here.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let named = |(name, _): &&(&str, AcceleratorKind)| *name == options.tree;
    let Some(&(_, accelerator)) = AcceleratorKind::ALL.iter().find(named) else {
        let names: Vec<&str> = AcceleratorKind::ALL.iter().map(|(name, _)| *name).collect();
        return Err(format!(
            "no tree is called '{}'; there are {}",
            options.tree,
            names.join(", ")
        )
        .into());
    };
    let mut mitsuba = options.turns.start_mitsuba()?;
    println!(
        "M paths per CPU-second, median (least - greatest) of {} turns; mean; variance of a path",
        options.turns.repeats
    );
    let wanted = |case: &&Case| options.only.as_deref().is_none_or(|only| only == case.0);
    for &(name, width, height, max_depth) in CASES.iter().filter(wanted) {
        let file = file(name);
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
        let tracer =
            PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(max_depth), u32::MAX);
        let other = mitsuba.as_mut().zip(file.as_deref());
        let turns = options.turns.take(&tracer, scene.settings(), max_depth, other)?;
        let [ours, theirs] = &turns;
        println!("{name:<14} lightshed {}", summary(ours));
        if !theirs.is_empty() {
            println!("{:<14} mitsuba   {}", "", summary(theirs));
            println!("{:<14} ratio     {}", "", Spread::of_ratios(&turns));
        }
    }
    Ok(())
}
