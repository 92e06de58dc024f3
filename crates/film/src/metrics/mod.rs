//! Differences between an image `I` and a reference `R` of the same size.

mod comparison;
mod error;
#[cfg(feature = "flip")]
mod flip;
mod pixelwise;
mod ssim;

pub use comparison::ImageComparison;
pub use error::MetricError;
#[cfg(feature = "flip")]
pub use flip::flip;
pub use pixelwise::{
    RELATIVE_MSE_EPSILON, mean_absolute_percentage_error, mean_squared_error, relative_mean,
    relative_mean_squared_error,
};
pub use ssim::{SSIM_WINDOW, structural_similarity};
