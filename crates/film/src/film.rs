//! The film: statistics of every pixel, handed out in disjoint tiles.

use crate::image::pixel_count;
use crate::{ImageError, PixelStatistics, RgbImage};
use lightshed_sampling::{Rgb, parallel};
use std::fmt;

/// Side of a film's tiles in pixels; those at the right and bottom edge may be smaller.
///
/// Small enough that many threads find work in a small image and do not wait long for the last
/// tiles of a pass; large enough that distributing a tile costs nothing compared with its 64
/// pixels.
pub const TILE_SIZE: u32 = 8;

/// Statistics of every pixel of an image under box reconstruction: a sample belongs to the pixel it
/// was drawn in, and the pixel's value `I = ∫_pixel L dA / A_pixel` is estimated by the mean of
/// its samples.
///
/// Pixels are stored tile by tile, so that [`Film::tiles_mut`] returns disjoint slices and threads
/// accumulate without locks. For any number of threads, a pixel's statistics depend on the order of
/// its own samples only.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    pixels: Vec<PixelStatistics>,
}

/// A tile of a [`Film`]: the pixels of columns `x .. x + width` of rows `y .. y + height`, row by
/// row.
#[derive(Debug)]
pub struct FilmTile<'a> {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
    pixels: &'a mut [PixelStatistics],
}

/// Figures of all pixels of a [`Film`] together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmTotals {
    /// Finite samples: [`Film::samples`].
    pub samples: u64,
    /// Samples left out: [`Film::non_finite`].
    pub non_finite: u64,
    /// Mean of the image: that of [`Film::mean_image`].
    pub mean: [f64; 3],
}

/// Sums that become [`FilmTotals`], of films that are parts of one from the top.
#[derive(Debug)]
pub(crate) struct TotalsSum {
    totals: FilmTotals,
    /// Least and greatest number of samples, finite or not, of a pixel.
    counts: [u64; 2],
    pixels: usize,
}

impl Default for TotalsSum {
    fn default() -> Self {
        Self {
            totals: FilmTotals::default(),
            counts: [u64::MAX, 0],
            pixels: 0,
        }
    }
}

impl TotalsSum {
    /// Adds the pixels of a film.
    fn add(&mut self, film: &Film) {
        let width = film.width as usize;
        for band in film.bands() {
            // In the order of memory, after which the band is in the cache for the order of rows,
            // in which the image's mean is summed.
            for pixel in band {
                self.add_counts(pixel.count(), pixel.non_finite(), 1);
            }
            let pixels = (0..band.len() / width).flat_map(|y| row_of_band(band, width, y).flatten());
            self.add_means(pixels.map(|pixel| narrowed(pixel.mean())));
        }
    }

    /// Adds `pixels` pixels, each of `count` finite samples and `non_finite` others.
    #[inline]
    pub(crate) fn add_counts(&mut self, count: u64, non_finite: u64, pixels: usize) {
        let [least, most] = &mut self.counts;
        let samples = count + non_finite;
        (*least, *most) = (samples.min(*least), samples.max(*most));
        self.totals.samples += count * pixels as u64;
        self.totals.non_finite += non_finite * pixels as u64;
        self.pixels += pixels;
    }

    /// Adds the means of pixels, row after row.
    #[inline]
    pub(crate) fn add_means(&mut self, means: impl Iterator<Item = [f32; 3]>) {
        let mut sums = self.totals.mean;
        for mean in means {
            (0..3).for_each(|channel| sums[channel] += f64::from(mean[channel]));
        }
        self.totals.mean = sums;
    }

    /// The totals, and the least and the greatest number of samples of a pixel.
    pub(crate) fn finish(self) -> (FilmTotals, [u64; 2]) {
        let count = self.pixels as f64;
        let mean = self.totals.mean.map(|sum| sum / count);
        (FilmTotals { mean, ..self.totals }, self.counts)
    }
}

/// Two films of different size cannot be merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmSizeError {
    /// Width and height of the film merged into.
    pub into: [u32; 2],
    /// Width and height of the film that was to be merged.
    pub from: [u32; 2],
}

impl fmt::Display for FilmSizeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([w, h], [other_w, other_h]) = (self.into, self.from);
        write!(
            f,
            "a film of {other_w}x{other_h} pixels cannot be merged into one of {w}x{h}"
        )
    }
}

impl std::error::Error for FilmSizeError {}

impl Film {
    /// A film without samples.
    ///
    /// # Errors
    ///
    /// A zero side, more than [`MAX_PIXELS`](crate::MAX_PIXELS) pixels, or more than memory holds.
    pub fn new(width: u32, height: u32) -> Result<Self, ImageError> {
        let count = pixel_count(width, height)?;
        let mut pixels = Vec::new();
        if pixels.try_reserve_exact(count).is_err() {
            return Err(ImageError::TooLarge { width, height });
        }
        pixels.resize(count, PixelStatistics::default());
        Ok(Self {
            width,
            height,
            pixels,
        })
    }

