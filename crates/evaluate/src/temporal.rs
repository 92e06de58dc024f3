//! Correlation of the frames of a chain.

use crate::EvaluateError;
use lightshed_film::{FrameMethod, RgbImage};
use lightshed_sampling::{Rgb, luminance};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// Frames of a chain in their order: how much each resembles the earlier ones.
#[derive(Clone, Debug)]
pub struct TemporalStudy {
    size: [u32; 2],
    /// Luminances, frame by frame.
    frames: Vec<Vec<f32>>,
    slice: Vec<[f32; 3]>,
    row: u32,
}

/// Autocorrelation of a chain's frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Autocorrelation {
    /// `ρ_k = Σ_p C_p(k) / Σ_p C_p(0)` for lags `k` from 0 on, with `C_p(k)` the autocovariance
    /// of pixel `p`'s luminance over the frames.
    pub by_lag: Vec<f64>,
    /// `τ = 1 + 2 Σ_{k≥1} ρ_k`, summed up to the first lag that is not positive: of `n` frames
    /// the mean has the variance of that of `n/τ` independent ones. Estimates from fewer than some
    /// 20 `τ` frames are too low.
    pub time: f64,
}

/// Autocovariance of a chain's frames, in units of squared luminance, averaged over pixels: the
/// part of the variance that a filter takes for signal.
///
/// Covariances are about each pixel's own mean over the frames. With `n` frames this subtracts
/// `1/n` of the variance of a mean of them. So estimates are too low for chains whose correlation
/// extends beyond about `n/20` frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Autocovariance {
    /// `C(k)` between frames `k` apart, from 0 (the variance) on.
    pub in_time: Vec<f64>,
    /// `C(d)` between pixels of one frame that are `d` apart along a row or a column, from 0 on.
    pub in_space: Vec<f64>,
}

impl TemporalStudy {
    /// Frames `skipped` to `skipped + frames − 1` of a method, and of each the middle row.
    ///
    /// # Errors
    /// [`EvaluateError::Contest`] for fewer than 2 frames, [`EvaluateError::Interrupted`] if
    /// `cancel` was set.
    pub fn run(
        method: &mut dyn FrameMethod,
        skipped: u32,
        frames: u32,
        seed: u64,
        cancel: &AtomicBool,
    ) -> Result<Self, EvaluateError> {
        if frames < 2 {
            return Err(EvaluateError::Contest("two frames at least are needed".into()));
        }
        let size = method.size();
        let row = size[1] / 2;
        let mut image = vec![Rgb::ZERO; size[0] as usize * size[1] as usize];
        let mut study = Self {
            size,
            frames: Vec::new(),
            slice: Vec::new(),
            row,
        };
        for frame in 0..skipped.saturating_add(frames) {
            let done = method.render_frame(frame, seed, &mut image, cancel);
            if done.is_none() || cancel.load(Ordering::Relaxed) {
                return Err(EvaluateError::Interrupted);
            }
            if frame >= skipped {
                study
                    .frames
                    .push(image.iter().map(|&value| luminance(value)).collect());
                let width = size[0] as usize;
                let columns = &image[row as usize * width..][..width];
                study.slice.extend(columns.iter().map(|value| value.to_array()));
            }
        }
        Ok(study)
    }

    /// The row of [`TemporalStudy::slice`].
    pub fn row(&self) -> u32 {
        self.row
    }

    /// One row of the image over time: column `x` of line `t` is the pixel in frame `t`. Chains
    /// show as stripes.
    ///
    /// # Errors
    /// None in practice: the image is as wide as the frames and as high as there are frames.
    pub fn slice(&self) -> Result<RgbImage, EvaluateError> {
        Ok(RgbImage::new(
            self.size[0],
            self.frames.len() as u32,
            self.slice.clone(),
        )?)
    }

    /// `Σ_p Σ_t (x_p(t) − m_p) (x_p(t + k) − m_p)` for each lag `k`.
    fn products_in_time(&self, lags: usize) -> Vec<f64> {
        let count = self.frames.len();
        let mut products = vec![0.0f64; lags + 1];
        for pixel in 0..self.frames[0].len() {
            let series = || self.frames.iter().map(|frame| f64::from(frame[pixel]));
            let mean = series().sum::<f64>() / count as f64;
            for (lag, sum) in products.iter_mut().enumerate() {
                let pairs = series().zip(series().skip(lag));
                *sum += pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
            }
        }
        products
    }

