//! The render loop: samples of every pixel, distributed over threads, until a budget is spent.

use crate::estimator::{MAX_BATCH, PixelEstimator, SampleId};
use crate::film::{Film, FilmTile};
use crate::options::{Budget, RenderError, RenderOptions};
use crate::outcome::{Progress, RenderOutcome};
use crate::process_cpu_seconds;
use lightshed_sampling::Rgb;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

/// Target length of a pass, seconds: the most that an interruption loses, and the interval at which
/// threads meet.
const PASS_SECONDS: f64 = 0.25;

/// Renders: requests samples of every pixel from `estimator` until the budget is spent or `cancel`
/// is set.
///
/// Work is distributed in passes, a pass in tiles of [`TILE_SIZE`](crate::TILE_SIZE)². The first
/// pass takes one sample a pixel, and each later one as many as fit into a quarter of a second or
/// the rest of the budget. Samples are numbered from [`RenderOptions::first`] on. A pass counts as
/// a whole or not at all: samples of an interrupted one are discarded, so all pixels have the same
/// number. A pixel's samples are added in their order, so the film is the same, bit for bit, for
/// any number of threads and any lengths of passes. If only [all samples](RenderOptions::whole) are
/// of use, an interrupted pass discards those before it, too.
///
/// `observer` is called for every finished tile, from the thread that finished it.
///
/// # Errors
///
/// An invalid size, budget or number of threads, or threads that cannot be started. Nothing has
/// been rendered then.
///
/// # Example
///
/// ```
/// use lightshed_film::{Budget, PixelEstimator, RenderOptions, Rgb, render};
/// use std::sync::atomic::AtomicBool;
///
/// struct Ramp;
/// impl PixelEstimator for Ramp {
///     fn sample(&self, x: u32, y: u32, _: u32, _: u64) -> Rgb {
///         Rgb::new(x as f32, y as f32, 1.0)
///     }
/// }
///
/// let options = RenderOptions::new(16, 9, Budget::Samples(4));
/// let outcome = render(&Ramp, &options, &|_| (), &AtomicBool::new(false))?;
/// assert_eq!(outcome.film.mean_image().get(15, 8), Some([15.0, 8.0, 1.0]));
/// # Ok::<(), lightshed_film::RenderError>(())
/// ```
pub fn render<E: PixelEstimator>(
    estimator: &E,
    options: &RenderOptions,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<RenderOutcome, RenderError> {
    render_dyn(estimator, options, observer, cancel)
}

/// [`render()`], compiled once and not for every estimator. A virtual call is small beside the
/// batch of samples that it asks for.
fn render_dyn(
    estimator: &dyn PixelEstimator,
    options: &RenderOptions,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<RenderOutcome, RenderError> {
    options.check()?;
    let mut film = Film::new(options.width, options.height).map_err(RenderError::Size)?;
    let mut next = match options.whole {
        true => None,
        false => Some(Film::new(options.width, options.height).map_err(RenderError::Size)?),
    };
    let pool = thread_pool(options)?;

    let report = Report::new(options, observer);
    let cpu_before = process_cpu_seconds();
    let mut samples_per_pixel = 0;
    let mut seconds_per_sample = f64::INFINITY;
    while let Some(batch) = next_batch(options, samples_per_pixel, report.seconds(), seconds_per_sample) {
        let pass_start = Instant::now();
        let last = samples_per_pixel + batch;
        let numbers = options.first + samples_per_pixel..options.first + last;
        let sampled = |tile: &mut FilmTile<'_>| {
            let whole = sample_tile(estimator, tile, numbers.clone(), options.seed, cancel);
            if whole {
                report.tile_done(u64::from(tile.width() * tile.height()) * u64::from(batch));
            }
            whole
        };
        let tiles = film.tiles_mut().into_par_iter();
        let whole = pool.install(|| match &mut next {
            Some(next) => {
                let tiles = tiles.zip(next.tiles_mut()).with_max_len(1);
                tiles.all(|(before, mut tile)| {
                    tile.copy_from(&before);
                    sampled(&mut tile)
                })
            }
            None => tiles.with_max_len(1).all(|mut tile| sampled(&mut tile)),
        });
        if !whole {
            if next.is_none() {
                film.clear();
                samples_per_pixel = 0;
            }
            break;
        }
        if let Some(next) = &mut next {
            std::mem::swap(&mut film, next);
        }
        samples_per_pixel = last;
        seconds_per_sample = pass_start.elapsed().as_secs_f64() / f64::from(batch);
        if cancel.load(Ordering::Relaxed) {
            break;
        }
    }
    let seconds = report.seconds();
    let cpu_seconds = cpu_before.and_then(|before| Some(process_cpu_seconds()? - before));
    let interrupted = match options.budget {
        Budget::Samples(samples) => samples_per_pixel < samples,
        Budget::Seconds(_) => {
            cancel.load(Ordering::Relaxed)
                && next_batch(options, samples_per_pixel, seconds, seconds_per_sample).is_some()
        }
    };
    Ok(RenderOutcome {
        film,
        samples_per_pixel,
        seconds,
        cpu_seconds,
        interrupted,
        rays: None,
    })
}

/// Threads for a rendering.
pub(crate) fn thread_pool(options: &RenderOptions) -> Result<rayon::ThreadPool, RenderError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .map_err(RenderError::ThreadPool)
}

