//! A rendering as the image comparisons of the testkit want it.

use lightshed_film::{Budget, Film, PixelEstimator, RenderOptions, render};
use lightshed_testkit::{ImageMoments, TileOptions, compare_tiles};
use std::sync::atomic::AtomicBool;

/// Means of pixels, rows after each other from the top, channels interleaved, and the variances of
/// these means.
pub struct Rendered {
    width: usize,
    pub mean: Vec<f64>,
    pub variance_of_mean: Vec<f64>,
    samples_per_pixel: u64,
}

impl Rendered {
    /// Renders with every processor. A sample that is not finite panics.
    pub fn new<E: PixelEstimator>(
        estimator: &E,
        [width, height]: [u32; 2],
        samples_per_pixel: u32,
        seed: u64,
    ) -> Self {
        let mut options = RenderOptions::new(width, height, Budget::Samples(samples_per_pixel));
        options.seed = seed;
        let film = render(estimator, &options, &|_| (), &AtomicBool::new(false))
            .unwrap()
            .film;
        Self::of(&film, [width, height], samples_per_pixel)
    }

    /// What a film of this size holds.
    pub fn of(film: &Film, [width, height]: [u32; 2], samples_per_pixel: u32) -> Self {
        assert_eq!(film.non_finite(), 0, "samples that are not finite");
        let (mut mean, mut variance_of_mean) = (Vec::new(), Vec::new());
        for y in 0..height {
            for x in 0..width {
                let pixel = film.get(x, y).unwrap();
                mean.extend(pixel.mean());
                variance_of_mean.extend(pixel.variance_of_mean().unwrap_or_default());
            }
        }
        Self {
            width: width as usize,
            mean,
            variance_of_mean,
            samples_per_pixel: u64::from(samples_per_pixel),
        }
    }

    pub fn moments(&self) -> ImageMoments<'_> {
        ImageMoments {
            width: self.width,
            channels: 3,
            mean: &self.mean,
            variance_of_mean: &self.variance_of_mean,
            samples_per_pixel: self.samples_per_pixel,
        }
    }
}

/// False-positive rate of a comparison.
const SIGNIFICANCE: f64 = 1e-5;

/// Whether the tiles of two images agree, each channel apart.
pub fn compare(found: &Rendered, expected: &Rendered, tile_size: usize) -> Result<(), String> {
    let options = TileOptions {
        significance: SIGNIFICANCE,
        tile_size,
        ..TileOptions::default()
    };
    let report = compare_tiles(&found.moments(), &expected.moments(), &options).map_err(|e| e.to_string())?;
    report.verdict().map_err(|e| e.to_string())
}