    /// Autocovariance between frames up to `lags` apart (less than there are frames) and pixels up
    /// to `pixels` apart (less than the shorter side).
    pub fn autocovariance(&self, lags: usize, pixels: usize) -> Autocovariance {
        let (count, size) = (self.frames.len(), self.frames[0].len());
        let lags = lags.min(count - 1);
        let in_time = self.products_in_time(lags).into_iter().enumerate();
        // Of `n` values about their own mean.
        let free = (count - 1) as f64 / count as f64;
        let in_time = in_time.map(|(lag, sum)| sum / (free * ((count - lag) * size) as f64));
        let [width, height] = self.size.map(|side| side as usize);
        let pixels = pixels.min(width.min(height).saturating_sub(1));
        let means: Vec<f64> = (0..size)
            .map(|pixel| {
                self.frames
                    .iter()
                    .map(|frame| f64::from(frame[pixel]))
                    .sum::<f64>()
                    / count as f64
            })
            .collect();
        let mut products = vec![0.0f64; pixels + 1];
        for frame in &self.frames {
            let off = |x: usize, y: usize| f64::from(frame[y * width + x]) - means[y * width + x];
            for (distance, sum) in products.iter_mut().enumerate() {
                let row =
                    |y: usize| -> f64 { (distance..width).map(|x| off(x, y) * off(x - distance, y)).sum() };
                let column =
                    |x: usize| -> f64 { (distance..height).map(|y| off(x, y) * off(x, y - distance)).sum() };
                *sum += (0..height).map(row).sum::<f64>() + (0..width).map(column).sum::<f64>();
            }
        }
        let pairs = |distance: usize| ((width - distance) * height + (height - distance) * width) * count;
        let in_space = products.into_iter().enumerate();
        Autocovariance {
            in_time: in_time.collect(),
            in_space: in_space
                .map(|(distance, sum)| sum / (free * pairs(distance) as f64))
                .collect(),
        }
    }