/// Samples a pixel of the next pass, or `None` if the budget is spent. `elapsed` is the time since
/// the start and `per_sample` that of one sample in every pixel, both in seconds.
fn next_batch(options: &RenderOptions, done: u32, elapsed: f64, per_sample: f64) -> Option<u32> {
    let budget = options.budget;
    let most = match budget {
        Budget::Samples(samples) => samples - done,
        Budget::Seconds(_) => u32::MAX - options.first - done,
    };
    if done == 0 || most == 0 {
        return (most > 0).then_some(1);
    }
    let pass = match budget {
        Budget::Samples(_) => PASS_SECONDS,
        Budget::Seconds(seconds) => {
            // Stopping half a sample early or late is as near as whole passes get.
            let left = seconds - elapsed;
            if left < 0.5 * per_sample {
                return None;
            }
            left.min(PASS_SECONDS)
        }
    };
    // The cast saturates: an immeasurably short pass takes all that is left.
    Some(((pass / per_sample) as u32).clamp(1, most))
}

/// Adds the samples of one pass to one tile; false if `cancel` was set before the end.
pub(crate) fn sample_tile(
    estimator: &dyn PixelEstimator,
    tile: &mut FilmTile<'_>,
    samples: std::ops::Range<u32>,
    seed: u64,
    cancel: &AtomicBool,
) -> bool {
    let mut pixels: Vec<_> = tile.pixels_mut().collect();
    let total = pixels.len() * samples.len();
    let mut ids = [SampleId::default(); MAX_BATCH];
    let mut values = [Rgb::ZERO; MAX_BATCH];
    // A batch finishes a pixel's samples before it starts the next pixel. Counted on, since
    // dividing costs as much as adding to the statistics does.
    let mut next = (0, samples.start);
    let step = |(pixel, index): &mut (usize, u32)| {
        *index += 1;
        if *index == samples.end {
            (*pixel, *index) = (*pixel + 1, samples.start);
        }
    };
    for start in (0..total).step_by(MAX_BATCH) {
        if cancel.load(Ordering::Relaxed) {
            return false;
        }
        let count = MAX_BATCH.min(total - start);
        let mut answered = next;
        for id in &mut ids[..count] {
            let (x, y, _) = pixels[next.0];
            *id = SampleId { x, y, index: next.1 };
            step(&mut next);
        }
        estimator.sample_many(&ids[..count], seed, &mut values[..count]);
        for value in &values[..count] {
            pixels[answered.0].2.add(*value);
            step(&mut answered);
        }
    }
    true
}

/// Counts finished samples and tells the observer.
pub(crate) struct Report<'a> {
    start: Instant,
    done: AtomicU64,
    total: Option<u64>,
    observer: &'a (dyn Fn(&Progress) + Sync),
}

impl<'a> Report<'a> {
    /// From now on.
    pub(crate) fn new(options: &RenderOptions, observer: &'a (dyn Fn(&Progress) + Sync)) -> Self {
        let pixels = u64::from(options.width) * u64::from(options.height);
        Self {
            start: Instant::now(),
            done: AtomicU64::new(0),
            total: match options.budget {
                Budget::Samples(samples) => Some(pixels * u64::from(samples)),
                Budget::Seconds(_) => None,
            },
            observer,
        }
    }

    fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// A tile has had `samples` samples more.
    pub(crate) fn tile_done(&self, samples: u64) {
        let samples_done = self.done.fetch_add(samples, Ordering::Relaxed) + samples;
        let (samples_total, seconds) = (self.total, self.seconds());
        (self.observer)(&Progress {
            samples_done,
            samples_total,
            seconds,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// A value in `[0, 1)` that hangs on all four arguments.
    fn hash(x: u32, y: u32, s: u32, seed: u64) -> f32 {
        let mut h = seed ^ (u64::from(x) << 40) ^ (u64::from(y) << 20) ^ u64::from(s);
        for _ in 0..2 {
            h = (h ^ (h >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
        (h >> 40) as f32 / (1 << 24) as f32
    }

    struct Noise;

    impl PixelEstimator for Noise {
        fn sample(&self, x: u32, y: u32, s: u32, seed: u64) -> Rgb {
            Rgb::new(
                hash(x, y, s, seed),
                hash(y, x, s, seed),
                f32::from(x.is_multiple_of(2)),
            )
        }
    }

    /// Sleeps, so that passes take time.
    struct Slow;

    impl PixelEstimator for Slow {
        fn sample(&self, x: u32, _: u32, s: u32, _: u64) -> Rgb {
            std::thread::sleep(std::time::Duration::from_millis(1));
            Rgb::new(x as f32, s as f32, 0.0)
        }
    }

    fn run(estimator: &impl PixelEstimator, options: &RenderOptions) -> RenderOutcome {
        render(estimator, options, &|_| (), &AtomicBool::new(false)).unwrap()
    }

    #[test]
    fn any_number_of_threads_gives_the_film_of_a_plain_loop() {
        let (width, height, seed) = (37, 21, 5);
        let mut expected = Film::new(width, height).unwrap();
        for s in 0..100 {
            for y in 0..height {
                (0..width).for_each(|x| expected.add(x, y, Noise.sample(x, y, s, seed)));
            }
        }
        for threads in [1, 2, 3, 7] {
            let options = RenderOptions {
                seed,
                threads,
                ..RenderOptions::new(width, height, Budget::Samples(100))
            };
            let outcome = run(&Noise, &options);
            assert_eq!(outcome.samples_per_pixel, 100);
            assert!(!outcome.interrupted);
            assert_eq!(outcome.film, expected, "{threads} threads");
        }
        // A run of another seed differs: the comparison can fail.
        let other = run(&Noise, &RenderOptions::new(width, height, Budget::Samples(100)));
        assert_ne!(other.film, expected);
    }

    /// Samples from a later one on are those that a whole rendering has there.
    #[test]
    fn samples_from_any_number_on_are_those_of_the_whole() {
        let mut expected = Film::new(19, 10).unwrap();
        for s in 30..53 {
            for y in 0..10 {
                (0..19).for_each(|x| expected.add(x, y, Noise.sample(x, y, s, 5)));
            }
        }
        let options = RenderOptions {
            first: 30,
            seed: 5,
            threads: 2,
            ..RenderOptions::new(19, 10, Budget::Samples(23))
        };
        let outcome = run(&Noise, &options);
        assert_eq!((outcome.samples_per_pixel, outcome.interrupted), (23, false));
        assert_eq!(outcome.film, expected);
    }

    #[test]
    fn a_time_budget_ends_near_its_time_with_equal_counts() {
        let options = RenderOptions {
            threads: 2,
            ..RenderOptions::new(16, 8, Budget::Seconds(0.6))
        };
        let outcome = run(&Slow, &options);
        assert!(!outcome.interrupted && outcome.samples_per_pixel >= 1);
        assert_eq!(
            outcome.film.samples(),
            16 * 8 * u64::from(outcome.samples_per_pixel)
        );
        for (x, y) in [(0, 0), (15, 7)] {
            assert_eq!(
                outcome.film.get(x, y).unwrap().count(),
                u64::from(outcome.samples_per_pixel)
            );
        }
        // A pass takes about 64 ms here and at least one is always run; a loaded machine may
        // stretch them.
        assert!(outcome.seconds > 0.3, "{} s", outcome.seconds);
        assert!(outcome.cpu_seconds.is_none_or(|cpu| cpu >= 0.0));
    }

    #[test]
    fn an_interrupted_pass_is_discarded() {
        const PIXELS: u64 = 32 * 16;
        let cancel = AtomicBool::new(false);
        // The first of the second pass's eight tiles interrupts it; no other thread can be through
        // with the rest.
        let observer = |progress: &Progress| {
            if progress.samples_done > PIXELS {
                cancel.store(true, Ordering::Relaxed);
            }
        };
        let options = RenderOptions {
            threads: 2,
            ..RenderOptions::new(32, 16, Budget::Samples(1_000))
        };
        let outcome = render(&Slow, &options, &observer, &cancel).unwrap();
        assert!(outcome.interrupted);
        assert_eq!((outcome.samples_per_pixel, outcome.film.samples()), (1, PIXELS));
        let options = RenderOptions {
            budget: Budget::Samples(1),
            ..options
        };
        assert_eq!(outcome.film, run(&Slow, &options).film);
    }

    /// With one film or with two; of one, nothing is left of an interruption.
    #[test]
    fn all_samples_or_none_are_those_of_a_plain_rendering() {
        let options = RenderOptions {
            threads: 2,
            ..RenderOptions::new(37, 21, Budget::Samples(30))
        };
        let whole = RenderOptions {
            whole: true,
            ..options
        };
        let (plain, found) = (run(&Noise, &options), run(&Noise, &whole));
        assert_eq!((found.samples_per_pixel, found.interrupted), (30, false));
        assert_eq!(found.film, plain.film);
        let cancel = AtomicBool::new(false);
        let observer = |progress: &Progress| {
            if progress.samples_done > 37 * 21 {
                cancel.store(true, Ordering::Relaxed);
            }
        };
        let slow = RenderOptions {
            budget: Budget::Samples(1_000),
            ..whole
        };
        let outcome = render(&Slow, &slow, &observer, &cancel).unwrap();
        assert!(outcome.interrupted && outcome.samples_per_pixel == 0);
        assert_eq!(outcome.film, Film::new(37, 21).unwrap());
    }

    #[test]
    fn cancelled_at_once_there_is_nothing() {
        let options = RenderOptions::new(4, 4, Budget::Samples(1));
        let outcome = render(&Noise, &options, &|_| (), &AtomicBool::new(true)).unwrap();
        assert!(outcome.interrupted);
        assert_eq!((outcome.samples_per_pixel, outcome.film.samples()), (0, 0));
    }

    #[test]
    fn progress_reaches_the_total() {
        let most = Mutex::new(0);
        let observer = |progress: &Progress| {
            assert_eq!(progress.samples_total, Some(20 * 20 * 10));
            let mut most = most.lock().unwrap();
            *most = progress.samples_done.max(*most);
        };
        let options = RenderOptions::new(20, 20, Budget::Samples(10));
        render(&Noise, &options, &observer, &AtomicBool::new(false)).unwrap();
        assert_eq!(*most.lock().unwrap(), 20 * 20 * 10);
    }

    #[test]
    fn batches_fill_passes_and_end_with_the_budget() {
        let next_batch = |budget, done, elapsed, per_sample| {
            super::next_batch(&RenderOptions::new(1, 1, budget), done, elapsed, per_sample)
        };
        let samples = Budget::Samples(100);
        assert_eq!(next_batch(samples, 0, 0.0, f64::INFINITY), Some(1));
        assert_eq!(next_batch(samples, 1, 1.0, 0.01), Some(25));
        assert_eq!(next_batch(samples, 90, 1.0, 0.01), Some(10));
        assert_eq!(next_batch(samples, 90, 1.0, 100.0), Some(1));
        assert_eq!(next_batch(samples, 90, 1.0, 0.0), Some(10));
        assert_eq!(next_batch(samples, 100, 1.0, 0.01), None);
        let seconds = Budget::Seconds(2.0);
        assert_eq!(next_batch(seconds, 0, 0.0, f64::INFINITY), Some(1));
        assert_eq!(next_batch(seconds, 1, 1.0, 0.01), Some(25));
        assert_eq!(next_batch(seconds, 1, 1.96, 0.01), Some(4));
        assert_eq!(next_batch(seconds, 1, 1.6, 0.7), Some(1));
        assert_eq!(next_batch(seconds, 1, 1.7, 0.7), None);
        assert_eq!(next_batch(seconds, 1, 2.1, 0.01), None);
    }

    #[test]
    fn impossible_options_are_errors() {
        let attempt = |options: RenderOptions| {
            assert!(render(&Noise, &options, &|_| (), &AtomicBool::new(false)).is_err());
            render(&Noise, &options, &|_| (), &AtomicBool::new(false))
                .unwrap_err()
                .to_string()
        };
        let sound = RenderOptions::new(4, 4, Budget::Samples(1));
        assert!(attempt(RenderOptions { width: 0, ..sound }).contains("0x4"));
        assert!(
            attempt(RenderOptions {
                budget: Budget::Samples(0),
                ..sound
            })
            .contains("0 samples")
        );
        assert!(
            attempt(RenderOptions {
                first: u32::MAX,
                ..sound
            })
            .contains("1 samples from number 4294967295 on")
        );
        for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let budget = Budget::Seconds(seconds);
            assert!(attempt(RenderOptions { budget, ..sound }).contains("not a positive time"));
        }
        assert!(
            attempt(RenderOptions {
                threads: 1_000_000,
                ..sound
            })
            .contains("1000000 threads")
        );
    }
}
