//! What can be asked for.

use crate::moving::DenoiserKind;
use clap::Parser;
use lightshed::film::ShardPart;
use lightshed::integrator::{Method, MethodError, MethodRequest};
use lightshed_evaluate::TevViewer;
use std::path::PathBuf;

#[derive(Parser, Debug)]
#[command(about = "Rendering methods at equal time: errors, speed-ups and a page to look at")]
pub struct Arguments {
    /// A built-in scene or a file (Mitsuba 3, glTF, pbrt-v4), instead of the built-in comparison.
    #[arg(long)]
    pub scene: Option<String>,
    /// Methods, the baseline first, such as
    /// path,auto,path-reuse,restir-pt-offline:reconnection,direct:bvh.
    #[arg(long, value_delimiter = ',', value_parser = method, requires = "scene")]
    pub methods: Vec<MethodRequest>,
    /// Processor seconds for each method in each repeat.
    #[arg(long, default_value_t = 4.0)]
    pub seconds: f64,
    /// Independent repeats, for intervals.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(2..))]
    pub repeats: u32,
    /// Image size.
    #[arg(long, value_names = ["WIDTH", "HEIGHT"], num_args = 2, default_values_t = [128, 128])]
    pub size: Vec<u32>,
    /// Longest path in edges, instead of the scene's own.
    #[arg(long)]
    pub max_depth: Option<u32>,
    /// OpenEXR image to compare with, of that size; path-traced if not given.
    #[arg(long, requires = "scene")]
    pub reference: Option<PathBuf>,
    /// Samples a pixel of references; if not given, as many as bring their noise below a tenth of
    /// the least error.
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..))]
    pub reference_spp: Option<u32>,
    /// Samples a pixel beyond which references do not grow.
    #[arg(long, default_value_t = 16_384, conflicts_with = "reference_spp")]
    pub reference_limit: u32,
    /// Method of references; if not given, path tracing, by a tree of lights where there are many.
    #[arg(long)]
    pub reference_method: Option<Method>,
    /// Folder that keeps references for later runs.
    #[arg(long, default_value = "target/references")]
    pub references: PathBuf,
    /// Frames of a moving camera; 0 for none.
    #[arg(long, default_value_t = 16, value_parser = frames)]
    pub frames: u32,
    /// Processor seconds of such a frame; those of the dearest method that chains frames if not
    /// given.
    #[arg(long, value_parser = seconds)]
    pub frame_seconds: Option<f64>,
    /// Share of the scene's size by which the camera moves to the right from frame to frame.
    #[arg(long = "move", value_name = "SHARE", default_value_t = 0.005)]
    pub moves: f32,
    /// What filters these frames.
    #[arg(long, value_enum, default_value_t = DenoiserKind::Svgf)]
    pub denoiser: DenoiserKind,
    /// Other seeds, other noise.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Print JSON instead of tables.
    #[arg(long)]
    pub json: bool,
    /// Go on with what an interrupted comparison has left in the output folder.
    #[arg(long)]
    pub resume: bool,
    /// Does the I-th of N parts of the repeats of all scenes, counted from 0, and leaves its
    /// measurements in the output folder for --join.
    #[arg(long, value_name = "I/N", value_parser = part, conflicts_with_all = ["resume", "join"])]
    pub shard: Option<ShardPart>,
    /// Measures nothing, but joins what all parts have left in the output folder.
    #[arg(long, conflicts_with = "resume")]
    pub join: bool,
    /// Write the page every few seconds while it runs; an open page loads itself again.
    #[arg(long, conflicts_with_all = ["shard", "join"])]
    pub watch: bool,
    /// Show the images in a running tev viewer.
    #[arg(
        long,
        value_name = "HOST:PORT",
        num_args = 0..=1,
        default_missing_value = TevViewer::DEFAULT_ADDRESS,
        conflicts_with = "shard"
    )]
    pub tev: Option<String>,
    /// Output folder.
    #[arg(long, default_value = "target/compare")]
    pub out: PathBuf,
}

fn part(text: &str) -> Result<ShardPart, String> {
    text.parse()
        .map_err(|error: lightshed::film::ShardPartError| error.to_string())
}

fn method(text: &str) -> Result<MethodRequest, String> {
    text.parse().map_err(|error: MethodError| error.to_string())
}

fn frames(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(1) => Err("a sequence has two frames at least".to_owned()),
        Ok(frames) => Ok(frames),
        Err(_) => Err("not a number of frames".to_owned()),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("not a positive time".to_owned()),
    }
}
