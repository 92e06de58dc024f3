//! Do two images agree? Per tile and overall, with a stated false-positive rate.
//!
//! For a tile of pixels `i` in one channel, `t = Σ(a_i − b_i) / √Σ(v_i + w_i)` with `v`, `w`
//! the *estimated* variances of the pixel means. Because they are estimated from few samples, `t`
//! is not normal: its tails are those of Student's distribution with about
//! `ν = (Σ(v_i + w_i))² / Σ(v_i²/(n−1) + w_i²/(m−1))` degrees of freedom
//! (Welch–Satterthwaite), `n` and `m` samples a pixel. Each `t` is mapped through that
//! distribution to the `z` of equal probability. A tile whose variance comes from one bright
//! outlier thereby has few degrees of freedom, and is judged accordingly. What no such correction
//! sees is an image whose outliers have *not yet* been sampled: its variance is underestimated
//! everywhere. Compare at sample counts where that is not so.
//!
//! The verdict rejects a correct pair of images with probability at most `significance`, one third
//! for each of
//! - the number of tiles beyond `|z| > 4`, against the binomial distribution: a few tiles that are
//!   slightly off;
//! - the largest `|z|`, Bonferroni-corrected: one tile that is far off;
//! - the ratio of means of each channel, Bonferroni-corrected: everything slightly off.

use crate::StatisticsError;
use crate::rejection::{check_significance, two_sided_normal_p};
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::erf::erfc_inv;

/// Tiles beyond this many standard deviations are counted.
const OUTLIER_Z: f64 = 4.0;

/// Beyond this many degrees of freedom Student's distribution is taken to be normal.
const NORMAL_DEGREES_OF_FREEDOM: f64 = 1e4;

/// Means of pixels with the variances of these means, rows after each other, channels interleaved.
#[derive(Clone, Copy, Debug)]
pub struct ImageMoments<'a> {
    /// Pixels in a row.
    pub width: usize,
    /// Channels a pixel.
    pub channels: usize,
    /// Mean of each channel of each pixel.
    pub mean: &'a [f64],
    /// Estimated variance of that mean (`s²/n`), or empty for an image known exactly.
    pub variance_of_mean: &'a [f64],
    /// Independent samples in each pixel, from which the variance was estimated; at least 2.
    /// Ignored for an image known exactly.
    pub samples_per_pixel: u64,
}

/// How to compare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileOptions {
    /// Edge of the square tiles in pixels; those at the right and lower border may be smaller. At
    /// least 1.
    pub tile_size: usize,
    /// False-positive rate of the verdict.
    pub significance: f64,
    /// Differences of a tile's mean up to this share of it are ignored (rounding in files, say); 0
    /// ignores none.
    pub relative_tolerance: f64,
}

impl Default for TileOptions {
    /// 16 pixels, 10⁻⁴, no tolerance.
    fn default() -> Self {
        Self {
            tile_size: 16,
            significance: 1e-4,
            relative_tolerance: 0.0,
        }
    }
}

/// One tile in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TileScore {
    /// Column and row of the tile.
    pub tile: [usize; 2],
    /// Channel.
    pub channel: usize,
    /// `Σa / Σb`; 1 if both are zero, infinite if only `Σb` is.
    pub ratio: f64,
    /// Normal-equivalent score of the difference.
    pub z: f64,
}

/// `Σa / Σb` over the image in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ChannelRatio {
    /// The ratio; 1 if both sums are zero.
    pub ratio: f64,
    /// Its standard error (delta method).
    pub standard_error: f64,
    /// Normal-equivalent score of the difference of sums.
    pub z: f64,
}

