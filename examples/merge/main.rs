//! Merges shards of images into images: the same bits whatever order the files are given in.
//!
//! ```text
//! cargo build --release --no-default-features --features film --example merge
//! merge image.shard-*.exr --out image.exr
//! ```
//!
//! Shards come from `render --shard`; a folder stands for all of them in it. Those of several
//! frames make several images, numbered. A shard that is damaged, truncated, of another image or
//! has samples in common with another one is refused, and so is a merge that lacks samples unless
//! `--allow-missing` is given. `--status` merges nothing and says what is there.
//!
//! The exit status is 0 if all went well, 1 if shards were refused or are missing, 2 if the command
//! line is wrong.

#[path = "../common/error_chain.rs"]
mod error_chain;
mod images;
mod report;
#[path = "../common/shard_files.rs"]
mod shard_files;
#[path = "../common/streams.rs"]
mod streams;

use clap::Parser;
use images::Images;
use std::path::PathBuf;
use std::process::ExitCode;
use streams::complain;

/// Merges shards of images into images.
#[derive(Debug, Parser)]
#[command(name = "merge")]
struct Arguments {
    /// Files of shards, or folders with files named as `render --shard` names them.
    #[arg(required = true, value_name = "FILE")]
    shards: Vec<PathBuf>,

    /// Image to write, .exr (linear) or .png (sRGB); of several frames image-0007.exr and so on.
    #[arg(long, value_name = "FILE", required_unless_present = "status")]
    out: Option<PathBuf>,

    /// Says what is there and what is missing, and merges nothing. Reads headers only.
    #[arg(long)]
    status: bool,

    /// Merges what is there though samples are missing, and says which.
    #[arg(long)]
    allow_missing: bool,

    /// Also writes the variance of each pixel's mean, as another OpenEXR image.
    #[arg(long, value_name = "FILE", requires = "out")]
    variance: Option<PathBuf>,

    /// Brightens a PNG by this many stops.
    #[arg(
        long,
        value_name = "STOPS",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    exposure: f32,

    /// Prints one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let images = match Images::open(&arguments.shards) {
        Ok(images) => images,
        Err(refusals) => {
            let refusals = refusals.iter();
            refusals.for_each(|refusal| complain(format_args!("error: {refusal}")));
            return ExitCode::FAILURE;
        }
    };
    let done = match arguments.status {
        true => images.status(arguments.json),
        false => images.merge(&arguments),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(refusal) => {
            complain(format_args!("error: {refusal}"));
            ExitCode::FAILURE
        }
    }
}
