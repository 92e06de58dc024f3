//! A thin CPU reference integrator, film and image metrics.

mod cpu_time;
mod direct;
mod film;
mod image;
mod metrics;
mod next_event;
mod output;
mod path;
mod render;
mod statistics;

pub use cpu_time::process_cpu_seconds;
pub use direct::{DirectLight, DirectLightError, MAX_DIRECT_SAMPLES};
pub use film::{Film, FilmSizeError, FilmTile, TILE_SIZE};
pub use image::{ImageError, MAX_PIXELS, RgbImage};
#[cfg(feature = "flip")]
pub use metrics::flip;
pub use metrics::{
    ImageComparison, MetricError, RELATIVE_MSE_EPSILON, SSIM_WINDOW, mean_absolute_percentage_error,
    mean_squared_error, relative_mean, relative_mean_squared_error, structural_similarity,
};
pub use output::{
    ExrError, ImageFormat, OutputError, OutputTarget, linear_to_srgb, read_exr, write_exr, write_png,
};
pub use path::PathTracer;
pub use render::{
    Budget, MAX_THREADS, PixelEstimator, Progress, RenderError, RenderOptions, RenderOutcome, render,
};
pub use statistics::PixelStatistics;
