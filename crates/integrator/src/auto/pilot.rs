//! A candidate's two images.

use super::gains::Gains;
use crate::path::reuse::PixelGain;
use crate::registry::{Method, MethodError, Motion, Stage, Started};
use lightshed_film::{
    Budget, RayCounts, RenderError, RenderOptions, RenderOutcome, RgbImage, render, render_frames,
};
use std::fmt::Display;
use std::sync::atomic::AtomicBool;

/// Two images of a candidate, made of as many frames each.
pub(super) struct Images {
    /// Frames of an image, or samples.
    pub frames: u32,
    /// Rays of both images; `None` of methods that do not count them.
    pub rays: Option<RayCounts>,
    /// Processor seconds of both, where the platform tells, or those of the clock.
    pub seconds: f64,
    /// Mean squared error of an image.
    pub error: f64,
    /// The pixels of both, row by row.
    pub means: [RgbImage; 2],
    /// What sharing brought a frame, of frames that share paths.
    pub gains: Option<Gains>,
    /// Connections of both images that no lanes can evaluate, of frames that share paths.
    pub alone: Option<u64>,
}

/// Seeds of the two images, apart from those that images are rendered with.
const SEEDS: [u64; 2] = [0x5bd1_e995_a1f0_73c4, 0x9e6c_63d0_26b4_1d8b];

/// Pixels with an error, from which on outliers among them show.
const FEW_PIXELS: usize = 16;

/// Side of the squares whose brightness relative errors refer to, in pixels.
const CELL: usize = 8;

/// Brightness that relative errors of darker squares refer to, as a share of the image's.
const DARKEST: f64 = 0.1;

/// Renders two images of `frames` frames or samples at the size of the stage's scene. `None` if it
/// was interrupted.
pub(super) fn images(
    stage: &Stage<'_>,
    method: &Method,
    frames: u32,
    threads: usize,
    cancel: &AtomicBool,
) -> Result<Option<Images>, MethodError> {
    // Independent frames are of the seed alone: both images are of one start.
    let Some(sharing) = method.start_path_reuse(stage)? else {
        let mut started = method.start(stage, Motion::STILL)?;
        let outcomes = both(stage, frames, threads, |options| {
            part(&mut started, method, options, cancel)
        })?;
        return Ok(outcomes.map(|outcomes| compared(frames, outcomes)));
    };
    let (mut sharing, mut gains) = (sharing.with_gains(), Vec::new());
    let outcomes = both(stage, frames, threads, |options| {
        let outcome = render_frames(&mut sharing, options, &|_| (), cancel);
        gains.push(sharing.take_gains());
        whole(outcome, method)
    })?;
    let gains: Option<[Vec<PixelGain>; 2]> = gains.try_into().ok();
    Ok(outcomes.map(|outcomes| Images {
        gains: gains.map(|gains| Gains::of(&gains, frames)),
        alone: Some(sharing.take_alone()),
        ..compared(frames, outcomes)
    }))
}

/// Renders with both seeds. `None` if one was interrupted.
fn both(
    stage: &Stage<'_>,
    frames: u32,
    threads: usize,
    mut render: impl FnMut(&RenderOptions) -> Result<Option<RenderOutcome>, MethodError>,
) -> Result<Option<[RenderOutcome; 2]>, MethodError> {
    let [one, other] = SEEDS.map(|seed| RenderOptions {
        seed,
        threads,
        ..options(stage, frames)
    });
    let Some(one) = render(&one)? else {
        return Ok(None);
    };
    Ok(render(&other)?.map(|other| [one, other]))
}

/// The same of a method whose frames follow from each other: two images of half of the frames, and
/// two of all.
pub(super) fn halves(
    stage: &Stage<'_>,
    method: &Method,
    frames: u32,
    threads: usize,
    cancel: &AtomicBool,
) -> Result<Option<[Images; 2]>, MethodError> {
    let half = (frames / 2).max(1);
    let (mut first, mut whole) = (Vec::new(), Vec::new());
    for seed in SEEDS {
        let mut started = method.start(stage, Motion::STILL)?;
        let mut both = Vec::new();
        for begin in [0, half] {
            let options = RenderOptions {
                seed,
                threads,
                first: begin,
                ..options(stage, half)
            };
            match part(&mut started, method, &options, cancel)? {
                Some(outcome) => both.push(outcome),
                None => return Ok(None),
            }
        }
        let (mut all, rest) = (both.remove(0), both.remove(0));
        first.push(all.clone());
        all.film
            .merge(&rest.film)
            .map_err(|error| refused(method, &error))?;
        all.rays = all.rays.zip(rest.rays).map(|(rays, others)| rays + others);
        all.seconds += rest.seconds;
        all.cpu_seconds = all.cpu_seconds.zip(rest.cpu_seconds).map(|(a, b)| a + b);
        whole.push(all);
    }
    let (first, whole): (Option<[_; 2]>, Option<[_; 2]>) = (first.try_into().ok(), whole.try_into().ok());
    let both = first.zip(whole);
    Ok(both.map(|(first, whole)| [compared(half, first), compared(2 * half, whole)]))
}

