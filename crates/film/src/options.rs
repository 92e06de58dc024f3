//! Options of a rendering, and errors of options.

use crate::image::{ImageError, pixel_count};
use std::fmt;

/// When a rendering is done.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Budget {
    /// After this many samples in every pixel (at least one).
    Samples(u32),
    /// After about this many seconds of wall time: whole passes only, at least one, ending as near
    /// to the budget as a pass of one sample in every pixel allows.
    Seconds(f64),
}

/// Size, budget, seed and threads of a rendering.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RenderOptions {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// When the rendering is done.
    pub budget: Budget,
    /// Number of the first sample, or frame: 0 unless earlier ones belong to other parts. Frames of
    /// a [`FrameMethod`](crate::FrameMethod) that depend on each other start with 0.
    pub first: u32,
    /// Passed to the estimator. Images of different seeds are independent.
    pub seed: u64,
    /// Number of threads; 0 is one for every processor. It does not change the image.
    pub threads: usize,
    /// Whether a part of the samples is of no use: an interrupted rendering may give none. It need
    /// not keep what it had before a pass then, which costs memory for a second film and the time
    /// to copy it.
    pub whole: bool,
}

impl RenderOptions {
    /// Options with seed 0 and a thread for every processor, from the first sample on.
    pub fn new(width: u32, height: u32, budget: Budget) -> Self {
        let (first, seed, threads) = (0, 0, 0);
        Self {
            width,
            height,
            budget,
            first,
            seed,
            threads,
            whole: false,
        }
    }

    /// Reports what [`render`](crate::render) would refuse, without allocating a film or starting a
    /// thread.
    ///
    /// # Errors
    ///
    /// An invalid size, budget or number of threads.
    pub fn check(&self) -> Result<(), RenderError> {
        pixel_count(self.width, self.height).map_err(RenderError::Size)?;
        match self.budget {
            Budget::Samples(samples) if samples > 0 && self.first.checked_add(samples).is_some() => (),
            Budget::Samples(samples) if samples > 0 => return Err(RenderError::First(self.first, samples)),
            Budget::Seconds(seconds) if seconds > 0.0 && seconds.is_finite() => (),
            budget => return Err(RenderError::Budget(budget)),
        }
        if self.threads > MAX_THREADS {
            return Err(RenderError::Threads(self.threads));
        }
        Ok(())
    }
}

/// Most threads that a rendering may ask for.
pub const MAX_THREADS: usize = 1024;

/// Why a rendering could not start.
#[derive(Debug)]
#[non_exhaustive]
pub enum RenderError {
    /// The image cannot have this size.
    Size(ImageError),
    /// A budget of no samples, or of a time that is not positive and finite.
    Budget(Budget),
    /// The number of samples exceeds the remaining sample numbers: the first one's number, and the
    /// number of samples.
    First(u32, u32),
    /// More than [`MAX_THREADS`] threads.
    Threads(usize),
    /// A method made for frames of another size than the options ask for; width and height of both.
    OtherSize {
        /// What the method was made for.
        method: [u32; 2],
        /// What is asked for.
        options: [u32; 2],
    },
    /// The threads could not be started.
    ThreadPool(rayon::ThreadPoolBuildError),
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size(error) => write!(f, "{error}"),
            Self::Budget(Budget::Samples(samples)) => {
                write!(f, "a budget of {samples} samples a pixel is no budget")
            }
            Self::Budget(Budget::Seconds(seconds)) => {
                write!(f, "a budget of {seconds} seconds is not a positive time")
            }
            Self::First(first, samples) => {
                write!(
                    f,
                    "{samples} samples from number {first} on are more than there are numbers"
                )
            }
            Self::Threads(threads) => write!(f, "{threads} threads are more than the {MAX_THREADS} allowed"),
            Self::OtherSize {
                method: [w, h],
                options: [other_w, other_h],
            } => write!(
                f,
                "a method made for {w}x{h} pixels cannot render {other_w}x{other_h}"
            ),
            Self::ThreadPool(_) => write!(f, "cannot start the threads"),
        }
    }
}

impl std::error::Error for RenderError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::ThreadPool(error) => Some(error),
            _ => None,
        }
    }
}
