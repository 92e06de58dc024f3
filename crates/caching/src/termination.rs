//! Where paths end.

use super::error::{CachingError, check_option};

/// The rule that ends paths in a cache.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Termination {
    /// At the end of edge number `depth`; the camera ray is number 1.
    Fixed {
        /// The edge.
        depth: u32,
    },
    /// Where paths have spread over more than a share of the camera's footprint at their first
    /// vertex, see [`AreaSpread`](crate::AreaSpread).
    Spread {
        /// `c`, 0.01 in the works that use it.
        share: f32,
    },
    /// As late as the variance of an image of one sample a pixel allows (§7.3.2): local variances
    /// are summed along the path, and the last vertex is blended so that the sum equals the bound
    /// (eq. 7.13 to 7.15).
    Variance {
        /// The bound `t`, of luminance.
        threshold: f32,
        /// Whether the bound is `t` times the squared brightness that the cache has at the path's
        /// first vertex, instead of `t`.
        relative: bool,
    },
    /// Where one more edge would raise the mean squared error of the mean of this number of samples
    /// (§7.3.3), as far as the bound of eq. 7.12 and one edge of foresight can tell.
    Mse {
        /// Samples a pixel, `s`.
        target: f32,
        /// Paths also end where that error would be lower with one more edge, but not below this
        /// share.
        margin: f32,
    },
}

impl Termination {
    /// Share of the error that [`Mse`](Self::Mse) treats as equal by default.
    pub const MARGIN: f32 = 0.9;

    /// [`Variance`](Self::Variance) with a bound that is not relative.
    pub fn variance(threshold: f32) -> Self {
        Self::Variance {
            threshold,
            relative: false,
        }
    }

    /// Whether paths can end by it.
    ///
    /// # Errors
    /// A number out of its range.
    pub fn check(&self) -> Result<(), CachingError> {
        match *self {
            Self::Fixed { depth } => check_option(depth > 0, "depth", f64::from(depth), "1 at least"),
            Self::Spread { share } => positive("share", share),
            Self::Variance { threshold, .. } => positive("threshold", threshold),
            Self::Mse { target, margin } => {
                positive("target", target)?;
                let range = "above 0 and at most 1";
                check_option(margin > 0.0 && margin <= 1.0, "margin", f64::from(margin), range)
            }
        }
    }
}

fn positive(name: &'static str, value: f32) -> Result<(), CachingError> {
    let holds = value > 0.0 && value.is_finite();
    check_option(holds, name, f64::from(value), "positive and finite")
}