    /// Width in pixels.
    #[inline]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[inline]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Statistics of the pixel in column `x` of row `y`; `None` outside the film.
    #[inline]
    pub fn get(&self, x: u32, y: u32) -> Option<&PixelStatistics> {
        (x < self.width && y < self.height).then(|| &self.pixels[self.index(x, y)])
    }

    /// Adds a sample to the pixel in column `x` of row `y`; ignores a pixel outside the film.
    #[inline]
    pub fn add(&mut self, x: u32, y: u32, sample: Rgb) {
        if x < self.width && y < self.height {
            let index = self.index(x, y);
            self.pixels[index].add(sample);
        }
    }

    /// Adds a sample to each pixel: those of an image of the film's size, row by row. Bands of
    /// tiles go to the threads of the current pool.
    pub(crate) fn add_image(&mut self, image: &[Rgb]) {
        let (width, side) = (self.width as usize, TILE_SIZE as usize);
        let rows = image.chunks(width * side);
        parallel::for_each(self.bands_mut().zip(rows), |_, (band, rows)| {
            // Tile by tile, as pixels are stored.
            let mut pixels = band.iter_mut();
            for left in (0..width).step_by(side) {
                let columns = left..width.min(left + side);
                for row in rows.chunks_exact(width) {
                    // The samples first: after the last of them no pixel is taken.
                    for (&sample, pixel) in row[columns.clone()].iter().zip(&mut pixels) {
                        pixel.add(sample);
                    }
                }
            }
        });
    }

    /// Storage index of a pixel inside the film.
    #[inline]
    fn index(&self, x: u32, y: u32) -> usize {
        let tile_y = y - y % TILE_SIZE;
        let (width, rows) = (self.width as usize, TILE_SIZE.min(self.height - tile_y) as usize);
        // Whole bands of tiles above.
        tile_y as usize * width + index_in_band(width, rows, x as usize, (y - tile_y) as usize)
    }

    /// Leaves out the rows from `height` on.
    pub(crate) fn cut(&mut self, height: u32) {
        self.height = self.height.min(height);
        self.pixels.truncate(self.width as usize * self.height as usize);
    }

    /// Forgets all samples.
    pub(crate) fn clear(&mut self) {
        self.pixels.fill(PixelStatistics::default());
    }

    /// The pixels of every band of [`TILE_SIZE`] rows, from the top; [`index_in_band`] gives the
    /// index of a pixel within a band.
    pub(crate) fn bands(&self) -> impl Iterator<Item = &[PixelStatistics]> {
        self.pixels.chunks(self.width as usize * TILE_SIZE as usize)
    }

    /// [`Film::bands`] to write to.
    pub(crate) fn bands_mut(&mut self) -> impl Iterator<Item = &mut [PixelStatistics]> {
        self.pixels.chunks_mut(self.width as usize * TILE_SIZE as usize)
    }

