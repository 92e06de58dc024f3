//! `lightshed-film`: films and metrics.

use crate::worst::{Kind, Row, Worst, log_uniform, rng, units};
use lightshed::film::{
    Film, ImageComparison, PixelStatistics, RELATIVE_MSE_EPSILON, RgbImage, linear_to_srgb,
    mean_absolute_percentage_error, mean_squared_error, relative_mean, relative_mean_squared_error,
    structural_similarity,
};
use lightshed::sampling::Rgb;

const PART: &str = "lightshed-film";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

pub fn rows() -> Vec<Row> {
    [moments(), metrics()].concat()
}

/// The mean and the unbiased variance of values around `offset`, in two passes over differences
/// from it.
fn two_passes(values: &[f32], offset: f64) -> (f64, f64) {
    let n = values.len() as f64;
    let shifted = |&x: &f32| f64::from(x) - offset;
    let mean = values.iter().map(shifted).sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (shifted(x) - mean).powi(2)).sum();
    (offset + mean, squares / (n - 1.0))
}

/// Samples of one pixel: over 60 decades, all about one large number, or all equal.
fn samples(salt: u32) -> Vec<Vec<f32>> {
    let mut rng = rng(salt);
    let mut sets = vec![vec![1e30; 1000], vec![f32::MIN_POSITIVE; 1000], vec![0.0; 1000]];
    for (base, spread) in [
        (0.0, 1.0),
        (1e6, 1.0),
        (1e30, 1e25),
        (-1e30, 1e24),
        (0.0, 1e-30),
        (0.0, 1e30),
    ] {
        sets.push(
            (0..2000)
                .map(|_| base + spread * (rng.next_f32() - 0.5))
                .collect(),
        );
    }
    sets.push((0..2000).map(|_| log_uniform(&mut rng, 1e-30, 1e30)).collect());
    sets
}

fn moments() -> Vec<Row> {
    const SETS: &str = "2,000 samples over 60 decades, about 10⁶ ± 1, about 10³⁰, equal";
    // Added one by one, and as two halves that are merged.
    let statistics = |values: &[f32]| {
        let of = |values: &[f32]| {
            let mut statistics = PixelStatistics::default();
            values.iter().for_each(|&x| statistics.add(Rgb::splat(x)));
            statistics
        };
        let (a, b) = values.split_at(values.len() / 3);
        let mut merged = of(a);
        merged.merge(&of(b));
        [of(values), merged]
    };
    vec![
        worst("PixelStatistics::mean", SETS, Kind::Relative, |w| {
            for values in samples(140) {
                let (mean, _) = two_passes(&values, f64::from(values[0]));
                for found in statistics(&values) {
                    w.add(
                        found.mean()[0],
                        if mean.abs() > 1e-2 * f64::from(values[0].abs()) {
                            mean
                        } else {
                            found.mean()[0]
                        },
                    );
                }
            }
        }),
        worst("PixelStatistics::variance", SETS, Kind::Relative, |w| {
            for values in samples(140) {
                let (_, variance) = two_passes(&values, f64::from(values[0]));
                for found in statistics(&values) {
                    let found = found.variance().expect("there are many")[0];
                    // Beyond the range of `f32` as well.
                    w.add(
                        if variance > 0.0 {
                            found / variance
                        } else {
                            1.0 + found
                        },
                        1.0,
                    );
                }
            }
        }),
        worst(
            "PixelStatistics::variance_of_mean",
            "2,000 samples over 60 decades, about 10⁶ ± 1, about 10³⁰, equal: over the variance",
            Kind::Relative,
            |w| {
                for values in samples(141) {
                    for found in statistics(&values) {
                        let variance = found.variance().expect("there are many")[1];
                        let of_mean = found.variance_of_mean().expect("there are many")[1];
                        w.add(
                            of_mean * found.count() as f64 / variance.max(1e-300),
                            (variance > 0.0).into(),
                        );
                    }
                }
                let mut none = PixelStatistics::default();
                for sample in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1.0] {
                    none.add(Rgb::splat(sample));
                }
                w.exactly(none.non_finite() == 3 && none.mean() == [1.0; 3] && none.variance().is_none());
            },
        ),
        worst(
            "Film::mean_image",
            "a pixel for each of the sets, one without samples; `Film::variance_of_mean` within `f32`",
            Kind::Relative,
            |w| {
                let sets = samples(142);
                let mut film = Film::new(sets.len() as u32, 1).expect("the size is one");
                for (x, set) in sets.iter().enumerate() {
                    set.iter()
                        .for_each(|&value| film.add(x as u32, 0, Rgb::splat(value)));
                }
                let (image, noise) = (
                    film.mean_image(),
                    film.variance_of_mean().expect("there are many"),
                );
                for (x, set) in sets.iter().enumerate() {
                    let (mean, variance) = two_passes(set, f64::from(set[0]));
                    let [found, noise] =
                        [&image, &noise].map(|i| f64::from(i.get(x as u32, 0).expect("it is there")[1]));
                    if mean.abs() > 1e-2 * f64::from(set[0].abs()) {
                        w.add(found, mean);
                    }
                    w.add(noise, variance / set.len() as f64);
                    w.exactly(noise >= 0.0);
                }
                film = Film::new(3, 2).expect("the size is one");
                w.exactly(
                    film.mean_image().pixels().iter().all(|p| *p == [0.0; 3])
                        && film.variance_of_mean().is_none(),
                );
            },
        ),
    ]
}

