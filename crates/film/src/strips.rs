//! The render loop for images whose rows are taken as soon as they are complete: in memory there is
//! a strip of the image and never a film of all.

use crate::PixelEstimator;
use crate::film::{Film, TILE_SIZE};
use crate::options::{Budget, RenderError, RenderOptions};
use crate::outcome::Progress;
use crate::process_cpu_seconds;
use crate::render::{Report, sample_tile, thread_pool};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Least tiles of a strip: 8 MB, which a processor's last cache holds.
const LEAST_TILES: u32 = 2048;

/// Least tiles of a strip for each thread: threads wait for the last tile of each strip.
const LEAST_TILES_OF_A_THREAD: u32 = 64;

/// Threads and memory for [`StripLoop::run`].
pub struct StripLoop {
    options: RenderOptions,
    samples: u32,
    rows: u32,
    pool: rayon::ThreadPool,
    film: Film,
}

/// Times of a rendering, without what was done with the rows.
#[derive(Clone, Copy, Debug)]
pub struct StripTimes {
    /// Wall time, seconds.
    pub seconds: f64,
    /// Processor time of the process, seconds.
    pub cpu_seconds: Option<f64>,
}

impl StripLoop {
    /// Starts threads for `samples` samples of every pixel; the options' budget does not count.
    ///
    /// # Errors
    ///
    /// As those of [`render()`](crate::render()).
    pub fn new(options: &RenderOptions, samples: u32) -> Result<Self, RenderError> {
        let options = RenderOptions {
            budget: Budget::Samples(samples),
            ..*options
        };
        options.check()?;
        let pool = thread_pool(&options)?;
        let threads = pool.current_num_threads() as u32;
        let tiles = LEAST_TILES.max(threads * LEAST_TILES_OF_A_THREAD);
        let bands = tiles.div_ceil(options.width.div_ceil(TILE_SIZE));
        let rows = options.height.min(bands.saturating_mul(TILE_SIZE));
        Ok(Self {
            options,
            samples,
            rows,
            pool,
            film: Film::new(options.width, rows).map_err(RenderError::Size)?,
        })
    }

    /// Renders strip after strip from the top, all samples of its pixels at once, and gives each to
    /// `take`: the film's rows and the number of its first row in the image. Every pixel has the
    /// bits that [`render()`](crate::render()) gives it. `None` if `cancel` ended it.
    ///
    /// # Errors
    ///
    /// Those of `take`, after which nothing more is rendered.
    pub fn run<E>(
        mut self,
        estimator: &dyn PixelEstimator,
        observer: &(dyn Fn(&Progress) + Sync),
        cancel: &AtomicBool,
        mut take: impl FnMut(u32, &Film) -> Result<(), E>,
    ) -> Result<Option<StripTimes>, E> {
        let options = &self.options;
        let report = Report::new(options, observer);
        let numbers = options.first..options.first + self.samples;
        let (start, cpu_before) = (Instant::now(), process_cpu_seconds());
        let mut taking = [0.0; 2];
        for top in (0..options.height).step_by(self.rows as usize) {
            let rows = self.rows.min(options.height - top);
            if rows < self.film.height() {
                self.film.cut(rows);
            }
            self.film.clear();
            let tiles = self.film.tiles_of_rows_from(top).into_par_iter().with_max_len(1);
            let whole = self.pool.install(|| {
                tiles.all(|mut tile| {
                    let pixels = u64::from(tile.width() * tile.height());
                    let whole = sample_tile(estimator, &mut tile, numbers.clone(), options.seed, cancel);
                    if whole {
                        report.tile_done(pixels * u64::from(self.samples));
                    }
                    whole
                })
            });
            if !whole {
                return Ok(None);
            }
            let before = (Instant::now(), process_cpu_seconds());
            take(top, &self.film)?;
            taking[0] += before.0.elapsed().as_secs_f64();
            taking[1] += since(before.1).unwrap_or_default();
        }
        Ok(Some(StripTimes {
            seconds: start.elapsed().as_secs_f64() - taking[0],
            cpu_seconds: since(cpu_before).map(|seconds| seconds - taking[1]),
        }))
    }
}

/// Processor time since an earlier reading.
fn since(before: Option<f64>) -> Option<f64> {
    Some(process_cpu_seconds()? - before?)
}
