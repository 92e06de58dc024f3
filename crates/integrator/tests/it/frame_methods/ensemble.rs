//! Ensembles of independent chains of frames against plain estimators, by tiles.
//!
//! Pixels of a frame with reuse are correlated, so their variances do not add up to that of a tile.
//! Each chain therefore counts as *one* sample of each tile's mean and of the image's; chains of
//! different seeds are independent.

use lightshed_film::{FrameMethod, PixelEstimator, SampleId};
use lightshed_scene::Rgb;
use lightshed_testkit::{ImageMoments, MeanTest, TileOptions, compare_tiles};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

/// Edge of the tiles, in pixels: of small images, and of others.
fn tile(width: u32) -> usize {
    if width < 100 { 8 } else { 16 }
}

/// Means of tiles and, last, of the whole image, channels interleaved, over independent images; and
/// the variances of these means.
pub struct Ensemble {
    mean: Vec<f64>,
    variance_of_mean: Vec<f64>,
    images: u64,
    across: usize,
}

/// How far two ensembles are apart.
#[derive(Debug)]
pub struct Agreement {
    /// Tiles times channels.
    pub tiles: usize,
    /// Normal-equivalent score of the tile (and channel) that is off most.
    pub worst_tile: f64,
    /// Tiles (and channels) beyond 4.
    pub outliers: usize,
    /// Of the image, by channel: relative difference, its standard error and its score.
    pub whole: Vec<[f64; 3]>,
}

impl Ensemble {
    /// The mean of the frames `counted` of `chains` chains, seeds from `seed` on. Frames of a chain
    /// are alike, but not quite: those whose expectation is asked for count together.
    pub fn of_chains<M: FrameMethod>(
        make: impl Fn() -> M + Sync,
        counted: Range<u32>,
        chains: u64,
        seed: u64,
    ) -> Self {
        let size = make().size();
        let pixels = size[0] as usize * size[1] as usize;
        let images: Vec<Vec<Rgb>> = (0..chains)
            .into_par_iter()
            .map(|chain| {
                let (mut method, mut image) = (make(), vec![Rgb::ZERO; pixels]);
                let mut sum = vec![Rgb::ZERO; pixels];
                for frame in 0..counted.end {
                    let counts =
                        method.render_frame(frame, seed + chain, &mut image, &AtomicBool::new(false));
                    assert!(counts.is_some_and(|rays| rays.camera > 0), "frame {frame}");
                    if counted.contains(&frame) {
                        sum.iter_mut().zip(&image).for_each(|(sum, value)| *sum += value);
                    }
                }
                let count = counted.len() as f32;
                sum.iter_mut().for_each(|value| *value /= count);
                sum
            })
            .collect();
        Self::of_images(size, &images)
    }

    /// Images of an estimator with `samples` samples in each pixel.
    pub fn of_estimator(estimator: &impl PixelEstimator, size: [u32; 2], samples: u32, images: u32) -> Self {
        Self::of_seeded_estimator(estimator, size, samples, images, 0x5eed_0000)
    }

    /// The same with other random numbers: for estimators that are compared with each other.
    pub fn of_seeded_estimator(
        estimator: &impl PixelEstimator,
        [width, height]: [u32; 2],
        samples: u32,
        images: u32,
        seed: u64,
    ) -> Self {
        let render = |image: u32| {
            let pixel = |index: u32| {
                let id = |sample| SampleId {
                    x: index % width,
                    y: index / width,
                    index: image * samples + sample,
                };
                let ids: Vec<SampleId> = (0..samples).map(id).collect();
                let mut values = vec![Rgb::ZERO; ids.len()];
                estimator.sample_many(&ids, seed, &mut values);
                values.into_iter().sum::<Rgb>() / samples as f32
            };
            (0..width * height).map(pixel).collect::<Vec<Rgb>>()
        };
        let images: Vec<Vec<Rgb>> = (0..images).into_par_iter().map(render).collect();
        Self::of_images([width, height], &images)
    }

    fn of_images([width, height]: [u32; 2], images: &[Vec<Rgb>]) -> Self {
        let (tile, width, height) = (tile(width), width as usize, height as usize);
        let across = width.div_ceil(tile);
        let whole = across * height.div_ceil(tile);
        let mut moments = vec![MeanTest::new(); (whole + 1) * 3];
        for image in images {
            let mut sums = vec![[0.0f64; 4]; whole + 1];
            for (index, value) in image.iter().enumerate() {
                assert!(value.is_finite(), "pixel {index} is {value}");
                let (x, y) = (index % width, index / width);
                for part in [y / tile * across + x / tile, whole] {
                    let [red, green, blue] = value.to_array().map(f64::from);
                    for (sum, value) in sums[part].iter_mut().zip([red, green, blue, 1.0]) {
                        *sum += value;
                    }
                }
            }
            for ([red, green, blue, pixels], moments) in sums.into_iter().zip(moments.chunks_exact_mut(3)) {
                for (moments, sum) in moments.iter_mut().zip([red, green, blue]) {
                    moments.push(sum / pixels);
                }
            }
        }
        let images = images.len() as u64;
        Self {
            mean: moments.iter().map(MeanTest::mean).collect(),
            variance_of_mean: moments.iter().map(|m| m.variance() / images as f64).collect(),
            images,
            across,
        }
    }

    fn part(&self, range: Range<usize>, width: usize) -> ImageMoments<'_> {
        ImageMoments {
            width,
            channels: 3,
            mean: &self.mean[range.clone()],
            variance_of_mean: &self.variance_of_mean[range],
            samples_per_pixel: self.images,
        }
    }

    /// Scores of the differences.
    pub fn compare(&self, other: &Self) -> Agreement {
        // A tile is a pixel here. Where nothing but a constant sky is seen, sums differ by their
        // rounding alone.
        let options = TileOptions {
            tile_size: 1,
            relative_tolerance: 1e-5,
            ..TileOptions::default()
        };
        let compare = |range: Range<usize>, width| {
            let parts = [self, other].map(|ensemble| ensemble.part(range.clone(), width));
            compare_tiles(&parts[0], &parts[1], &options).unwrap()
        };
        let tiles = self.mean.len() - 3;
        let by_tile = compare(0..tiles, self.across);
        let whole = compare(tiles..tiles + 3, 1);
        Agreement {
            tiles,
            worst_tile: by_tile.worst().map_or(0.0, |tile| tile.z.abs()),
            outliers: by_tile.outliers,
            whole: whole
                .channels
                .iter()
                .map(|c| [c.ratio - 1.0, c.standard_error, c.z])
                .collect(),
        }
    }
}

impl Agreement {
    /// Whether chance explains what was found: with a false-positive rate of at most 3·10⁻⁵,
    /// from a tile beyond 5.5 (4·10⁻⁸ each, of at most 420), four beyond 4 (420 · 6·10⁻⁵
    /// are expected, correlated between channels) or a mean beyond 4.6 (4·10⁻⁶ each).
    pub fn verdict(&self) -> Result<(), String> {
        assert!(self.tiles <= 420, "the rate is stated for fewer");
        let sound =
            self.worst_tile < 5.5 && self.outliers <= 3 && self.whole.iter().all(|[_, _, z]| z.abs() < 4.6);
        if sound { Ok(()) } else { Err(format!("{self:?}")) }
    }
}
