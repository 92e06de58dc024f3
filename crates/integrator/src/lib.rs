//! A thin CPU reference integrator, film and image metrics.

mod cpu_time;
mod film;
mod image;
mod render;
mod statistics;

pub use cpu_time::process_cpu_seconds;
pub use film::{Film, FilmSizeError, FilmTile, TILE_SIZE};
pub use image::{ImageError, MAX_PIXELS, RgbImage};
pub use render::{
    Budget, MAX_THREADS, PixelEstimator, Progress, RenderError, RenderOptions, RenderOutcome, render,
};
pub use statistics::PixelStatistics;