/// Pairs of images: over 60 decades, of the largest numbers there are, nearly equal, of negative
/// numbers.
fn images(salt: u32) -> Vec<[RgbImage; 2]> {
    let mut rng = rng(salt);
    let of = |pixel: &mut dyn FnMut(u32, u32) -> [f32; 3]| {
        RgbImage::from_fn(16, 12, pixel).expect("pixels are finite")
    };
    let mut image = |low: f64, high: f64, sign: bool| {
        of(&mut |_, _| {
            [0; 3].map(|_| {
                let x = log_uniform(&mut rng, low, high);
                if sign && rng.next_f32() < 0.3 { -x } else { x }
            })
        })
    };
    let constant = |x: f32| of(&mut |_, _| [x; 3]);
    let near = image(0.5, 2.0, false);
    let beside = of(&mut |x, y| near.get(x, y).expect("it is inside").map(|v| v * (1.0 + 1e-6)));
    vec![
        [image(1e-3, 1e3, false), image(1e-3, 1e3, false)],
        [image(1e-30, 1e30, true), image(1e-30, 1e30, true)],
        [image(1e30, 3e38, false), image(1e30, 3e38, true)],
        [image(1e-44, 1e-38, false), image(1e-44, 1e-38, false)],
        [near, beside],
        [constant(f32::MAX), constant(f32::MIN)],
        [constant(0.0), constant(0.0)],
        [constant(f32::MIN_POSITIVE), constant(0.0)],
    ]
}

fn pairs(images: &[RgbImage; 2]) -> impl Iterator<Item = (f64, f64)> {
    let [a, b] = images;
    a.pixels()
        .iter()
        .flatten()
        .zip(b.pixels().iter().flatten())
        .map(|(&a, &b)| (f64::from(a), f64::from(b)))
}

/// Kahan's sum, over the number of terms.
fn mean(terms: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut lost, mut count) = (0.0f64, 0.0, 0.0);
    for term in terms {
        let (term, before) = (term - lost, sum);
        sum += term;
        lost = (sum - before) - term;
        count += 1.0;
    }
    sum / count
}

const IMAGES: &str =
    "images over 60 decades, of the largest and least numbers, negative, nearly equal, black";

