//! Why passes do not run.

use crate::merge::MergeError;

/// Why a pass cannot run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReuseError {
    /// A slice does not have one entry for each domain.
    Length,
    /// The inputs of some domain could not be merged.
    Merge(MergeError),
    /// Paired reuse knows pairwise families only.
    NotPairwise,
}

impl core::fmt::Display for ReuseError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length => f.write_str("slices must have one entry for each domain"),
            Self::Merge(error) => error.fmt(f),
            Self::NotPairwise => f.write_str("paired reuse needs a pairwise MIS family"),
        }
    }
}

impl core::error::Error for ReuseError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Merge(error) => Some(error),
            _ => None,
        }
    }
}
