//! The render loop of methods that make whole frames, with reuse among pixels and from earlier
//! frames.

use crate::{
    Budget, Film, ImageError, Progress, RayCounts, RenderError, RenderOptions, RenderOutcome,
    process_cpu_seconds,
};
use lightshed_sampling::{Rgb, parallel};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A method whose pixels depend on each other: one frame after another, each an estimate of the
/// whole image.
///
/// For an unbiased method `E[image] = I` for every frame. Frames of a method with temporal reuse
/// are correlated, and so are pixels of a frame with spatial reuse: the variance that a [`Film`]
/// reports then is that of single frames, not of their mean.
pub trait FrameMethod: Send {
    /// Width and height of the frames, in pixels.
    fn size(&self) -> [u32; 2];

    /// Estimates frame number `frame`: `image[y · width + x]` becomes the value of pixel `(x, y)`.
    /// Called with 0, 1, 2, … in order (from [`RenderOptions::first`] on, for methods whose
    /// frames are independent), inside a thread pool on which it may distribute its work. The
    /// result must not depend on the number of threads. `None` if `cancel` was set before the frame
    /// was complete.
    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts>;

    /// Whether all frames show the same view, so that their mean estimates it.
    fn is_still(&self) -> bool {
        true
    }

    /// The method's own figures of the frames so far, by name: for example what it stored, or the
    /// length of its paths.
    fn figures(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }
}

impl<M: FrameMethod + ?Sized> FrameMethod for Box<M> {
    fn size(&self) -> [u32; 2] {
        (**self).size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        (**self).render_frame(frame, seed, image, cancel)
    }

    fn is_still(&self) -> bool {
        (**self).is_still()
    }

    fn figures(&self) -> Vec<(&'static str, f64)> {
        (**self).figures()
    }
}

