//! Tests whether two methods have the same expectation: differences of means with intervals, from
//! independent parts.
//!
//! Pixels that share samples are correlated, and so are frames of a chain. *Shards* are
//! independent: other samples, other frames that share nothing, other seeds. A shard `k` of `n_k`
//! samples is therefore *one* value `x_k` of each mean, of a tile or of the whole image. Its
//! variance is `σ² / n_k`, so that
//!
//! > `x̄ = Σ n_k x_k / N`, `s² = Σ n_k (x_k − x̄)² / ((K − 1) N)`, `N = Σ n_k`
//!
//! estimate the mean and the variance of that estimate from `K` shards. Two methods differ by
//! `x̄_b − x̄_a`; its interval is Student's with the degrees of freedom of Welch (1947) and
//! Satterthwaite (1946).

use crate::EvaluateError;
use lightshed_film::{Film, RgbImage};
use lightshed_sampling::LUMINANCE;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Red, green, blue and luminance.
pub const AGREEMENT_CHANNELS: [&str; 4] = ["red", "green", "blue", "luminance"];

/// A mean of values with different weights, and their spread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct WeightedMean {
    count: u32,
    weight: f64,
    mean: f64,
    /// `Σ n_k (x_k − x̄)²`.
    squares: f64,
}

impl WeightedMean {
    /// Adds a value by West's update (1979), which does not cancel.
    fn push(&mut self, value: f64, weight: f64) {
        self.count += 1;
        self.weight += weight;
        let before = value - self.mean;
        self.mean += before * weight / self.weight;
        self.squares += weight * before * (value - self.mean);
    }

    fn degrees(&self) -> f64 {
        f64::from(self.count) - 1.0
    }

    /// Variance of the mean.
    fn variance(&self) -> f64 {
        self.squares / (self.degrees() * self.weight)
    }
}

/// Means of an image and of its tiles over independent shards of one method.
#[derive(Clone, Debug, PartialEq)]
pub struct ShardMeans {
    size: [u32; 2],
    tile: u32,
    samples: u64,
    /// The whole image, then its tiles row by row.
    parts: Vec<[WeightedMean; 4]>,
}

impl ShardMeans {
    /// No shard yet, of images of `size` pixels with tiles of `tile` pixels a side; those at the
    /// right and bottom edge may be smaller.
    pub fn new(size: [u32; 2], tile: u32) -> Self {
        let tile = tile.max(1);
        let tiles = size.map(|side| side.div_ceil(tile) as usize);
        Self {
            size,
            tile,
            samples: 0,
            parts: vec![[WeightedMean::default(); 4]; tiles[0] * tiles[1] + 1],
        }
    }

    /// Adds a shard: its film is one value of every mean, with the number of samples in a pixel as
    /// weight.
    ///
    /// # Errors
    /// [`EvaluateError::Size`] of a film of another size; [`EvaluateError::Record`] of one without
    /// samples.
    pub fn push(&mut self, film: &Film) -> Result<(), EvaluateError> {
        let size = [film.width(), film.height()];
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let samples = (film.samples() + film.non_finite()) / pixels.max(1);
        let mean = |x, y| film.get(x, y).map_or([0.0; 3], |pixel| pixel.mean());
        self.push_means(size, samples, mean)
    }

