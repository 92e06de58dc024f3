//! How a perfect tree is built and descended.

use crate::importance::Weighting;
use lightshed_spatial::Curve;

/// How a [`PerfectTree`](crate::PerfectTree) is descended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PerfectTreeOptions {
    /// How distance enters a node's weight.
    pub weighting: Weighting,
    /// Levels of the tree taken at each step.
    pub stride: Stride,
    /// The curve along which lights are sorted.
    pub curve: Curve,
}

/// Number of levels of a binary tree that a step descends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Stride {
    /// One of two children, as in the thesis.
    One,
    /// One of eight descendants.
    #[default]
    Three,
}

impl Default for PerfectTreeOptions {
    fn default() -> Self {
        Self {
            weighting: Weighting::MinMax,
            stride: Stride::Three,
            curve: Curve::Hilbert,
        }
    }
}

impl PerfectTreeOptions {
    /// The given weights, three levels at each step.
    #[must_use]
    pub fn with_weighting(self, weighting: Weighting) -> Self {
        Self { weighting, ..self }
    }

    /// Lights sorted along the given curve.
    #[must_use]
    pub fn with_curve(self, curve: Curve) -> Self {
        Self { curve, ..self }
    }

    /// The given number of levels at each step.
    #[must_use]
    pub fn with_stride(self, stride: Stride) -> Self {
        Self { stride, ..self }
    }
}

impl Stride {
    pub(super) fn levels(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Three => 3,
        }
    }
}