/// Renders frames until the budget is spent ([`Budget::Samples`] counts frames) or `cancel` is set.
/// The film holds each frame as one sample of every pixel; for a method that is not
/// [still](FrameMethod::is_still), only the last frame.
///
/// A frame counts as a whole or not at all. `observer` is called for every finished frame. A frame
/// goes to the film while the next one is rendered, on the same threads, so there are two images.
///
/// # Errors
///
/// An invalid budget or number of threads, threads that cannot be started, or options of another
/// size than the method's. Nothing has been rendered then.
pub fn render_frames<M: FrameMethod>(
    method: &mut M,
    options: &RenderOptions,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<RenderOutcome, RenderError> {
    render_frames_dyn(method, options, observer, cancel)
}

/// [`render_frames`], compiled once and not for every method.
fn render_frames_dyn(
    method: &mut dyn FrameMethod,
    options: &RenderOptions,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<RenderOutcome, RenderError> {
    options.check()?;
    let (width, height) = (options.width, options.height);
    if method.size() != [width, height] {
        return Err(RenderError::OtherSize {
            method: method.size(),
            options: [width, height],
        });
    }
    let mut film = Film::new(width, height).map_err(RenderError::Size)?;
    // The frame that is rendered, and the one before, which meanwhile goes to the film.
    let mut image = blank(width, height)?;
    let mut before = blank(width, height)?;
    let pixels = image.len();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .map_err(RenderError::ThreadPool)?;

    let (start, cpu_before) = (Instant::now(), process_cpu_seconds());
    let (mut frames, mut rays) = (0, RayCounts::default());
    // Whether the frame before is the film's only one, if it has to go there.
    let mut waiting: Option<bool> = None;
    // Numbers end somewhere.
    let numbered = |frames: u32| options.first.checked_add(frames).is_some();
    while !spent(options.budget, frames, start.elapsed().as_secs_f64())
        && numbered(frames)
        && !cancel.load(Ordering::Relaxed)
    {
        let (film, before_it) = (&mut film, &before);
        let (counts, ()) = pool.install(|| {
            parallel::join(
                || method.render_frame(options.first + frames, options.seed, &mut image, cancel),
                || keep(film, before_it, waiting),
            )
        });
        waiting = None;
        let Some(counts) = counts else {
            break;
        };
        std::mem::swap(&mut image, &mut before);
        waiting = Some(!method.is_still());
        rays += counts;
        frames += 1;
        observer(&Progress {
            samples_done: u64::from(frames) * pixels as u64,
            samples_total: match options.budget {
                Budget::Samples(total) => Some(u64::from(total) * pixels as u64),
                Budget::Seconds(_) => None,
            },
            seconds: start.elapsed().as_secs_f64(),
        });
    }
    pool.install(|| keep(&mut film, &before, waiting));
    let seconds = start.elapsed().as_secs_f64();
    Ok(RenderOutcome {
        film,
        samples_per_pixel: frames,
        seconds,
        cpu_seconds: cpu_before.and_then(|before| Some(process_cpu_seconds()? - before)),
        interrupted: cancel.load(Ordering::Relaxed) && !spent(options.budget, frames, seconds),
        rays: Some(rays),
    })
}

/// A black image.
fn blank(width: u32, height: u32) -> Result<Vec<Rgb>, RenderError> {
    let pixels = width as usize * height as usize;
    let mut image = Vec::new();
    if image.try_reserve_exact(pixels).is_err() {
        return Err(RenderError::Size(ImageError::TooLarge { width, height }));
    }
    image.resize(pixels, Rgb::ZERO);
    Ok(image)
}

/// Adds a frame to the film, if it is waiting for that, or makes it the only one.
fn keep(film: &mut Film, image: &[Rgb], waiting: Option<bool>) {
    let Some(only) = waiting else { return };
    if only {
        film.clear();
    }
    film.add_image(image);
}

/// Whether the budget is spent after `frames` frames in `elapsed` seconds. Half a frame early is as
/// near as half a frame late.
fn spent(budget: Budget, frames: u32, elapsed: f64) -> bool {
    match budget {
        Budget::Samples(total) => frames >= total,
        Budget::Seconds(_) if frames == 0 => false,
        Budget::Seconds(seconds) => seconds - elapsed < 0.5 * elapsed / f64::from(frames),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frame `f` is `f + 1` everywhere, but `y` in the blue channel.
    struct Counter {
        first: u32,
        frames: u32,
        still: bool,
        cancel_at: Option<u32>,
    }

    impl FrameMethod for Counter {
        fn size(&self) -> [u32; 2] {
            [5, 3]
        }

        fn render_frame(
            &mut self,
            frame: u32,
            seed: u64,
            image: &mut [Rgb],
            cancel: &AtomicBool,
        ) -> Option<RayCounts> {
            assert_eq!((frame, seed), (self.first + self.frames, 9));
            self.frames += 1;
            if self.cancel_at == Some(frame) {
                cancel.store(true, Ordering::Relaxed);
                return None;
            }
            for (place, value) in image.iter_mut().enumerate() {
                *value = Rgb::new(frame as f32 + 1.0, 0.0, (place / 5) as f32);
            }
            Some(RayCounts {
                camera: 15,
                ..RayCounts::default()
            })
        }

        fn is_still(&self) -> bool {
            self.still
        }
    }

    fn run(still: bool, cancel_at: Option<u32>) -> RenderOutcome {
        let mut method = Counter {
            first: 0,
            frames: 0,
            still,
            cancel_at,
        };
        let options = RenderOptions {
            seed: 9,
            threads: 2,
            ..RenderOptions::new(5, 3, Budget::Samples(4))
        };
        render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false)).unwrap()
    }

    #[test]
    fn frames_are_averaged_or_the_last_is_kept() {
        let mean = run(true, None);
        assert_eq!(mean.film.mean_image().get(4, 2), Some([2.5, 0.0, 2.0]));
        assert_eq!((mean.samples_per_pixel, mean.interrupted), (4, false));
        assert_eq!(mean.rays.unwrap().camera, 60);
        let last = run(false, None);
        assert_eq!(last.film.mean_image().get(0, 1), Some([4.0, 0.0, 1.0]));
    }

    #[test]
    fn frames_are_numbered_from_the_first_asked_for() {
        let mut method = Counter {
            first: 40,
            frames: 0,
            still: true,
            cancel_at: None,
        };
        let options = RenderOptions {
            first: 40,
            seed: 9,
            ..RenderOptions::new(5, 3, Budget::Samples(3))
        };
        let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false)).unwrap();
        assert_eq!(outcome.film.mean_image().get(0, 0), Some([42.0, 0.0, 0.0]));
    }

    /// Frames of a size with tiles that are cut off at both edges, on several threads, against
    /// samples added pixel by pixel.
    #[test]
    fn the_film_is_that_of_single_samples() {
        struct Noise;
        fn value(frame: u32, place: usize) -> Rgb {
            match (frame as usize * 7919 + place * 104_729) % 1013 {
                0 => Rgb::NAN,
                bits => Rgb::new(bits as f32 * 0.37, 1.0 / bits as f32, place as f32),
            }
        }
        impl FrameMethod for Noise {
            fn size(&self) -> [u32; 2] {
                [45, 21]
            }
            fn render_frame(
                &mut self,
                frame: u32,
                _: u64,
                image: &mut [Rgb],
                _: &AtomicBool,
            ) -> Option<RayCounts> {
                for (place, pixel) in image.iter_mut().enumerate() {
                    *pixel = value(frame, place);
                }
                Some(RayCounts::default())
            }
        }
        let mut expected = Film::new(45, 21).unwrap();
        for frame in 0..5 {
            for place in 0..45 * 21 {
                expected.add(place as u32 % 45, place as u32 / 45, value(frame, place));
            }
        }
        assert!(expected.non_finite() > 0);
        for threads in [1, 3] {
            let options = RenderOptions {
                threads,
                ..RenderOptions::new(45, 21, Budget::Samples(5))
            };
            let outcome = render_frames(&mut Noise, &options, &|_| (), &AtomicBool::new(false)).unwrap();
            assert!(outcome.film == expected, "{threads} threads");
        }
    }

    #[test]
    fn an_interrupted_frame_is_discarded() {
        let outcome = run(true, Some(2));
        assert!(outcome.interrupted);
        assert_eq!(outcome.samples_per_pixel, 2);
        assert_eq!(outcome.film.mean_image().get(0, 0), Some([1.5, 0.0, 0.0]));
    }

    #[test]
    fn another_size_is_refused() {
        let mut method = Counter {
            first: 0,
            frames: 0,
            still: true,
            cancel_at: None,
        };
        let options = RenderOptions::new(5, 4, Budget::Samples(1));
        let error = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false)).unwrap_err();
        assert!(error.to_string().contains("5x3"), "{error}");
    }

    #[test]
    fn a_time_budget_ends_within_half_a_frame() {
        let budget = Budget::Seconds(1.0);
        assert!(!spent(budget, 0, 3.0));
        assert!(!spent(budget, 5, 0.85));
        assert!(spent(budget, 5, 0.95));
        assert!(spent(budget, 1, 0.7));
    }
}
