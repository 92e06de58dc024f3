//! Film, image files, image metrics and the two render loops. The crate knows no scene.
//!
//! | what | where |
//! |---|---|
//! | what the render loop asks of a method with independent pixels | [`PixelEstimator`], [`SampleId`] |
//! | the most samples that the loop asks for at once | [`MAX_BATCH`] |
//! | samples of every pixel until a budget is spent, on any number of threads | [`render`], [`RenderOptions`], [`RenderOutcome`] |
//! | whole frames, where pixels or frames reuse from each other | [`FrameMethod`], [`render_frames`] |
//! | frames of independent samples | [`SampledFrames`] |
//! | rays by kind, counted from many threads | [`RayCounts`], [`RayTally`] |
//! | processor time of the process | [`process_cpu_seconds`] |
//! | mean and variance of every pixel | [`Film`], [`PixelStatistics`] |
//! | linear images; OpenEXR and PNG files | [`RgbImage`], [`read_exr`], [`OutputTarget`] |
//! | parts of an image's samples in files, merged to the same bits in any order | [`Shard`], [`ShardSet`], [`merge_shards`] |
//! | samples of a part, rendered into its file | [`render_shard`] |
//! | how far an image is from a reference | [`ImageComparison`], [`mean_squared_error`], [`structural_similarity`], … |
//!
//! # Features
//!
//! - `flip`: the image metric ꟻLIP, which compiles C++.
#![forbid(unsafe_code)]

mod cpu_time;
mod estimator;
mod film;
mod frames;
mod image;
mod metrics;
mod options;
mod outcome;
mod output;
mod ray_counts;
mod ray_tally;
mod render;
mod sampled_frames;
mod shard;
mod statistics;
mod strips;

pub use cpu_time::process_cpu_seconds;
pub use estimator::{MAX_BATCH, PixelEstimator, SampleId};
pub use film::{Film, FilmSizeError, FilmTile, FilmTotals, TILE_SIZE};
pub use frames::{FrameMethod, render_frames};
pub use image::{ImageError, MAX_PIXELS, RgbImage};
pub use lightshed_sampling::Rgb;
#[cfg(feature = "flip")]
pub use metrics::flip;
pub use metrics::{
    ImageComparison, MetricError, RELATIVE_MSE_EPSILON, SSIM_WINDOW, mean_absolute_percentage_error,
    mean_squared_error, relative_mean, relative_mean_squared_error, structural_similarity,
};
pub use options::{Budget, MAX_THREADS, RenderError, RenderOptions};
pub use outcome::{Progress, RenderOutcome};
pub use output::{
    ExrError, ImageFormat, OutputError, OutputTarget, linear_to_srgb, read_exr, write_exr, write_png,
};
pub use ray_counts::RayCounts;
pub use ray_tally::{RayKind, RayTally};
pub use render::render;
pub use sampled_frames::SampledFrames;
pub use shard::{
    ImageKey, MissingSamples, RenderShardError, RenderedShard, Shard, ShardError, ShardFile, ShardHeader,
    ShardPart, ShardPartError, ShardSet, merge_shards, render_shard,
};
pub use statistics::PixelStatistics;

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/film.md")]
struct Guide;

/// The guide to shards is included, too.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/distribution.md")]
struct DistributionGuide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
