//! The interface between the render loop and methods with independent pixels.

use lightshed_sampling::Rgb;

/// Something that estimates the value of a pixel by independent samples.
///
/// With box reconstruction the value of pixel `(x, y)` is `I = ∫ L(u) du` over the pixel's unit
/// square, and `E[sample(x, y, s, seed)] = I` for every `s`. The result is a function of the four
/// arguments alone. So an image does not depend on the number of threads, and any sample can be
/// repeated by itself.
pub trait PixelEstimator: Sync {
    /// Sample number `sample_index` of the pixel in column `x` of row `y` (row 0 at the top).
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb;

    /// Many samples at once: `values[i]` becomes what [`PixelEstimator::sample`] returns for
    /// `ids[i]`, bit for bit. The length of the shorter slice counts. An estimator that is faster
    /// for many samples, as ray tracing is, overrides it.
    #[inline]
    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        for (id, value) in ids.iter().zip(values) {
            *value = self.sample(id.x, id.y, id.index, seed);
        }
    }
}

/// Names one sample of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SampleId {
    /// Column of the pixel.
    pub x: u32,
    /// Row of the pixel, 0 at the top.
    pub y: u32,
    /// Number of the sample within the pixel.
    pub index: u32,
}

/// Samples that [`render`](crate::render) asks an estimator for at once, at most.
pub const MAX_BATCH: usize = 64;

impl<E: PixelEstimator + ?Sized> PixelEstimator for &E {
    #[inline]
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        (**self).sample(x, y, sample_index, seed)
    }

    #[inline]
    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        (**self).sample_many(ids, seed, values);
    }
}

impl<E: PixelEstimator + ?Sized> PixelEstimator for Box<E> {
    #[inline]
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        (**self).sample(x, y, sample_index, seed)
    }

    #[inline]
    fn sample_many(&self, ids: &[SampleId], seed: u64, values: &mut [Rgb]) {
        (**self).sample_many(ids, seed, values);
    }
}
