//! What features cost in scenes that lack them: instructions per sample of the whole library,
//! against builds without the code of one feature.
//!
//! `cargo bench -p lightshed-integrator --bench absent [FEATURE…]`. Needs `valgrind`, and builds
//! the workspace's crates once for each feature, with `--cfg lightshed_without="FEATURE"`.

use std::collections::HashMap;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Features, and methods with built-in scenes that lack them.
const FEATURES: [(&str, &[[&str; 2]]); 13] = [
    (
        "media",
        &[
            ["path", "cornell"],
            ["restir-pt", "cornell"],
            ["volpath", "cornell"],
        ],
    ),
    (
        "emission",
        &[
            ["volpath", "smoke-in-cornell"],
            ["restir-volume", "smoke-in-cornell"],
        ],
    ),
    (
        "specular",
        &[
            ["path", "cornell"],
            ["path", "cornell-glossy"],
            ["restir-pt", "cornell-glossy"],
        ],
    ),
    (
        "environment",
        &[
            ["path", "cornell"],
            ["path", "many-lights"],
            ["direct", "cornell"],
            ["restir-di", "many-lights"],
        ],
    ),
    (
        "light_tree",
        &[
            ["path", "cornell"],
            ["direct", "many-lights"],
            ["restir-di", "many-lights"],
            ["path-by-power", "cornell"],
            ["path-by-power", "many-lights"],
        ],
    ),
    (
        "guide",
        &[
            ["path", "cornell"],
            ["path", "cornell-glossy"],
            ["volpath", "smoke-in-cornell"],
            ["restir-pt", "cornell"],
        ],
    ),
    (
        "observer",
        &[["path", "cornell"], ["volpath", "smoke-in-cornell"]],
    ),
    ("ending", &[["path", "cornell"], ["path", "cornell-glossy"]]),
    ("replay", &[["restir-pt", "cornell"]]),
    (
        "motion",
        &[
            ["restir-di", "cornell"],
            ["restir-pt", "cornell"],
            ["restir-volume", "smoke-in-cornell"],
        ],
    ),
    ("lens", &[["path", "cornell"], ["restir-di", "cornell"]]),
    (
        "spheres",
        &[
            ["path", "cornell"],
            ["path", "many-lights"],
            ["restir-pt", "cornell-glossy"],
        ],
    ),
    (
        "instances",
        &[
            ["path", "many-lights"],
            ["path", "candles"],
            ["restir-pt", "cornell-glossy"],
        ],
    ),
];

/// Edge of the images in pixels.
const SIDE: u64 = 32;
/// Samples a pixel, or frames, of the two runs whose difference counts: what comes before the first
/// sample cancels.
const SAMPLES: [u64; 2] = [4, 20];
/// What a feature may cost where it is absent.
const LIMIT_PERCENT: f64 = 1.0;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| !argument.starts_with('-'))
        .collect();
    if let Some(unknown) = wanted
        .iter()
        .find(|name| FEATURES.iter().all(|(feature, _)| feature != name))
    {
        let names = FEATURES.map(|(feature, _)| feature).join(", ");
        return Err(format!("{unknown} is no feature ({names})").into());
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        eprintln!("SKIPPED: instructions are counted by valgrind, which is not installed");
        return Ok(ExitCode::SUCCESS);
    }
    let whole = build(None)?;
    let mut counted = HashMap::new();
    let mut within = true;
    println!("| absent | method | scene | instructions a sample | without its code | more |");
    println!("|---|---|---|---|---|---|");
    for (feature, cases) in FEATURES {
        if !wanted.is_empty() && !wanted.iter().any(|name| name == feature) {
            continue;
        }
        let lean = build(Some(feature))?;
        for &case in cases {
            let with = match counted.get(&case) {
                Some(&count) => count,
                None => instructions_per_sample(&whole, case)?,
            };
            counted.insert(case, with);
            let without = instructions_per_sample(&lean, case)?;
            let more = (with / without - 1.0) * 100.0;
            within &= more <= LIMIT_PERCENT;
            let [method, scene] = case;
            println!("| {feature} | `{method}` | `{scene}` | {with:.1} | {without:.1} | {more:+.2} % |");
        }
    }
    if !within {
        eprintln!("some features cost more than {LIMIT_PERCENT} % in scenes without them");
    }
    Ok(if within {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// The program `count_samples`, with the code of all features or of all but one.
fn build(without: Option<&str>) -> Result<PathBuf, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args([
            "build",
            "--quiet",
            "--release",
            "--package",
            env!("CARGO_PKG_NAME"),
        ])
        .args(["--features", "studies", "--example", "count_samples"])
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    if let Some(feature) = without {
        // Around the compiler for this workspace's crates alone, so that those of others are built
        // once.
        let wrapper = folder.join(format!("without_{feature}"));
        fs::write(
            &wrapper,
            format!("#!/bin/sh\nexec \"$@\" --cfg 'lightshed_without=\"{feature}\"'\n"),
        )?;
        let made = Command::new("chmod").arg("+x").arg(&wrapper).status()?;
        if !made.success() {
            return Err(format!("{} cannot be made executable", wrapper.display()).into());
        }
        cargo.env("RUSTC_WORKSPACE_WRAPPER", &wrapper);
    }
    if !cargo.status()?.success() {
        return Err(format!("the build without {} failed", without.unwrap_or("nothing")).into());
    }
    let target = folder.parent().ok_or("the target folder has no name")?;
    let program = folder.join(format!("count_samples_without_{}", without.unwrap_or("nothing")));
    fs::copy(target.join("release/examples/count_samples"), &program)?;
    Ok(program)
}

/// Instructions of a sample of one pixel.
fn instructions_per_sample(program: &Path, case: [&str; 2]) -> Result<f64, Box<dyn Error>> {
    let [few, many] = SAMPLES;
    let [less, more] = [
        instructions(program, case, few)?,
        instructions(program, case, many)?,
    ];
    Ok((more as f64 - less as f64) / (SIDE * SIDE * (many - few)) as f64)
}

/// Instructions of a run.
fn instructions(program: &Path, [method, scene]: [&str; 2], samples: u64) -> Result<u64, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args([method, scene, &SIDE.to_string(), &samples.to_string()])
        .output()?;
    let report = String::from_utf8_lossy(&output.stderr);
    let collected = report
        .lines()
        .find_map(|line| line.split_once("Collected : ")?.1.trim().parse().ok());
    match collected {
        Some(count) if output.status.success() => Ok(count),
        _ => Err(format!("{method} in {scene} could not be counted:\n{report}").into()),
    }
}