    /// Adds a shard of which only the mean of its `samples` samples in each pixel is known.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn push_image(&mut self, image: &RgbImage, samples: u32) -> Result<(), EvaluateError> {
        let mean = |x, y| image.get(x, y).map_or([0.0; 3], |pixel| pixel.map(f64::from));
        self.push_means([image.width(), image.height()], samples.into(), mean)
    }

    fn push_means(
        &mut self,
        size: [u32; 2],
        samples: u64,
        mean: impl Fn(u32, u32) -> [f64; 3],
    ) -> Result<(), EvaluateError> {
        if size != self.size {
            return Err(EvaluateError::Size {
                image: size,
                reference: self.size,
            });
        }
        if samples == 0 {
            return Err(EvaluateError::Record("a shard has no samples".into()));
        }
        let mut sums = vec![([0.0; 4], 0.0); self.parts.len()];
        for y in 0..size[1] {
            for x in 0..size[0] {
                let [r, g, b] = mean(x, y);
                let weighted = LUMINANCE.to_array().map(f64::from).into_iter().zip([r, g, b]);
                let light = weighted.map(|(weight, value)| weight * value).sum();
                for part in [0, self.tile_of(x, y) + 1] {
                    let (sum, count) = &mut sums[part];
                    *count += 1.0;
                    sum.iter_mut()
                        .zip([r, g, b, light])
                        .for_each(|(sum, value)| *sum += value);
                }
            }
        }
        for (part, (sums, count)) in self.parts.iter_mut().zip(sums) {
            for (mean, sum) in part.iter_mut().zip(sums) {
                mean.push(sum / count, samples as f64);
            }
        }
        self.samples += samples;
        Ok(())
    }

    /// As if all values were multiplied by `factor`: a planted bias, to test whether it would be
    /// found.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for mean in self.parts.as_flattened_mut() {
            mean.mean *= factor;
            mean.squares *= factor * factor;
        }
        self
    }

    /// Shards so far.
    pub fn shards(&self) -> u32 {
        self.parts[0][0].count
    }

    /// Samples in a pixel of all shards together.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    fn columns(&self) -> u32 {
        self.size[0].div_ceil(self.tile)
    }

    fn tile_of(&self, x: u32, y: u32) -> usize {
        (y / self.tile) as usize * self.columns() as usize + (x / self.tile) as usize
    }

    /// The differences of `other`'s means from these.
    ///
    /// # Errors
    /// [`EvaluateError::Size`] of images or tiles of different size, [`EvaluateError::Record`] of
    /// fewer than two shards of either.
    pub fn compare(&self, other: &Self) -> Result<Agreement, EvaluateError> {
        if (self.size, self.tile) != (other.size, other.tile) {
            return Err(EvaluateError::Size {
                image: other.size,
                reference: self.size,
            });
        }
        if self.shards() < 2 || other.shards() < 2 {
            return Err(EvaluateError::Record(
                "an interval needs two shards of each method".into(),
            ));
        }
        let pairs = self.parts.iter().zip(&other.parts);
        let mut all =
            pairs.map(|(a, b)| std::array::from_fn(|channel| MeanDifference::of(&a[channel], &b[channel])));
        let whole = all
            .next()
            .unwrap_or_else(|| unreachable!("the whole is the first part"));
        let columns = self.columns();
        let tiles = (0u32..).zip(all).map(|(place, channels)| TileDifference {
            x: place % columns * self.tile,
            y: place / columns * self.tile,
            channels,
        });
        Ok(Agreement {
            whole,
            tiles: tiles.collect(),
        })
    }
}

/// The difference between two means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeanDifference {
    /// The mean of the baseline.
    pub baseline: f64,
    /// The other mean less the baseline's.
    pub difference: f64,
    /// Standard error of the difference.
    pub standard_error: f64,
    /// Standard errors of the two means, the baseline's first.
    pub standard_errors: [f64; 2],
    /// Standard error of the ratio of the two means less 1, to first order.
    pub relative_error: f64,
    /// Welch's and Satterthwaite's degrees of freedom.
    pub degrees: f64,
}

/// An interval of a relative difference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RelativeInterval {
    /// Lower end.
    pub low: f64,
    /// The estimate.
    pub mid: f64,
    /// Upper end.
    pub high: f64,
}

/// The verdict of an interval for a tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Verdict {
    /// All of the interval is within the tolerance.
    Agrees,
    /// The interval does not hold zero, and is not within the tolerance.
    Differs,
    /// Neither: more shards are needed.
    Undecided,
}

/// Differences of a tile, whose top left pixel is `(x, y)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TileDifference {
    /// Column of the tile's left pixels.
    pub x: u32,
    /// Row of its top pixels.
    pub y: u32,
    /// By channel, in the order of [`AGREEMENT_CHANNELS`].
    pub channels: [MeanDifference; 4],
}