fn options(stage: &Stage<'_>, frames: u32) -> RenderOptions {
    let settings = stage.scene().settings();
    RenderOptions::new(settings.width, settings.height, Budget::Samples(frames))
}

fn refused(method: &Method, error: &dyn Display) -> MethodError {
    MethodError::Refused {
        method: method.name(),
        reason: error.to_string(),
    }
}

/// What is asked of a method that is ready; `None` if it was interrupted.
fn part(
    started: &mut Started<'_>,
    method: &Method,
    options: &RenderOptions,
    cancel: &AtomicBool,
) -> Result<Option<RenderOutcome>, MethodError> {
    let outcome: Result<RenderOutcome, RenderError> = match started {
        Started::Samples(estimator) => render(&*estimator, options, &|_| (), cancel),
        Started::Frames(method) => render_frames(method, options, &|_| (), cancel),
    };
    whole(outcome, method)
}

/// `None` of what was interrupted.
fn whole(
    outcome: Result<RenderOutcome, RenderError>,
    method: &Method,
) -> Result<Option<RenderOutcome>, MethodError> {
    let outcome = outcome.map_err(|error| refused(method, &error))?;
    Ok((!outcome.interrupted).then_some(outcome))
}

/// Errors of an image, by two.
fn compared(frames: u32, outcomes: [RenderOutcome; 2]) -> Images {
    let rays: Option<RayCounts> = outcomes.iter().map(|outcome| outcome.rays).sum::<Option<_>>();
    let seconds = outcomes.iter().map(|o| o.cpu_seconds.unwrap_or(o.seconds)).sum();
    let means = outcomes.map(|outcome| outcome.film.mean_image());
    Images {
        frames,
        rays: rays.filter(|rays| *rays != RayCounts::default()),
        seconds,
        gains: None,
        alone: None,
        error: errors(&means).sum::<f64>() / means[0].pixels().len().max(1) as f64,
        means,
    }
}

/// Squared error of each pixel.
fn errors(means: &[RgbImage; 2]) -> impl Iterator<Item = f64> {
    let pairs = means[0].pixels().iter().zip(means[1].pixels());
    pairs.map(|(a, b)| half_squared_difference(a, b))
}

