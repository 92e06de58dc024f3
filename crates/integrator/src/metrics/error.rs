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

/// Pairs the pixels of two images, or tells that their sizes differ.
pub(super) fn paired<'a>(
    image: &'a RgbImage,
    reference: &'a RgbImage,
) -> Result<PixelPairs<'a>, MetricError> {
    let size = |image: &RgbImage| [image.width(), image.height()];
    let (image_size, reference_size) = (size(image), size(reference));
    if image_size == reference_size {
        Ok(image.pixels().iter().zip(reference.pixels()))
    } else {
        Err(MetricError::Size {
            image: image_size,
            reference: reference_size,
        })
    }
}