/// What a comparison found, passed or not.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TileReport {
    /// The ratio of means, for each channel.
    pub channels: Vec<ChannelRatio>,
    /// Every tile in every channel.
    pub tiles: Vec<TileScore>,
    /// How many of them have `|z| > 4`.
    pub outliers: usize,
    /// How many would by chance.
    pub expected_outliers: f64,
    /// Smallest p-value of the three tests, each corrected for its multiplicity and for the number
    /// of tests, three.
    pub p_value: f64,
    /// The false-positive rate that was asked for.
    pub significance: f64,
}

impl TileReport {
    /// The tile of largest `|z|`.
    pub fn worst(&self) -> Option<&TileScore> {
        self.tiles.iter().max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()))
    }

    /// Whether the images agree.
    pub fn agrees(&self) -> bool {
        self.p_value >= self.significance
    }

    /// The verdict.
    ///
    /// # Errors
    /// [`StatisticsError::Rejected`] if the images disagree.
    pub fn verdict(&self) -> Result<(), StatisticsError> {
        if self.agrees() {
            return Ok(());
        }
        let worst = self.worst();
        Err(StatisticsError::Rejected {
            test: "tiles",
            statistic: worst.map_or(0.0, |t| t.z),
            p_value: self.p_value,
            significance: self.significance,
            detail: format!(
                "{} of {} tiles beyond |z| = 4 ({:.3} by chance), worst {worst:?}, channels {:?}",
                self.outliers,
                self.tiles.len(),
                self.expected_outliers,
                self.channels
            ),
        })
    }
}

/// Compares image `a` with image `b`; at least one of them must have variances.
///
/// # Errors
/// [`StatisticsError::Malformed`] for sizes that do not fit, values that are not finite, negative
/// variances, fewer than two samples a pixel, or options out of range. Disagreement is not an error
/// here: see [`TileReport::verdict`].
pub fn compare_tiles(
    a: &ImageMoments<'_>,
    b: &ImageMoments<'_>,
    options: &TileOptions,
) -> Result<TileReport, StatisticsError> {
    check_significance(options.significance)?;
    validate(a)?;
    validate(b)?;
    if a.width != b.width || a.channels != b.channels || a.mean.len() != b.mean.len() {
        return Err(StatisticsError::Malformed("the images differ in size"));
    }
    if options.tile_size == 0 || !(options.relative_tolerance >= 0.0) {
        return Err(StatisticsError::Malformed("tile size or tolerance out of range"));
    }
    if a.variance_of_mean.is_empty() && b.variance_of_mean.is_empty() {
        return Err(StatisticsError::Malformed("neither image has variances"));
    }
    let height = a.mean.len() / (a.width * a.channels);
    let across = a.width.div_ceil(options.tile_size);
    let down = height.div_ceil(options.tile_size);
    let mut sums = vec![Sums::default(); across * down * a.channels];
    let mut whole = vec![Sums::default(); a.channels];
    for index in 0..a.mean.len() {
        let (pixel, channel) = (index / a.channels, index % a.channels);
        let tile = [
            pixel % a.width / options.tile_size,
            pixel / a.width / options.tile_size,
        ];
        sums[(tile[1] * across + tile[0]) * a.channels + channel].add(a, b, index);
        whole[channel].add(a, b, index);
    }

    let tiles: Vec<TileScore> = sums
        .iter()
        .enumerate()
        .map(|(index, s)| {
            let tile = index / a.channels;
            TileScore {
                tile: [tile % across, tile / across],
                channel: index % a.channels,
                ratio: s.ratio(),
                z: s.z(options.relative_tolerance),
            }
        })
        .collect();
    let channels: Vec<ChannelRatio> = whole
        .iter()
        .map(|s| ChannelRatio {
            ratio: s.ratio(),
            standard_error: s.ratio_error(),
            z: s.z(options.relative_tolerance),
        })
        .collect();

    let chance = two_sided_normal_p(OUTLIER_Z);
    let outliers = tiles.iter().filter(|t| !(t.z.abs() <= OUTLIER_Z)).count();
    let largest = |zs: &mut dyn Iterator<Item = f64>| zs.map(two_sided_normal_p).fold(1.0, f64::min);
    let p_values = [
        binomial_tail(tiles.len(), chance, outliers),
        largest(&mut tiles.iter().map(|t| t.z)) * tiles.len() as f64,
        largest(&mut channels.iter().map(|c| c.z)) * channels.len() as f64,
    ];
    let p_value = (3.0 * p_values.into_iter().fold(1.0, f64::min)).min(1.0);
    Ok(TileReport {
        expected_outliers: chance * tiles.len() as f64,
        channels,
        tiles,
        outliers,
        p_value,
        significance: options.significance,
    })
}