/// Inverse squares of the brightness of each pixel's neighbourhood: what relative errors are
/// weighed with, the same for all candidates.
///
/// The brightness is the mean over squares of [`CELL`] pixels and over the images of these
/// candidates, each with the share that comes with it. A pixel's own value would hide what matters:
/// a bright outlier would weigh itself down, and where no image has found any light an error of
/// zero would count in full.
pub(super) fn weights<'i>(candidates: impl Iterator<Item = (&'i Images, f64)>, width: usize) -> Vec<f64> {
    let both = |(images, share): (&'i Images, f64)| images.means.each_ref().map(|mean| (mean, share));
    let images: Vec<(&RgbImage, f64)> = candidates.flat_map(both).collect();
    let pixels = images.first().map_or(0, |(image, _)| image.pixels().len());
    let shares: f64 = images.iter().map(|(_, share)| share).sum();
    let columns = width.div_ceil(CELL).max(1);
    let cell = |pixel: usize| pixel / width / CELL * columns + pixel % width / CELL;
    let mut cells: Vec<(f64, f64)> = Vec::new();
    for pixel in 0..pixels {
        let values = images.iter().map(|(image, share)| {
            let [r, g, b] = image.pixels()[pixel].map(f64::from);
            share * (r + g + b)
        });
        let (sum, count) = (values.sum::<f64>(), 3.0 * shares);
        let place = cell(pixel);
        if cells.len() <= place {
            cells.resize(place + 1, (0.0, 0.0));
        }
        cells[place].0 += sum;
        cells[place].1 += count;
    }
    let (sum, count) = cells.iter().fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    let least = (DARKEST * sum / f64::max(count, 1.0)).powi(2);
    let of = |(sum, count): (f64, f64)| 1.0 / ((sum / count).powi(2) + least).max(f64::MIN_POSITIVE);
    (0..pixels).map(|pixel| of(cells[cell(pixel)])).collect()
}

impl Images {
    /// Whether any pixel holds light.
    pub fn is_lit(&self) -> bool {
        let pixels = self.means.iter().flat_map(|mean| mean.pixels());
        pixels.flatten().any(|&value| value != 0.0)
    }

    /// Mean squared error with these weights.
    pub fn weighed(&self, weights: &[f64]) -> f64 {
        let errors = errors(&self.means).zip(weights);
        errors.map(|(e, w)| e * w).sum::<f64>() / weights.len().max(1) as f64
    }

    /// Whether enough pixels have an error for [`Images::certain`] to tell anything.
    pub fn shows_outliers(&self) -> bool {
        errors(&self.means).filter(|error| *error > 0.0).count() >= FEW_PIXELS
    }

    /// Of the error, what is left without one standard error of its own; of both errors, the
    /// geometric mean. Pixels of squares of `side` pixels have outliers in common, in an image of
    /// this width.
    pub fn certain(&self, weights: &[f64], width: usize, side: usize) -> f64 {
        let sums = |weight: &dyn Fn(usize) -> f64| {
            let mut sums = Vec::new();
            for (pixel, error) in errors(&self.means).enumerate() {
                let square = square(pixel, width, side);
                if sums.len() <= square {
                    sums.resize(square + 1, 0.0);
                }
                sums[square] += error * weight(pixel);
            }
            sums
        };
        let own = certain(&sums(&|_| 1.0));
        let weighed = certain(&sums(&|pixel| weights[pixel]));
        (own * weighed).sqrt()
    }

    /// The part of both errors that is not in the worst pixel of its square of `side` pixels, in an
    /// image of this width; the geometric mean. Paths that a square shares differ in many of its
    /// pixels, others in one.
    pub fn spread(&self, weights: &[f64], width: usize, side: usize) -> f64 {
        let spread = |weight: &dyn Fn(usize) -> f64| {
            let (mut all, mut worst) = (0.0, Vec::new());
            for (pixel, error) in errors(&self.means).enumerate() {
                let (square, error) = (square(pixel, width, side), error * weight(pixel));
                if worst.len() <= square {
                    worst.resize(square + 1, 0.0);
                }
                worst[square] = f64::max(worst[square], error);
                all += error;
            }
            let worst: f64 = worst.iter().sum();
            if all > 0.0 { 1.0 - worst / all } else { 1.0 }
        };
        (spread(&|_| 1.0) * spread(&|pixel| weights[pixel])).sqrt()
    }
}

/// The number of the square of `side` pixels that a pixel of an image of this width lies in.
fn square(pixel: usize, width: usize, side: usize) -> usize {
    pixel / width / side * width.div_ceil(side).max(1) + pixel % width / side
}

/// `(S₁ − √S₂) / S₁` of the values' sum and the sum of the squares of what they differ by from
/// their mean: the standard error of the sum.
pub(super) fn certain(values: &[f64]) -> f64 {
    let total: f64 = values.iter().sum();
    let mean = total / values.len().max(1) as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    if total > 0.0 && squares.is_finite() {
        (1.0 - squares.sqrt() / total).max(0.0)
    } else {
        1.0
    }
}

/// Half the mean squared difference of two independent values: the variance of one, in the mean.
fn half_squared_difference(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    let squares = a
        .iter()
        .zip(b)
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
    squares.sum::<f64>() / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 8×4 pixels in squares of 4: an error in one pixel of the first square, one in all of the
    /// second.
    fn two_squares(single: f32, all: f32) -> Images {
        let value = |x: u32, y: u32| {
            [if x >= 4 {
                all
            } else {
                single * f32::from(u8::from(x == 1 && y == 2))
            }; 3]
        };
        let image = |scale: f32| RgbImage::from_fn(8, 4, |x, y| value(x, y).map(|v| v * scale)).unwrap();
        Images {
            frames: 1,
            rays: None,
            seconds: 0.0,
            error: 0.0,
            means: [image(0.0), image(1.0)],
            gains: None,
            alone: None,
        }
    }

    /// What is in single pixels is not shared. Planted fault: the worst pixel of the image.
    #[test]
    fn outliers_of_single_pixels_are_told() {
        let spread = |single: f32, all: f32| two_squares(single, all).spread(&[1.0; 32], 8, 4);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
        close(spread(1.0, 0.0), 0.0);
        close(spread(0.0, 1.0), 15.0 / 16.0);
        // Errors of 16 and of 16 times 1: fifteen are beside the worst pixels of their squares.
        close(spread(4.0, 1.0), 15.0 / 32.0);
        close(spread(0.0, 0.0), 1.0);
    }

    /// The brightness that errors refer to is that of the images, each with its share.
    #[test]
    fn shares_weigh_brightness() {
        let [dark, bright] = [two_squares(0.0, 0.0), two_squares(0.0, 2.0)];
        let weights = |share: f64| weights([(&dark, share), (&bright, 3.0)].into_iter(), 8)[0];
        // Means of 3/4 and 3/8 in the cell, half of it in one of two images; a hundredth is added.
        let of = |mean: f64| 1.0 / (mean * mean * (1.0 + DARKEST * DARKEST));
        assert!((weights(1.0) / of(0.375) - 1.0).abs() < 1e-6);
        assert!((weights(9.0) / of(0.125) - 1.0).abs() < 1e-6);
    }

    /// Equal values hide no outlier; one that holds nearly all of the error is one.
    #[test]
    fn an_outlier_is_not_certain() {
        assert_eq!(certain(&[2.0; 4]), 1.0);
        let left = certain(&[1e6, 1.0, 1.0, 1.0]);
        assert!((0.0..0.2).contains(&left), "{left}");
        let body = [1.0; 100];
        let with_outlier: Vec<f64> = body.into_iter().chain([1e4]).collect();
        let left = certain(&with_outlier) * with_outlier.iter().sum::<f64>();
        assert!((99.0..250.0).contains(&left), "{left}");
        // Nothing is known of nothing.
        for values in [vec![], vec![0.0; 3], vec![1e200, 1e300], vec![f64::NAN]] {
            assert_eq!(certain(&values), 1.0);
        }
    }
}