/// Differences of two methods.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// Of the whole image, by channel in the order of [`AGREEMENT_CHANNELS`].
    pub whole: [MeanDifference; 4],
    /// Of its tiles, row by row.
    pub tiles: Vec<TileDifference>,
}

impl MeanDifference {
    fn of(a: &WeightedMean, b: &WeightedMean) -> Self {
        let variances = [a.variance(), b.variance()];
        let sum = variances[0] + variances[1];
        let share = |variance: f64, mean: &WeightedMean| variance * variance / mean.degrees();
        let ratio = b.mean / a.mean;
        Self {
            baseline: a.mean,
            difference: b.mean - a.mean,
            standard_error: sum.sqrt(),
            standard_errors: variances.map(f64::sqrt),
            relative_error: (variances[1] + ratio * ratio * variances[0]).sqrt() / a.mean.abs(),
            degrees: sum * sum / (share(variances[0], a) + share(variances[1], b)),
        }
    }

    /// `b / a − 1` of the two means, with the interval that holds the true one in `confidence` of
    /// all cases if means of shards are normally distributed. `None` where the baseline is black,
    /// or nothing varies.
    pub fn relative(&self, confidence: f64) -> Option<RelativeInterval> {
        let quantile = self
            .student()?
            .inverse_cdf(0.5 + 0.5 * confidence.clamp(0.0, 1.0));
        let (mid, half) = (self.difference / self.baseline, quantile * self.relative_error);
        (mid.is_finite() && half.is_finite()).then_some(RelativeInterval {
            low: mid - half,
            mid,
            high: mid + half,
        })
    }

    /// Probability of a difference at least as large if there were none; `None` where nothing
    /// varies.
    pub fn p_value(&self) -> Option<f64> {
        let t = self.difference / self.standard_error;
        Some(2.0 * self.student()?.cdf(-t.abs()))
    }

    fn student(&self) -> Option<StudentsT> {
        let varies = self.standard_error > 0.0 && self.degrees.is_finite();
        varies
            .then(|| StudentsT::new(0.0, 1.0, self.degrees).ok())
            .flatten()
    }
}

impl RelativeInterval {
    /// The verdict for a tolerance of `within`, relative.
    pub fn verdict(&self, within: f64) -> Verdict {
        if -within <= self.low && self.high <= within {
            Verdict::Agrees
        } else if self.low > 0.0 || self.high < 0.0 {
            Verdict::Differs
        } else {
            Verdict::Undecided
        }
    }
}

