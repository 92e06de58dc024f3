//! Errors of an evaluation.

use lightshed_film::{ImageError, RenderError};
use std::fmt;

/// Why something cannot be evaluated.
#[derive(Debug)]
#[non_exhaustive]
pub enum EvaluateError {
    /// Images of different sizes.
    Size {
        /// Width and height of one.
        image: [u32; 2],
        /// Width and height of the other.
        reference: [u32; 2],
    },
    /// A reference whose mean is not positive and finite.
    Black,
    /// A reference was interrupted before it was complete.
    Interrupted,
    /// A method that cannot be started.
    Method(Box<dyn std::error::Error + Send + Sync>),
    /// Invalid options of a contest.
    Contest(String),
    /// An image cannot be made.
    Image(ImageError),
    /// A reference cannot be rendered.
    Render(RenderError),
    /// A stored record does not belong to the contest, or is no record.
    Record(String),
    /// An image viewer cannot be reached.
    Viewer(String),
    /// A denoiser cannot filter a frame.
    Filter(String),
}

impl fmt::Display for EvaluateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { image, reference } => write!(
                f,
                "an image of {}x{} pixels cannot be compared with one of {}x{}",
                image[0], image[1], reference[0], reference[1]
            ),
            Self::Black => f.write_str("the reference's mean is not positive and finite"),
            Self::Interrupted => f.write_str("the reference was interrupted"),
            Self::Method(error) => error.fmt(f),
            Self::Contest(reason) => f.write_str(reason),
            Self::Image(error) => error.fmt(f),
            Self::Render(error) => error.fmt(f),
            Self::Record(reason) => write!(f, "the kept record: {reason}"),
            Self::Viewer(reason) => write!(f, "the image viewer: {reason}"),
            Self::Filter(reason) => write!(f, "the denoiser: {reason}"),
        }
    }
}

impl std::error::Error for EvaluateError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Image(error) => Some(error),
            Self::Render(error) => Some(error),
            Self::Method(error) => error.source(),
            _ => None,
        }
    }
}

impl EvaluateError {
    /// Why a method cannot be started, by whatever error it has.
    pub fn method(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self::Method(Box::new(error))
    }
}

impl From<ImageError> for EvaluateError {
    fn from(error: ImageError) -> Self {
        Self::Image(error)
    }
}

impl From<RenderError> for EvaluateError {
    fn from(error: RenderError) -> Self {
        Self::Render(error)
    }
}