fn metrics() -> Vec<Row> {
    let y = |p: &[f32; 3]| {
        0.212_671 * f64::from(p[0]) + 0.715_160 * f64::from(p[1]) + 0.072_169 * f64::from(p[2])
    };
    // Ratios, since squares of `f32` are beyond its range.
    let ratio = |w: &mut Worst, found: f64, truth: f64| {
        w.add(if truth > 0.0 { found / truth } else { 1.0 + found }, 1.0);
    };
    vec![
        worst("mean_squared_error", IMAGES, Kind::Relative, |w| {
            for images in images(150) {
                let found = mean_squared_error(&images[0], &images[1]).expect("sizes are equal");
                ratio(w, found, mean(pairs(&images).map(|(a, b)| (a - b).powi(2))));
            }
        }),
        worst("relative_mean_squared_error", IMAGES, Kind::Relative, |w| {
            for images in images(151) {
                let found = relative_mean_squared_error(&images[0], &images[1]).expect("sizes are equal");
                let term = |(a, b): (f64, f64)| (a - b).powi(2) / (b * b + RELATIVE_MSE_EPSILON);
                ratio(w, found, mean(pairs(&images).map(term)));
            }
        }),
        worst("mean_absolute_percentage_error", IMAGES, Kind::Relative, |w| {
            for images in images(152) {
                let [a, b] = &images;
                let average = mean(b.pixels().iter().map(|p| y(p).max(0.0)));
                let found = mean_absolute_percentage_error(a, b);
                w.exactly(found.is_ok() == (average > 0.0));
                // Luminances are rounded to `f32`: what of their difference is left says nothing of
                // nearly equal images.
                if let Ok(found) = found {
                    w.exactly(found.is_finite());
                    let terms = a.pixels().iter().zip(b.pixels());
                    let truth =
                        mean(terms.map(|(i, r)| (y(i) - y(r)).abs() / (0.01 * average + y(r).max(0.0))));
                    if truth > 1e-3 {
                        ratio(w, found, truth);
                    }
                }
            }
        }),
        worst(
            "relative_mean",
            "images over 60 decades, of the largest and least numbers, negative, nearly equal, black: over 1 + the truth",
            Kind::Absolute,
            |w| {
                for images in images(153) {
                    let found = relative_mean(&images[0], &images[1]).expect("sizes are equal");
                    for channel in 0..3 {
                        let of =
                            |image: &RgbImage| mean(image.pixels().iter().map(|p| f64::from(p[channel])));
                        let (a, b) = (of(&images[0]), of(&images[1]));
                        w.exactly(found[channel].is_some() == (b != 0.0));
                        if let Some(found) = found[channel] {
                            let truth = a / b - 1.0;
                            w.add(found / (1.0 + truth.abs()), truth / (1.0 + truth.abs()));
                        }
                    }
                }
            },
        ),
        worst("structural_similarity", IMAGES, Kind::Absolute, |w| {
            for images in images(154) {
                let found = structural_similarity(&images[0], &images[1]).expect("sizes are equal");
                w.add(found, similarity(&images, y));
                let same = structural_similarity(&images[0], &images[0]).expect("sizes are equal");
                w.add(same, 1.0);
            }
        }),
        worst(
            "ImageComparison::new",
            "images over 60 decades, of the largest and least numbers, negative, nearly equal, black: is that of its parts, finite",
            Kind::Absolute,
            |w| {
                for [a, b] in images(155) {
                    let all = ImageComparison::new(&a, &b).expect("sizes are equal");
                    w.exactly(Ok(all.mse) == mean_squared_error(&a, &b) && all.mse.is_finite());
                    w.exactly(Ok(all.relative_mse) == relative_mean_squared_error(&a, &b));
                    w.exactly(all.mape == mean_absolute_percentage_error(&a, &b).ok());
                    w.exactly(
                        all.ssim == structural_similarity(&a, &b).ok()
                            && all.ssim.is_some_and(f64::is_finite),
                    );
                }
            },
        ),
        worst("RgbImage::mean", IMAGES, Kind::Relative, |w| {
            for images in images(156) {
                for image in &images {
                    for channel in 0..3 {
                        let terms = || image.pixels().iter().map(|p| f64::from(p[channel]));
                        // Over what is added, as terms of both signs cancel.
                        let scale = mean(terms().map(f64::abs)).max(1e-300);
                        w.add(1.0 + image.mean()[channel] / scale, 1.0 + mean(terms()) / scale);
                    }
                }
            }
        }),
        worst(
            "linear_to_srgb",
            "[0, 1], numbers of any size and sign",
            Kind::Absolute,
            |w| {
                let mut rng = rng(157);
                let large = (0..1000).flat_map(|_| {
                    let x = log_uniform(&mut rng, 1e-45, 3e38);
                    [x, -x]
                });
                for x in units(158).chain(large).chain([0.003_130_8, f32::MAX, f32::MIN]) {
                    w.add(f64::from(linear_to_srgb(x)), srgb(f64::from(x)));
                }
                w.exactly(linear_to_srgb(f32::NAN) == 0.0);
            },
        ),
    ]
}

fn srgb(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    if x > f64::from(0.003_130_8f32) {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    } else {
        12.92 * x
    }
}

/// The mean over all windows of 11×11 pixels, each worked out by itself, variances by differences
/// from the mean.
fn similarity(images: &[RgbImage; 2], luminance: impl Fn(&[f32; 3]) -> f64) -> f64 {
    const TAPS: usize = 11;
    let [width, height] = [images[0].width() as usize, images[0].height() as usize];
    let [a, b] = images
        .each_ref()
        .map(|image| -> Vec<f64> { image.pixels().iter().map(|p| srgb(luminance(p))).collect() });
    let weight = |i: usize| (-(i as f64 - 5.0).powi(2) / 4.5).exp();
    let total: f64 = (0..TAPS).map(weight).sum();
    let mut values = Vec::new();
    for top in 0..=height - TAPS {
        for left in 0..=width - TAPS {
            let window = |f: &dyn Fn(usize) -> f64| -> f64 {
                (0..TAPS * TAPS)
                    .map(|i| {
                        let (x, y) = (i % TAPS, i / TAPS);
                        weight(x) * weight(y) / (total * total) * f((top + y) * width + left + x)
                    })
                    .sum()
            };
            let (ma, mb) = (window(&|i| a[i]), window(&|i| b[i]));
            let (va, vb) = (window(&|i| (a[i] - ma).powi(2)), window(&|i| (b[i] - mb).powi(2)));
            let both = window(&|i| (a[i] - ma) * (b[i] - mb));
            let (c1, c2) = (1e-4, 9e-4);
            values
                .push((2.0 * ma * mb + c1) * (2.0 * both + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2)));
        }
    }
    mean(values.into_iter())
}