fn validate(image: &ImageMoments<'_>) -> Result<(), StatisticsError> {
    let row = image.width * image.channels;
    if row == 0 || image.mean.is_empty() || !image.mean.len().is_multiple_of(row) {
        return Err(StatisticsError::Malformed(
            "an image is empty or its last row is incomplete",
        ));
    }
    if !image.mean.iter().all(|x| x.is_finite()) {
        return Err(StatisticsError::Malformed("a mean is not finite"));
    }
    if image.variance_of_mean.is_empty() {
        return Ok(());
    }
    if image.variance_of_mean.len() != image.mean.len() {
        return Err(StatisticsError::Malformed("means and variances differ in number"));
    }
    if !image.variance_of_mean.iter().all(|v| v.is_finite() && *v >= 0.0) {
        return Err(StatisticsError::Malformed("a variance is negative or not finite"));
    }
    if image.samples_per_pixel < 2 {
        return Err(StatisticsError::Malformed("fewer than two samples a pixel"));
    }
    Ok(())
}

/// Sums over the pixels of a tile.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    a: f64,
    b: f64,
    variance_a: f64,
    variance_b: f64,
    /// `Σ v²/(n−1)`, the denominator of Welch–Satterthwaite.
    spread: f64,
}

impl Sums {
    fn add(&mut self, a: &ImageMoments<'_>, b: &ImageMoments<'_>, index: usize) {
        self.a += a.mean[index];
        self.b += b.mean[index];
        for (image, sum) in [(a, &mut self.variance_a), (b, &mut self.variance_b)] {
            if let Some(v) = image.variance_of_mean.get(index) {
                *sum += v;
                self.spread += v * v / (image.samples_per_pixel - 1) as f64;
            }
        }
    }

    fn ratio(&self) -> f64 {
        if self.a == self.b { 1.0 } else { self.a / self.b }
    }

    fn ratio_error(&self) -> f64 {
        if self.b == 0.0 {
            return 0.0;
        }
        let ratio = self.ratio();
        (self.variance_a + ratio * ratio * self.variance_b).sqrt() / self.b.abs()
    }

    fn z(&self, relative_tolerance: f64) -> f64 {
        let difference = self.a - self.b;
        // Without the last term, two exact zeros that were summed in different ways would differ
        // infinitely.
        let magnitude = self.a.abs().max(self.b.abs());
        let excess = difference.abs() - (relative_tolerance + 1e-12) * magnitude;
        if excess <= 0.0 {
            return 0.0;
        }
        let variance = self.variance_a + self.variance_b;
        let t = excess / variance.sqrt();
        let degrees_of_freedom = if self.spread > 0.0 {
            variance * variance / self.spread
        } else {
            f64::INFINITY
        };
        normal_equivalent(t, degrees_of_freedom).copysign(difference)
    }
}

/// The `z ≥ 0` with the two-sided tail probability that `t ≥ 0` has under Student's
/// distribution.
fn normal_equivalent(t: f64, degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom > NORMAL_DEGREES_OF_FREEDOM || !t.is_finite() {
        return t;
    }
    let p = match StudentsT::new(0.0, 1.0, degrees_of_freedom.max(1.0)) {
        Ok(student) => 2.0 * student.sf(t),
        Err(_) => return t,
    };
    if p < 1e-300 {
        t
    } else {
        core::f64::consts::SQRT_2 * erfc_inv(p.min(1.0))
    }
}

