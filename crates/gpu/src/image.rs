//! Results from the device.

use bytemuck::{Pod, Zeroable};

/// Sums over the samples of a pixel.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PixelSums {
    pub sum: [f32; 3],
    pub count: u32,
    pub sum_low: [f32; 3],
    pub padding0: u32,
    pub squares: [f32; 3],
    pub padding1: u32,
}

/// An image, with the uncertainty of its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct GpuImage {
    size: [u32; 2],
    count: u32,
    mean: Vec<[f32; 3]>,
    variance: Vec<[f32; 3]>,
}

impl GpuImage {
    pub(crate) fn from_sums(size: [u32; 2], sums: &[PixelSums]) -> Self {
        let count = sums.first().map_or(0, |pixel| pixel.count);
        let n = f64::from(count.max(1));
        let total = |pixel: &PixelSums, c: usize| f64::from(pixel.sum[c]) + f64::from(pixel.sum_low[c]);
        let mean = |pixel: &PixelSums| core::array::from_fn(|c| (total(pixel, c) / n) as f32);
        let variance = |pixel: &PixelSums| {
            core::array::from_fn(|c| {
                let mean = total(pixel, c) / n;
                let spread = (f64::from(pixel.squares[c]) - n * mean * mean).max(0.0);
                (spread / (n - 1.0).max(1.0)) as f32
            })
        };
        Self {
            size,
            count,
            mean: sums.iter().map(mean).collect(),
            variance: sums.iter().map(variance).collect(),
        }
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Samples of each pixel.
    pub fn samples(&self) -> u32 {
        self.count
    }

    /// Mean of each pixel's samples, row by row.
    pub fn mean(&self) -> &[[f32; 3]] {
        &self.mean
    }

    /// Variance of one sample of each pixel, estimated from all of its samples; sums of squares are
    /// `f32`, so it has about four digits.
    pub fn variance(&self) -> &[[f32; 3]] {
        &self.variance
    }
}
