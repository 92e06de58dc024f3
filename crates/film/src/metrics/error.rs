//! Why a metric is not defined.

use crate::RgbImage;
use std::fmt;

/// Why two images cannot be compared by a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MetricError {
    /// The images differ in size.
    Size {
        /// Width and height of the image.
        image: [u32; 2],
        /// Width and height of the reference.
        reference: [u32; 2],
    },
    /// The reference's mean luminance is not positive, so nothing is relative to it.
    BlackReference,
    /// A side is shorter than the metric's window.
    TooSmall {
        /// Side of the window in pixels.
        window: u32,
    },
}

impl fmt::Display for MetricError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size {
                image: [w, h],
                reference: [rw, rh],
            } => {
                write!(f, "the image has {w}x{h} pixels but the reference {rw}x{rh}")
            }
            Self::BlackReference => write!(f, "the reference's mean luminance is not positive"),
            Self::TooSmall { window } => write!(
                f,
                "the images are smaller than a window of {window}x{window} pixels"
            ),
        }
    }
}

impl std::error::Error for MetricError {}

/// The pixels of two images of the same size.
pub(super) type PixelPairs<'a> =
    std::iter::Zip<std::slice::Iter<'a, [f32; 3]>, std::slice::Iter<'a, [f32; 3]>>;

/// Tells if the sizes of two images differ.
pub(super) fn same_size(image: &RgbImage, reference: &RgbImage) -> Result<(), MetricError> {
    let size = |image: &RgbImage| [image.width(), image.height()];
    let (image, reference) = (size(image), size(reference));
    if image == reference {
        Ok(())
    } else {
        Err(MetricError::Size { image, reference })
    }
}

/// Pairs the pixels of two images of the same size.
pub(super) fn paired<'a>(
    image: &'a RgbImage,
    reference: &'a RgbImage,
) -> Result<PixelPairs<'a>, MetricError> {
    same_size(image, reference)?;
    Ok(image.pixels().iter().zip(reference.pixels()))
}
