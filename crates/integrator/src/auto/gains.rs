//! What sharing paths brings a frame.

use crate::path::reuse::PixelGain;

/// How much greater the squared error of a frame would be if it shared no path, pixel by pixel.
pub(super) struct Gains(Vec<f64>);

impl Gains {
    /// By the accounts of two images of `frames` frames each. The variance of a path that is not
    /// shared is its second moment less the square of its mean, of which two independent images
    /// give an unbiased product.
    pub fn of([one, other]: &[Vec<PixelGain>; 2], frames: u32) -> Self {
        let frames = f64::from(frames);
        let of_pixel = |(one, other): (&PixelGain, &PixelGain)| {
            let (a, b) = (one.shared.to_array(), other.shared.to_array());
            let products = a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(b));
            let square = products.sum::<f64>() / (3.0 * frames * frames);
            let moments = f64::from(one.second_moment) + f64::from(other.second_moment);
            moments / (2.0 * frames) - square
        };
        Self(one.iter().zip(other).map(of_pixel).collect())
    }

    /// The mean over pixels with these weights; nothing if chance makes it negative.
    pub fn mean(&self, weight: impl Fn(usize) -> f64) -> f64 {
        let gains = self.0.iter().enumerate();
        let sum: f64 = gains.map(|(pixel, gain)| gain * weight(pixel)).sum();
        (sum / self.0.len().max(1) as f64).max(0.0)
    }
}