/// `P(Binomial(n, p) ≥ k)`.
fn binomial_tail(n: usize, p: f64, k: usize) -> f64 {
    if k == 0 {
        return 1.0;
    }
    // Terms by their ratio, from the k-th on: small, positive, and decreasing fast once k exceeds n
    // p.
    let n = n as f64;
    let mut log_term = n * (-p).ln_1p();
    for i in 0..k {
        let i = i as f64;
        log_term += ((n - i) / (i + 1.0)).ln() + (p / (1.0 - p)).ln();
    }
    let mut term = log_term.exp();
    let mut sum = 0.0;
    let mut i = k as f64;
    while i <= n && term > 1e-20 * sum {
        sum += term;
        term *= (n - i) / (i + 1.0) * p / (1.0 - p);
        i += 1.0;
    }
    sum.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{check_faults, rng, uniform_f64};

    const WIDTH: usize = 70;
    const HEIGHT: usize = 50;

    /// A picture with a skewed estimator: value 1/q with probability q, times a gradient.
    fn render(seed: u64, samples: u64, fault: Option<Fault>) -> (Vec<f64>, Vec<f64>) {
        let mut rng = rng(seed);
        let (mut means, mut variances) = (Vec::new(), Vec::new());
        for pixel in 0..WIDTH * HEIGHT {
            let (x, y) = (pixel % WIDTH, pixel / WIDTH);
            for channel in 0..3 {
                let mut truth = (x + 1) as f64 * (channel + 1) as f64;
                match fault {
                    Some(Fault::SlightlyDarkEverywhere) => truth *= 0.95,
                    Some(Fault::OneTileDark) if x / 16 == 1 && y / 16 == 2 => truth *= 0.7,
                    Some(Fault::OnePixelMissing) if (x, y) == (33, 33) => truth = 0.0,
                    _ => {}
                }
                let mut moments = crate::MeanTest::new();
                for _ in 0..samples {
                    moments.push(if uniform_f64(&mut rng) < 0.25 {
                        4.0 * truth
                    } else {
                        0.0
                    });
                }
                means.push(moments.mean());
                variances.push(moments.variance() / samples as f64);
            }
        }
        (means, variances)
    }

    fn image<'a>(pixels: &'a (Vec<f64>, Vec<f64>), samples_per_pixel: u64) -> ImageMoments<'a> {
        ImageMoments {
            width: WIDTH,
            channels: 3,
            mean: &pixels.0,
            variance_of_mean: &pixels.1,
            samples_per_pixel,
        }
    }

    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        SlightlyDarkEverywhere,
        OneTileDark,
        OnePixelMissing,
    }

    #[test]
    fn accepts_equal_estimators_and_sees_local_and_global_darkening() {
        // False-positive rate 1e-4.
        let reference = render(1, 64, None);
        let faults = [Fault::SlightlyDarkEverywhere, Fault::OneTileDark];
        check_faults(&faults, |fault| {
            let test = render(2, 64, fault);
            let report =
                compare_tiles(&image(&test, 64), &image(&reference, 64), &TileOptions::default()).unwrap();
            assert_eq!(report.tiles.len(), 5 * 4 * 3);
            report.verdict()
        })
        .unwrap();
    }

    #[test]
    fn a_missing_pixel_shows_in_small_tiles() {
        // The mean has no noise of its own where nothing is sampled: one pixel a tile finds it.
        check_faults(&[Fault::OnePixelMissing], |fault| {
            let (test, reference) = (render(3, 256, fault), render(4, 256, None));
            let options = TileOptions {
                tile_size: 1,
                ..TileOptions::default()
            };
            compare_tiles(&image(&test, 256), &image(&reference, 256), &options)
                .unwrap()
                .verdict()
        })
        .unwrap();
    }

    #[test]
    fn few_samples_a_pixel_do_not_raise_the_false_positive_rate() {
        // 200 correct pairs at 4 samples a pixel in 8×8 tiles, significance 5 %: 10 expected at
        // most, and P(Binomial(200, 0.05) ≥ 28) < 1e-6.
        let mut rejected = 0;
        for seed in 0..200 {
            let (a, b) = (render(1000 + 2 * seed, 4, None), render(1001 + 2 * seed, 4, None));
            let options = TileOptions {
                tile_size: 8,
                significance: 0.05,
                relative_tolerance: 0.0,
            };
            let report = compare_tiles(&image(&a, 4), &image(&b, 4), &options).unwrap();
            rejected += usize::from(!report.agrees());
        }
        assert!(rejected < 28, "{rejected} of 200 correct pairs rejected");
    }

    #[test]
    fn an_exact_image_needs_no_variance_and_a_ratio_has_an_error() {
        let test = render(7, 64, None);
        let truth: Vec<f64> = (0..WIDTH * HEIGHT * 3)
            .map(|i| (i / 3 % WIDTH + 1) as f64 * (i % 3 + 1) as f64)
            .collect();
        let exact = ImageMoments {
            variance_of_mean: &[],
            mean: &truth,
            ..image(&test, 0)
        };
        let report = compare_tiles(&image(&test, 64), &exact, &TileOptions::default()).unwrap();
        report.verdict().unwrap();
        for channel in &report.channels {
            assert!((channel.ratio - 1.0).abs() < 4.0 * channel.standard_error);
            assert!(channel.standard_error > 0.0 && channel.standard_error < 0.02);
        }
        assert!(compare_tiles(&exact, &exact, &TileOptions::default()).is_err());
    }

    #[test]
    fn forgives_what_it_is_told_to() {
        let (reference, test) = (
            render(8, 64, None),
            render(9, 64, Some(Fault::SlightlyDarkEverywhere)),
        );
        let options = TileOptions {
            relative_tolerance: 0.05,
            ..TileOptions::default()
        };
        assert!(
            compare_tiles(&image(&test, 64), &image(&reference, 64), &options)
                .unwrap()
                .agrees()
        );
    }

    #[test]
    fn the_binomial_tail_is_right() {
        assert_eq!(binomial_tail(10, 0.3, 0), 1.0);
        assert!((binomial_tail(10, 0.5, 9) - 11.0 / 1024.0).abs() < 1e-15);
        assert!((binomial_tail(1000, 1e-3, 1) - (1.0 - 0.999f64.powi(1000))).abs() < 1e-12);
        assert!((binomial_tail(3, 0.25, 3) - 1.0 / 64.0).abs() < 1e-16);
    }

    #[test]
    fn student_scores_become_normal_ones() {
        // P(|T₅| > 4.0321) = 0.01 and P(|Z| > 2.5758) = 0.01.
        assert!((normal_equivalent(4.032_143, 5.0) - 2.575_829).abs() < 1e-4);
        assert_eq!(normal_equivalent(3.0, f64::INFINITY), 3.0);
        assert_eq!(normal_equivalent(0.0, 3.0), 0.0);
    }

    #[test]
    fn malformed_images_are_errors() {
        let good = render(5, 8, None);
        let fine = image(&good, 8);
        for bad in [
            ImageMoments { width: 0, ..fine },
            ImageMoments { width: 71, ..fine },
            ImageMoments {
                samples_per_pixel: 1,
                ..fine
            },
            ImageMoments {
                variance_of_mean: &good.1[1..],
                ..fine
            },
            ImageMoments {
                mean: &[f64::NAN; WIDTH * HEIGHT * 3],
                ..fine
            },
        ] {
            let result = compare_tiles(&bad, &fine, &TileOptions::default());
            assert!(matches!(result, Err(StatisticsError::Malformed(_))));
        }
    }
}
