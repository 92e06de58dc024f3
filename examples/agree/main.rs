//! Says how far the means of two methods are from each other, from independent shards of each.
//!
//! ```text
//! cargo build --release --no-default-features --features evaluate --example agree
//! agree path.shard-*.exr --against reuse.shard-*.exr --within 0.01
//! ```
//!
//! Shards come from `render --shard`, of any number of seeds; a folder stands for all in it. The
//! first method is the baseline. For each channel it prints the relative difference of the image's
//! mean, with its interval, and whether that lies within the tolerance; and which tile differs most
//! for its noise. Noise is told by the spread of shards, which are independent, and not by that of
//! pixels or frames, which need not be.
//!
//! The exit status is 0 if all channels agree or nothing was asked, 1 if shards were refused, 3 if
//! a channel differs, 4 if none differs but shards are too few to tell.

#[path = "../common/error_chain.rs"]
mod error_chain;
#[path = "../common/shard_files.rs"]
mod shard_files;
mod shards;
#[path = "../common/streams.rs"]
mod streams;

use clap::Parser;
use lightshed::evaluate::{AGREEMENT_CHANNELS, Agreement, RelativeInterval, ShardMeans, Verdict};
use serde_json::{Value, json};
use shards::Shards;
use std::path::PathBuf;
use std::process::ExitCode;
use streams::{complain, say};

/// Compares the means of two methods by their shards.
#[derive(Debug, Parser)]
#[command(name = "agree")]
struct Arguments {
    /// Shards of the baseline: files or folders.
    #[arg(required = true, value_name = "FILE")]
    baseline: Vec<PathBuf>,

    /// Shards of the other method.
    #[arg(long, required = true, num_args = 1.., value_name = "FILE")]
    against: Vec<PathBuf>,

    /// Relative tolerance in per cent: 0.01 asks whether means agree to one part in ten thousand.
    #[arg(long, value_name = "PERCENT")]
    within: Option<f64>,

    /// Probability with which intervals hold the truth.
    #[arg(long, value_name = "SHARE", default_value_t = 0.95, value_parser = share)]
    confidence: f64,

    /// Side of a tile in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..))]
    tile: u32,

    /// Makes the other method's values so much larger, to see whether a bias of that size would be
    /// found.
    #[arg(
        long,
        value_name = "PERCENT",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    plant: f64,

    /// Prints one JSON object, with all tiles, instead of text.
    #[arg(long)]
    json: bool,
}

fn share(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    let sound = share > 0.0 && share < 1.0;
    sound
        .then_some(share)
        .ok_or_else(|| "not between 0 and 1".to_owned())
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match agree(&arguments) {
        Ok(exit) => exit,
        Err(message) => {
            complain(format_args!("error: {message}"));
            ExitCode::FAILURE
        }
    }
}

fn agree(arguments: &Arguments) -> Result<ExitCode, String> {
    let [baseline, other] = [&arguments.baseline, &arguments.against].map(|paths| Shards::open(paths));
    let (baseline, other) = (baseline?, other?);
    baseline.check_against(&other)?;
    let means = |shards: &Shards| shards.means(arguments.tile);
    let (a, b) = (
        means(&baseline)?,
        means(&other)?.scaled(1.0 + 1e-2 * arguments.plant),
    );
    let agreement = a.compare(&b).map_err(|error| error.to_string())?;
    let intervals = agreement
        .whole
        .map(|channel| channel.relative(arguments.confidence));
    if arguments.json {
        say(as_json(
            arguments,
            [&baseline, &other],
            [&a, &b],
            &agreement,
            &intervals,
        ))
    } else {
        let compared = format!("{} against {}", describe(&other, &b), describe(&baseline, &a));
        let text = as_text(arguments, &agreement, &intervals);
        say(format_args!("{compared}\n{}", text.trim_end_matches('\n')))
    }
    .map_err(|error| error.to_string())?;
    let Some(within) = arguments.within else {
        return Ok(ExitCode::SUCCESS);
    };
    // A channel of which nothing can be said is black in both.
    let verdicts: Vec<Verdict> = intervals
        .iter()
        .flatten()
        .map(|interval| interval.verdict(1e-2 * within))
        .collect();
    let has = |verdict| verdicts.contains(&verdict);
    Ok(match (has(Verdict::Differs), has(Verdict::Undecided)) {
        (true, _) => ExitCode::from(3),
        (false, true) => ExitCode::from(4),
        (false, false) => ExitCode::SUCCESS,
    })
}

fn describe(shards: &Shards, means: &ShardMeans) -> String {
    format!(
        "{} ({} shards, {} samples)",
        shards.key().method,
        means.shards(),
        means.samples()
    )
}

fn as_text(
    arguments: &Arguments,
    agreement: &Agreement,
    intervals: &[Option<RelativeInterval>; 4],
) -> String {
    let mut text = String::new();
    for (name, interval) in AGREEMENT_CHANNELS.iter().zip(intervals) {
        let Some(interval) = interval else {
            text += &format!("{name:<10} nothing to compare\n");
            continue;
        };
        let [low, mid, high] = [interval.low, interval.mid, interval.high].map(|part| 100.0 * part);
        let verdict = arguments
            .within
            .map(|within| match interval.verdict(1e-2 * within) {
                Verdict::Agrees => format!(": agrees within {within} %"),
                Verdict::Differs => ": differs".to_owned(),
                Verdict::Undecided => format!(": undecided at {within} %"),
            });
        text += &format!(
            "{name:<10} {mid:+.4} % ({low:+.4} to {high:+.4}){}\n",
            verdict.unwrap_or_default()
        );
    }
    if let Some((tile, channel, p)) = agreement.worst_tile() {
        let difference = &tile.channels[channel];
        text += &format!(
            "of {} tiles the one at ({}, {}) differs most for its noise: {} by {:+.3} standard errors; by chance one of so many does in {:.0} % of all cases\n",
            agreement.tiles.len(),
            tile.x,
            tile.y,
            AGREEMENT_CHANNELS[channel],
            difference.difference / difference.standard_error,
            100.0 * p
        );
    }
    text
}

fn as_json(
    arguments: &Arguments,
    shards: [&Shards; 2],
    means: [&ShardMeans; 2],
    agreement: &Agreement,
    intervals: &[Option<RelativeInterval>; 4],
) -> Value {
    let method = |place: usize| {
        json!({
            "method": shards[place].key().method,
            "scene": shards[place].key().scene,
            "shards": means[place].shards(),
            "samples": means[place].samples(),
        })
    };
    let verdict =
        |interval: &RelativeInterval| arguments.within.map(|within| interval.verdict(1e-2 * within));
    let channels: Vec<Value> = AGREEMENT_CHANNELS
        .iter()
        .zip(intervals)
        .map(|(name, interval)| json!({"channel": name, "relative": interval, "verdict": interval.as_ref().and_then(verdict)}))
        .collect();
    let worst = agreement.worst_tile().map(|(tile, channel, p)| {
        json!({"x": tile.x, "y": tile.y, "channel": AGREEMENT_CHANNELS[channel], "p": p})
    });
    json!({
        "baseline": method(0),
        "against": method(1),
        "within_percent": arguments.within,
        "confidence": arguments.confidence,
        "channels": channels,
        "whole": agreement.whole,
        "worst_tile": worst,
        "tile": arguments.tile,
        "tiles": agreement.tiles,
    })
}
