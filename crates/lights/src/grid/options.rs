//! What a grid may be asked for.

use super::GridError;
use super::limits::{MAX_ALPHA, MAX_COORDINATE, MAX_LEVELS};
use crate::Bounds;

/// How many levels there are above the lights themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Levels {
    /// The number that leaves the finest level, S₁, fewer grid lights than half the lights (Lin
    /// 2022 §3.4.3); at least one.
    #[default]
    Auto,
    /// This number: level 1 has `2^(count − 1)` cells along the longest edge, level `count` has
    /// one.
    Count(u32),
}

/// How levels above the first are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Construction {
    /// Each vertex gathers from the level below (Lin 2022 §3.3.1), with trilinear shares of
    /// vertices instead of illumination centres, so that nothing is smoothed.
    #[default]
    Gather,
    /// Every light is added to every level: the same lights up to rounding, for comparison. On one
    /// thread.
    Scatter,
}

/// Size, fineness and accuracy of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GridOptions {
    /// α: level ℓ serves distances around `r_ℓ = α h_ℓ`, `h_ℓ` its cell size. More is
    /// more accurate and slower; 1 to 2 is usual.
    pub alpha: f32,
    /// Number of levels.
    pub levels: Levels,
    /// The least box that the grid covers, enlarged if lights lie outside; `None` for the lights'
    /// own. A fixed box keeps the grid in place while lights move, so that the result changes
    /// continuously.
    pub bounds: Option<Bounds>,
    /// How levels above the first are made.
    pub construction: Construction,
}

impl Default for GridOptions {
    fn default() -> Self {
        Self {
            alpha: 1.0,
            levels: Levels::Auto,
            bounds: None,
            construction: Construction::Gather,
        }
    }
}

impl GridOptions {
    /// Reports what construction would refuse, without lights.
    ///
    /// # Errors
    ///
    /// [`GridError::Alpha`], [`GridError::Levels`], [`GridError::Bounds`].
    pub fn check(&self) -> Result<(), GridError> {
        // NaN fails the comparison.
        if !(self.alpha > 0.0 && self.alpha <= MAX_ALPHA) {
            return Err(GridError::Alpha(self.alpha));
        }
        if let Levels::Count(count) = self.levels
            && !(1..=MAX_LEVELS).contains(&count)
        {
            return Err(GridError::Levels(count));
        }
        let far = |bounds: &Bounds| bounds.min.abs().max(bounds.max.abs()).max_element() > MAX_COORDINATE;
        match &self.bounds {
            Some(bounds) if !bounds.is_valid() || far(bounds) => Err(GridError::Bounds),
            _ => Ok(()),
        }
    }
}