impl Agreement {
    /// The tile and channel that differ most for their noise, and the probability that any would
    /// differ as much by chance (Bonferroni's bound); `None` if nothing varies.
    pub fn worst_tile(&self) -> Option<(&TileDifference, usize, f64)> {
        let all = self.tiles.iter().flat_map(|tile| {
            let channels = tile.channels.iter().enumerate();
            channels.filter_map(move |(channel, difference)| Some((tile, channel, difference.p_value()?)))
        });
        let count = all.clone().count() as f64;
        let (tile, channel, p) = all.min_by(|a, b| a.2.total_cmp(&b.2))?;
        Some((tile, channel, (count * p).min(1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::{CounterRng, Rgb};
    use lightshed_testkit::check_faults;

    const SIZE: [u32; 2] = [12, 8];

    /// A shard of `samples` frames of mean `scale · (1 + noise / 2)`. Four pixels in a row share
    /// nearly all of their noise.
    fn shard(number: u32, samples: u32, scale: f32, noise: f32) -> Film {
        let mut film = Film::new(SIZE[0], SIZE[1]).unwrap();
        for sample in 0..samples {
            for y in 0..SIZE[1] {
                for x in 0..SIZE[0] {
                    let u = |x: u32| CounterRng::new(u64::from(number), y << 16 | x, sample).next_f32();
                    let value = scale * (1.0 + noise * (0.9 * u(x / 4) + 0.1 * u(100 + x)));
                    film.add(x, y, Rgb::new(value, 2.0 * value, 0.5));
                }
            }
        }
        film
    }

    /// Shards of different lengths.
    fn shards(first: u32, count: u32, scale: f32, noise: f32) -> Vec<Film> {
        (first..first + count)
            .map(|number| shard(number, 1 + number % 3, scale, noise))
            .collect()
    }

    fn means(films: &[Film]) -> ShardMeans {
        let mut means = ShardMeans::new(SIZE, 8);
        films.iter().for_each(|film| means.push(film).unwrap());
        means
    }

    #[test]
    fn two_shards_of_a_method_are_students() {
        let mut means = [ShardMeans::new([1, 1], 1), ShardMeans::new([1, 1], 1)];
        for (means, values) in means.iter_mut().zip([[1.0, 3.0], [5.0, 5.5]]) {
            for value in values {
                let mut film = Film::new(1, 1).unwrap();
                film.add(0, 0, Rgb::splat(value));
                means.push(&film).unwrap();
            }
        }
        let agreement = means[0].compare(&means[1]).unwrap();
        let red = agreement.whole[0];
        // Variances of means: 1 and 1/16.
        assert_eq!((red.baseline, red.difference), (2.0, 3.25));
        assert!((red.standard_error.powi(2) - 1.0625).abs() < 1e-12);
        assert!((red.degrees - 1.0625f64.powi(2) / (1.0 + 1.0 / 256.0)).abs() < 1e-12);
        assert_eq!(agreement.tiles[0].channels, agreement.whole);
        let interval = red.relative(0.95).unwrap();
        assert!((interval.mid - 1.625).abs() < 1e-12 && interval.low < 0.0);
        assert_eq!(interval.verdict(0.01), Verdict::Undecided);
        assert!(ShardMeans::new([1, 1], 1).compare(&means[0]).is_err());
        assert!(ShardMeans::new([2, 1], 1).compare(&means[0]).is_err());
    }

    /// Shards of which only means are known tell the same. Planted fault: one sample each.
    #[test]
    fn means_of_shards_are_enough() {
        let [mut images, mut others] = [(); 2].map(|()| ShardMeans::new(SIZE, 8));
        let [a, b] = [0, 40].map(|offset| shards(offset, 5, 1.0, 1.0));
        for (means, films) in [(&mut images, &a), (&mut others, &b)] {
            for film in films {
                let samples = film.samples() / u64::from(SIZE[0] * SIZE[1]);
                means.push_image(&film.mean_image(), samples as u32).unwrap();
            }
        }
        let (found, told) = (
            images.compare(&others).unwrap(),
            means(&a).compare(&means(&b)).unwrap(),
        );
        assert_eq!(found.tiles.len(), told.tiles.len());
        for (found, told) in found.whole.iter().zip(told.whole) {
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-5 * b.abs() + 1e-12;
            assert!(close(found.difference, told.difference), "{found:?} {told:?}");
            assert!(
                close(found.standard_error, told.standard_error),
                "{found:?} {told:?}"
            );
        }
        let small = RgbImage::from_fn(3, 3, |_, _| [1.0; 3]).unwrap();
        assert!(images.push_image(&small, 1).is_err());
        assert!(images.push_image(&a[0].mean_image(), 0).is_err());
    }

    /// Tolerances and intervals.
    #[test]
    fn verdicts_are_those_of_the_interval() {
        let verdict = |low: f64, high: f64| {
            let mid = 0.5 * (low + high);
            RelativeInterval { low, mid, high }.verdict(1e-4)
        };
        assert_eq!(verdict(-0.5e-4, 0.9e-4), Verdict::Agrees);
        assert_eq!(verdict(0.1e-4, 0.9e-4), Verdict::Agrees);
        assert_eq!(verdict(0.1e-4, 1.1e-4), Verdict::Differs);
        assert_eq!(verdict(-3e-4, -2e-4), Verdict::Differs);
        assert_eq!(verdict(-1.1e-4, 1e-5), Verdict::Undecided);
    }

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Pixels taken for independent: the variance of the mean from those of pixels.
        IndependentPixels,
        /// Every sample taken for a shard of its own length: the spread of shards without their
        /// weights.
        Unweighted,
    }

    /// Standard error of the mean of red, by a wrong way.
    fn wrong_error(films: &[Film], fault: Fault) -> f64 {
        let pixels = f64::from(SIZE[0] * SIZE[1]);
        match fault {
            Fault::IndependentPixels => {
                let mut whole = Film::new(SIZE[0], SIZE[1]).unwrap();
                films.iter().for_each(|film| whole.merge(film).unwrap());
                let sum: f64 = whole
                    .variance_of_mean()
                    .unwrap()
                    .pixels()
                    .iter()
                    .map(|pixel| f64::from(pixel[0]))
                    .sum();
                sum.sqrt() / pixels
            }
            Fault::Unweighted => {
                let mut mean = WeightedMean::default();
                for film in films {
                    let count = film.samples() as f64 / pixels;
                    mean.push(film.mean_image().mean()[0], 1.0);
                    mean.weight += count - 1.0;
                }
                mean.variance().sqrt()
            }
        }
    }

    /// Of 600 intervals of 95 %, between 543 and 594 hold the truth, but for about 1 case in 10⁴
    /// (binomial).
    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        check_faults(&[Fault::IndependentPixels, Fault::Unweighted], |fault| {
            let held = (0..600).filter(|repeat| {
                let [a, b] = [0, 40].map(|offset| shards(100 * repeat + offset, 12, 1.0, 1.0));
                let mut red = means(&a).compare(&means(&b)).unwrap().whole[0];
                if let Some(fault) = fault {
                    let errors = [&a, &b].map(|films| wrong_error(films, fault).powi(2));
                    red.relative_error = (errors[0] + errors[1]).sqrt() / red.baseline;
                }
                let interval = red.relative(0.95).unwrap();
                interval.low <= 0.0 && 0.0 <= interval.high
            });
            match held.count() {
                543..=594 => Ok(()),
                held => Err(format!("{held} of 600")),
            }
        })
        .unwrap();
    }

    /// A bias of 0.03 % is found, and means that are the same to 0.01 % are found to be.
    #[test]
    fn a_bias_of_three_parts_in_ten_thousand_is_found() {
        let sound = means(&shards(0, 150, 1.0, 0.004));
        let verdict = |scale| {
            let other = means(&shards(1000, 150, scale, 0.004));
            let interval = sound.compare(&other).unwrap().whole[3].relative(0.95).unwrap();
            assert!(interval.high - interval.low < 1e-4, "{interval:?}");
            interval.verdict(1e-4)
        };
        assert_eq!(verdict(1.0), Verdict::Agrees);
        assert_eq!(verdict(1.0003), Verdict::Differs);
        // The same bias, planted afterwards.
        let planted = means(&shards(1000, 150, 1.0, 0.004)).scaled(1.0003);
        let whole = sound.compare(&planted).unwrap().whole[3];
        assert_eq!(whole.relative(0.95).unwrap().verdict(1e-4), Verdict::Differs);
    }

    #[test]
    fn a_bias_of_a_tile_is_found_there() {
        let sound = shards(0, 100, 1.0, 1.0);
        let biased = (300..400).map(|number| {
            let films = [1.0, 1.3].map(|scale| shard(number, 2, scale, 1.0));
            let mut film = Film::new(SIZE[0], SIZE[1]).unwrap();
            for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
                let mean = films[usize::from(x >= 8)].get(x, y).unwrap().mean();
                film.add(x, y, Rgb::from_array(mean.map(|value| value as f32)));
            }
            film
        });
        let agreement = means(&sound)
            .compare(&means(&biased.collect::<Vec<_>>()))
            .unwrap();
        assert_eq!(agreement.tiles.len(), 2);
        let (tile, _, p) = agreement.worst_tile().unwrap();
        assert!((tile.x, tile.y) == (8, 0) && p < 1e-6, "{p}");
        assert!(agreement.tiles[0].channels[0].p_value().unwrap() > 1e-3);
    }
}