    /// Column, row and number of samples, finite or not, of the first pixel that has not had
    /// `samples`.
    pub(crate) fn first_pixel_without(&self, samples: u64) -> Option<(u32, u32, u64)> {
        let of = |pixel: &PixelStatistics| pixel.count() + pixel.non_finite();
        let places = (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y)));
        let mut counts = places.map(|(x, y)| (x, y, of(&self.pixels[self.index(x, y)])));
        counts.find(|&(_, _, count)| count != samples)
    }

    /// All tiles, from the top left in rows. They share no pixel, so each may go to its own thread.
    pub fn tiles_mut(&mut self) -> Vec<FilmTile<'_>> {
        self.tiles_of_rows_from(0)
    }

    /// [`Film::tiles_mut`] of a film whose first row is row `top` of the image, a multiple of
    /// [`TILE_SIZE`].
    pub(crate) fn tiles_of_rows_from(&mut self, top: u32) -> Vec<FilmTile<'_>> {
        let (film_width, film_height) = (self.width, self.height);
        let mut rest = self.pixels.as_mut_slice();
        let mut tiles =
            Vec::with_capacity((film_width.div_ceil(TILE_SIZE) * film_height.div_ceil(TILE_SIZE)) as usize);
        for y in (0..film_height).step_by(TILE_SIZE as usize) {
            let height = TILE_SIZE.min(film_height - y);
            for x in (0..film_width).step_by(TILE_SIZE as usize) {
                let width = TILE_SIZE.min(film_width - x);
                let (pixels, after) = rest.split_at_mut((width * height) as usize);
                rest = after;
                tiles.push(FilmTile {
                    x,
                    y: top + y,
                    width,
                    height,
                    pixels,
                });
            }
        }
        tiles
    }

    /// Adds all samples of `other`: the same as having drawn both films' samples on one, up to
    /// rounding.
    ///
    /// # Errors
    ///
    /// The films differ in size; nothing has been added then.
    pub fn merge(&mut self, other: &Self) -> Result<(), FilmSizeError> {
        let (into, from) = ([self.width, self.height], [other.width, other.height]);
        if into != from {
            return Err(FilmSizeError { into, from });
        }
        for (pixel, other) in self.pixels.iter_mut().zip(&other.pixels) {
            pixel.merge(other);
        }
        Ok(())
    }

    /// Number of samples, over all pixels, left out because a channel was NaN or infinite.
    pub fn non_finite(&self) -> u64 {
        self.pixels.iter().map(PixelStatistics::non_finite).sum()
    }

    /// Number of finite samples over all pixels.
    pub fn samples(&self) -> u64 {
        self.pixels.iter().map(PixelStatistics::count).sum()
    }

    /// Number of samples and mean of the image, by one walk over the pixels and without the image.
    pub fn totals(&self) -> FilmTotals {
        self.totals_with_counts().0
    }

    /// The totals, and the least and the greatest number of samples, finite or not, of a pixel.
    pub(crate) fn totals_with_counts(&self) -> (FilmTotals, [u64; 2]) {
        let mut totals = TotalsSum::default();
        totals.add(self);
        totals.finish()
    }

    /// The estimate of the image: each pixel's mean, black where it has no sample.
    pub fn mean_image(&self) -> RgbImage {
        self.image(|statistics| statistics.mean())
    }

    /// Variance of each pixel's mean, for independent samples; `None` if a pixel has fewer than
    /// two.
    ///
    /// A variance beyond the range of `f32` becomes [`f32::MAX`].
    pub fn variance_of_mean(&self) -> Option<RgbImage> {
        let known = self.pixels.iter().all(|statistics| statistics.count() >= 2);
        known.then(|| self.image(|statistics| statistics.variance_of_mean().unwrap_or_default()))
    }

    /// An image of a finite value of each pixel, kept within the range of `f32`.
    fn image(&self, value: impl Fn(&PixelStatistics) -> [f64; 3]) -> RgbImage {
        RgbImage::from_fn(self.width, self.height, |x, y| {
            narrowed(value(&self.pixels[self.index(x, y)]))
        })
        .expect("a film's size is valid and its statistics are finite")
    }
}

/// Finite values, kept within the range of `f32`.
#[inline]
pub(crate) fn narrowed<const N: usize>(values: [f64; N]) -> [f32; N] {
    values.map(|value| (value as f32).clamp(f32::MIN, f32::MAX))
}

/// Index of the pixel in column `x` of a band's row `y` within the band of `rows` rows of a film of
/// `width` columns.
#[inline]
pub(crate) fn index_in_band(width: usize, rows: usize, x: usize, y: usize) -> usize {
    let side = TILE_SIZE as usize;
    let tile_x = x - x % side;
    let tile_width = side.min(width - tile_x);
    // Whole tiles to the left, whole rows of the tile, pixels of the row.
    tile_x * rows + y * tile_width + (x - tile_x)
}

/// The pixels of row `y` of a band of a film of `width` columns, tile by tile from the left.
pub(crate) fn row_of_band(
    band: &[PixelStatistics],
    width: usize,
    y: usize,
) -> impl Iterator<Item = &[PixelStatistics]> {
    let rows = band.len() / width;
    band.chunks(TILE_SIZE as usize * rows).map(move |tile| {
        let columns = tile.len() / rows;
        &tile[y * columns..][..columns]
    })
}

