//! All metrics at once.

use super::{
    MetricError, mean_absolute_percentage_error, mean_squared_error, relative_mean,
    relative_mean_squared_error, structural_similarity,
};
use crate::RgbImage;

/// Every metric of an image against a reference; `None` where one is not defined for these images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageComparison {
    /// [`mean_squared_error`].
    pub mse: f64,
    /// [`relative_mean_squared_error`].
    pub relative_mse: f64,
    /// [`mean_absolute_percentage_error`]; `None` for a black reference.
    pub mape: Option<f64>,
    /// [`structural_similarity`]; `None` for images smaller than its window.
    pub ssim: Option<f64>,
    /// The mean ꟻLIP error; `None` without the feature `flip`.
    pub flip: Option<f64>,
    /// [`relative_mean`] of each channel.
    pub relative_mean: [Option<f64>; 3],
}

impl ImageComparison {
    /// Compares `image` with `reference`.
    ///
    /// # Errors
    ///
    /// The images differ in size.
    pub fn new(image: &RgbImage, reference: &RgbImage) -> Result<Self, MetricError> {
        let defined = |metric: Result<f64, MetricError>| match metric {
            Ok(value) => Ok(Some(value)),
            Err(error @ MetricError::Size { .. }) => Err(error),
            Err(_) => Ok(None),
        };
        Ok(Self {
            mse: mean_squared_error(image, reference)?,
            relative_mse: relative_mean_squared_error(image, reference)?,
            mape: defined(mean_absolute_percentage_error(image, reference))?,
            ssim: defined(structural_similarity(image, reference))?,
            #[cfg(feature = "flip")]
            flip: Some(super::flip(image, reference)?),
            #[cfg(not(feature = "flip"))]
            flip: None,
            relative_mean: relative_mean(image, reference)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_each_metric_and_leaves_out_undefined_ones() {
        let image = |width, value: f32| RgbImage::from_fn(width, 12, |x, _| [value + x as f32; 3]).unwrap();
        let (i, r) = (image(16, 0.5), image(16, 0.25));
        let comparison = ImageComparison::new(&i, &r).unwrap();
        assert_eq!(comparison.mse, mean_squared_error(&i, &r).unwrap());
        assert_eq!(
            comparison.relative_mse,
            relative_mean_squared_error(&i, &r).unwrap()
        );
        assert_eq!(comparison.mape, mean_absolute_percentage_error(&i, &r).ok());
        assert_eq!(comparison.ssim, structural_similarity(&i, &r).ok());
        assert_eq!(comparison.flip.is_some(), cfg!(feature = "flip"));
        assert!(comparison.mape.is_some() && comparison.ssim.is_some());
        let black = RgbImage::from_fn(4, 12, |_, _| [0.0; 3]).unwrap();
        let comparison = ImageComparison::new(&image(4, 1.0), &black).unwrap();
        assert_eq!(
            (comparison.mape, comparison.ssim, comparison.relative_mean),
            (None, None, [None; 3])
        );
        assert!(matches!(
            ImageComparison::new(&i, &black),
            Err(MetricError::Size { .. })
        ));
    }
}
