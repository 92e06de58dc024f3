//! Convergence of generalised resampling on one-dimensional functions: the experiments of Lin 2022
//! figs. 6.2, 6.6, 6.7 and 6.8a.
//!
//! ```text
//! cargo run --release --example gris_convergence -- --json
//! ```
//!
//! prints series and fitted slopes as JSON and draws them as SVG. `--check` fails unless they are
//! what the theory says; `--stress 100000000` streams that many items of weights over 24 decades
//! through reservoirs.

mod fit;
mod frames;
mod pixels;
mod stress;
mod window;

use clap::Parser;
use lightshed_evaluate::Plot;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Parser, Debug)]
#[command(about = "Convergence of generalised resampling on one-dimensional functions")]
struct Arguments {
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
    /// Fail unless every result is what the theory says.
    #[arg(long)]
    check: bool,
    /// Repetitions, as a factor on the default.
    #[arg(long, default_value_t = 1.0)]
    effort: f64,
    /// Folder for the plots.
    #[arg(long, default_value = "target/gris_convergence")]
    plots: PathBuf,
    /// Items of the stress test; 0 leaves it out.
    #[arg(long, default_value_t = 1_000_000)]
    stress: u64,
}

/// What an experiment found.
struct Outcome {
    name: &'static str,
    figure: &'static str,
    values: Value,
    plot: Option<Plot>,
    /// Each claim and whether it held.
    claims: Vec<(String, bool)>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if !(arguments.effort > 0.0 && arguments.effort <= 1000.0) {
        eprintln!("--effort must lie in (0, 1000]");
        return ExitCode::from(2);
    }
    if let Err(error) = std::fs::create_dir_all(&arguments.plots) {
        eprintln!("cannot create {}: {error}", arguments.plots.display());
        return ExitCode::FAILURE;
    }
    let mut outcomes = vec![
        window::fixed_window(arguments.effort),
        window::cost_at_equal_error(arguments.effort),
        frames::average_over_frames(arguments.effort),
        frames::error_of_frames(arguments.effort),
        window::growing_window(arguments.effort),
    ];
    if arguments.stress > 0 {
        outcomes.push(stress::stress(arguments.stress));
    }
    let mut report = serde_json::Map::new();
    for outcome in &outcomes {
        let claims: Vec<Value> = outcome
            .claims
            .iter()
            .map(|(claim, held)| json!({ "claim": claim, "held": held }))
            .collect();
        let mut entry = json!({ "figure": outcome.figure, "claims": claims, "values": outcome.values });
        if let Some(plot) = &outcome.plot {
            let path = arguments.plots.join(format!("{}.svg", outcome.name));
            if let Err(error) = std::fs::write(&path, plot.svg()) {
                eprintln!("cannot write {}: {error}", path.display());
                return ExitCode::FAILURE;
            }
            entry["plot"] = json!(path.display().to_string());
        }
        report.insert(outcome.name.into(), entry);
    }
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report).unwrap_or_default());
    } else {
        for outcome in &outcomes {
            println!("{} (Lin 2022 {})", outcome.name, outcome.figure);
            for (claim, held) in &outcome.claims {
                println!("  [{}] {claim}", if *held { "holds" } else { "FAILS" });
            }
        }
    }
    let failed = outcomes
        .iter()
        .flat_map(|outcome| &outcome.claims)
        .filter(|(_, held)| !held)
        .count();
    if arguments.check && failed > 0 {
        eprintln!("{failed} claims do not hold");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