    /// Autocorrelation up to a lag, which is less than the number of frames.
    pub fn autocorrelation(&self, lags: usize) -> Autocorrelation {
        let covariance = self.products_in_time(lags.min(self.frames.len() - 1));
        let all = covariance[0];
        let by_lag: Vec<f64> = covariance
            .iter()
            .map(|c| if all > 0.0 { c / all } else { 0.0 })
            .collect();
        let positive = by_lag.iter().skip(1).take_while(|rho| **rho > 0.0);
        let time = 1.0 + 2.0 * positive.sum::<f64>();
        Autocorrelation { by_lag, time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_film::RayCounts;
    use lightshed_sampling::CounterRng;

    /// Pixels that keep a share of what they were: `ρ_k = share^k`.
    struct Memory {
        share: f32,
        values: Vec<f32>,
        state: u64,
    }

    impl FrameMethod for Memory {
        fn size(&self) -> [u32; 2] {
            [40, 30]
        }

        fn render_frame(&mut self, _: u32, _: u64, image: &mut [Rgb], _: &AtomicBool) -> Option<RayCounts> {
            self.values.resize(image.len(), 0.0);
            for (value, pixel) in self.values.iter_mut().zip(image) {
                let step = self.state.wrapping_mul(6_364_136_223_846_793_005);
                self.state = step.wrapping_add(1_442_695_040_888_963_407);
                let noise = (self.state >> 40) as f32 / (1u64 << 24) as f32 - 0.5;
                *value = self.share * *value + noise;
                *pixel = Rgb::splat(1.0 + *value);
            }
            Some(RayCounts::default())
        }
    }

    /// 1,200 pixels of 400 frames: standard error of `ρ₁` about 0.0014; the mean of a series
    /// taken off makes it some `τ/400` too low.
    #[test]
    fn autocorrelation_is_that_of_an_autoregression() {
        for share in [0.0f32, 0.5, 0.8] {
            let mut method = Memory {
                share,
                values: Vec::new(),
                state: 5,
            };
            let study = TemporalStudy::run(&mut method, 20, 400, 0, &AtomicBool::new(false)).unwrap();
            let found = study.autocorrelation(60);
            let share = f64::from(share);
            let time = (1.0 + share) / (1.0 - share);
            for lag in 0..4 {
                let expected = share.powi(lag as i32);
                assert!(
                    (found.by_lag[lag] - expected).abs() < 0.01 + time / 400.0,
                    "{lag}: {found:?}"
                );
            }
            assert!(
                (found.time / time - 1.0).abs() < 0.12,
                "{} for {time}",
                found.time
            );
            let slice = study.slice().unwrap();
            assert_eq!((slice.width(), slice.height(), study.row()), (40, 400, 15));
        }
    }

    #[test]
    fn constant_frames_and_single_ones() {
        let mut method = Memory {
            share: 0.0,
            values: Vec::new(),
            state: 5,
        };
        let cancel = AtomicBool::new(false);
        assert!(TemporalStudy::run(&mut method, 0, 1, 0, &cancel).is_err());
        let study = TemporalStudy {
            size: [1, 1],
            frames: vec![vec![1.0]; 3],
            slice: vec![[1.0; 3]; 3],
            row: 0,
        };
        assert_eq!(study.autocorrelation(9).time, 1.0);
    }

    /// Noise averaged over `WIDTH` pixels of a row, around a picture that does not move, in an
    /// autoregression over frames.
    struct Blotches {
        share: f64,
        values: Vec<f64>,
    }

    const WIDTH: usize = 3;

    impl FrameMethod for Blotches {
        fn size(&self) -> [u32; 2] {
            [60, 40]
        }

        fn render_frame(
            &mut self,
            frame: u32,
            _: u64,
            image: &mut [Rgb],
            _: &AtomicBool,
        ) -> Option<RayCounts> {
            let noise: Vec<f64> = (0..image.len() + WIDTH)
                .map(|pixel| f64::from(CounterRng::new(3, pixel as u32, frame).next_f32()) - 0.5)
                .collect();
            self.values.resize(image.len(), 0.0);
            for (pixel, value) in self.values.iter_mut().enumerate() {
                let blotch: f64 = noise[pixel..pixel + WIDTH].iter().sum();
                *value = self.share * *value + blotch;
                image[pixel] = Rgb::splat((*value + pixel as f64 / 50.0) as f32);
            }
            Some(RayCounts::default())
        }
    }

    /// In closed form: a variance of `3/12 / (1 − s²)`, `s^k` of it over frames, `1 − d/3` of
    /// it along rows and nothing along columns. 2,400 pixels of 300 frames: standard errors below
    /// 0.01 of the variance.
    #[test]
    fn autocovariance_is_that_of_blotches() {
        for share in [0.0f64, 0.6] {
            let mut method = Blotches {
                share,
                values: Vec::new(),
            };
            let study = TemporalStudy::run(&mut method, 20, 300, 0, &AtomicBool::new(false)).unwrap();
            let found = study.autocovariance(4, 5);
            let variance = WIDTH as f64 / 12.0 / (1.0 - share * share);
            for (lag, covariance) in found.in_time.iter().enumerate() {
                let expected = variance * share.powi(lag as i32);
                assert!(
                    (covariance - expected).abs() < 0.02 * variance,
                    "{lag}: {found:?}"
                );
            }
            for (distance, covariance) in found.in_space.iter().enumerate() {
                let along_row = (1.0 - distance as f64 / WIDTH as f64).max(0.0);
                let along_column = if distance == 0 { 1.0 } else { 0.0 };
                let rows = ((60 - distance) * 40) as f64;
                let columns = ((40 - distance) * 60) as f64;
                let expected = variance * (along_row * rows + along_column * columns) / (rows + columns);
                assert!(
                    (covariance - expected).abs() < 0.02 * variance,
                    "{distance}: {found:?}"
                );
            }
            assert!(found.in_space[1] < 0.5 * found.in_space[0]);
        }
    }
}