impl FilmTile<'_> {
    /// Column of the left pixels.
    #[inline]
    pub fn x(&self) -> u32 {
        self.x
    }

    /// Row of the top pixels.
    #[inline]
    pub fn y(&self) -> u32 {
        self.y
    }

    /// Width in pixels.
    #[inline]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[inline]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Column and row in the film, and statistics, of each pixel.
    #[inline]
    pub fn pixels_mut(&mut self) -> impl Iterator<Item = (u32, u32, &mut PixelStatistics)> {
        let (x, y, width) = (self.x, self.y, self.width);
        let place = move |(index, statistics): (usize, _)| {
            let index = index as u32;
            (x + index % width, y + index / width, statistics)
        };
        self.pixels.iter_mut().enumerate().map(place)
    }

    /// Makes this tile what `other`, the same tile of a film of the same size, is.
    pub(crate) fn copy_from(&mut self, other: &FilmTile<'_>) {
        self.pixels.copy_from_slice(other.pixels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: [(u32, u32); 6] = [(1, 1), (8, 8), (9, 7), (16, 24), (37, 19), (5, 100)];

    #[test]
    fn every_pixel_lies_in_one_tile_and_where_get_finds_it() {
        for (width, height) in SIZES {
            let mut film = Film::new(width, height).unwrap();
            let mut seen = 0;
            for mut tile in film.tiles_mut() {
                assert!(tile.width() <= TILE_SIZE && tile.height() <= TILE_SIZE);
                let (left, top) = (tile.x(), tile.y());
                let (right, bottom) = (left + tile.width(), top + tile.height());
                for (x, y, statistics) in tile.pixels_mut() {
                    assert!((left..right).contains(&x) && (top..bottom).contains(&y));
                    assert_eq!(statistics.count(), 0, "a pixel in two tiles");
                    statistics.add(Rgb::new(x as f32, y as f32, 1.0));
                    seen += 1;
                }
            }
            assert_eq!(seen, u64::from(width) * u64::from(height));
            assert_eq!(film.samples(), seen);
            for y in 0..height {
                for x in 0..width {
                    assert_eq!(film.get(x, y).unwrap().mean(), [f64::from(x), f64::from(y), 1.0]);
                }
            }
            let columns = width as usize;
            let rows: Vec<&PixelStatistics> = film
                .bands()
                .flat_map(|band| (0..band.len() / columns).map(move |y| row_of_band(band, columns, y)))
                .flatten()
                .flatten()
                .collect();
            let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            let expected: Vec<_> = places.filter_map(|(x, y)| film.get(x, y)).collect();
            assert_eq!(rows, expected);
            let image = film.mean_image();
            let totals = FilmTotals {
                samples: seen,
                non_finite: 0,
                mean: image.mean(),
            };
            assert_eq!(film.totals_with_counts(), (totals, [1, 1]));
            assert_eq!(
                image.get(width - 1, height - 1),
                Some([(width - 1) as f32, (height - 1) as f32, 1.0])
            );
            assert!(film.get(width, 0).is_none() && film.get(0, height).is_none());
        }
    }

    #[test]
    fn merged_films_are_one_film() {
        let sample =
            |x: u32, y: u32, s: u32| Rgb::new(1e4 + ((x * 7 + y * 13 + s * 5) % 11) as f32, s as f32, 0.0);
        let (width, height) = (13, 10);
        let mut whole = Film::new(width, height).unwrap();
        let mut parts: Vec<Film> = (0..3).map(|_| Film::new(width, height).unwrap()).collect();
        for s in 0..30 {
            for y in 0..height {
                for x in 0..width {
                    whole.add(x, y, sample(x, y, s));
                    parts[(s % 3) as usize].add(x, y, sample(x, y, s));
                }
            }
        }
        for order in [[0, 1, 2], [2, 0, 1]] {
            let mut merged = Film::new(width, height).unwrap();
            for part in order {
                merged.merge(&parts[part]).unwrap();
            }
            assert_eq!(merged.mean_image(), whole.mean_image());
            let (found, expected) = (
                merged.variance_of_mean().unwrap(),
                whole.variance_of_mean().unwrap(),
            );
            for (found, expected) in found
                .pixels()
                .iter()
                .flatten()
                .zip(expected.pixels().iter().flatten())
            {
                approx::assert_relative_eq!(found, expected, max_relative = 1e-6);
            }
        }
        let error = whole.merge(&Film::new(13, 11).unwrap()).unwrap_err();
        assert_eq!((error.into, error.from), ([13, 10], [13, 11]));
    }

    #[test]
    fn variance_needs_two_samples_in_every_pixel_and_saturates() {
        let mut film = Film::new(2, 1).unwrap();
        for (x, value) in [(0, 1.0), (0, 3.0), (1, f32::MAX), (1, f32::MIN)] {
            assert!(film.variance_of_mean().is_none());
            film.add(x, 0, Rgb::splat(value));
        }
        film.add(1, 0, Rgb::splat(f32::NAN));
        film.add(2, 0, Rgb::ONE);
        let variance = film.variance_of_mean().unwrap();
        assert_eq!(variance.pixels(), [[1.0; 3], [f32::MAX; 3]]);
        assert_eq!((film.samples(), film.non_finite()), (4, 1));
        assert_eq!((film.totals().samples, film.totals().non_finite), (4, 1));
    }

    #[test]
    fn impossible_sizes_are_errors() {
        assert!(matches!(Film::new(0, 4), Err(ImageError::Empty { .. })));
        assert!(matches!(
            Film::new(1 << 20, 1 << 20),
            Err(ImageError::TooLarge { .. })
        ));
    }
}
