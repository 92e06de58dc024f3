//! Why a grid cannot be built.

use super::limits::{MAX_ALPHA, MAX_LEVELS};
use crate::MAX_LIGHTS;
use std::fmt;

/// Why a grid cannot be built or updated.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum GridError {
    /// There are no lights.
    Empty,
    /// More than [`MAX_LIGHTS`] lights.
    TooMany(usize),
    /// The position of this light is not finite, or so far out that squared distances overflow.
    Position(usize),
    /// The intensity of this light is negative or not finite.
    Intensity(usize),
    /// The normal of this light is neither zero nor of unit length.
    Normal(usize),
    /// α is not in (0, [`MAX_ALPHA`]].
    Alpha(f32),
    /// The number of levels is not in 1..=[`MAX_LEVELS`].
    Levels(u32),
    /// The bounds asked for are not finite or not in order.
    Bounds,
    /// A change names a light that does not exist.
    NoSuchLight(u32),
}

impl fmt::Display for GridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "there are no lights"),
            Self::TooMany(count) => write!(f, "{count} lights are more than the {MAX_LIGHTS} allowed"),
            Self::Position(light) => write!(
                f,
                "light {light}: its position must be finite and not too far out"
            ),
            Self::Intensity(light) => {
                write!(f, "light {light}: its intensity must be finite and not negative")
            }
            Self::Normal(light) => write!(f, "light {light}: its normal must be zero or of unit length"),
            Self::Alpha(alpha) => write!(f, "alpha is {alpha}, but must be above 0 and at most {MAX_ALPHA}"),
            Self::Levels(levels) => write!(f, "{levels} levels are not between 1 and {MAX_LEVELS}"),
            Self::Bounds => write!(f, "the grid's bounds must be finite and in order"),
            Self::NoSuchLight(light) => write!(f, "there is no light {light} to change"),
        }
    }
}

impl std::error::Error for GridError {}
