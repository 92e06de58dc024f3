//! What an update did.

use lightshed_spatial::Occupancy;

/// The results of [`RadianceCache::update`](crate::RadianceCache::update).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CacheReport {
    /// Number of passes so far, including this one.
    pub passes: u32,
    /// Records that answer now.
    pub answering: usize,
    /// Vertices that were sampled.
    pub visited: usize,
    /// Samples that were drawn.
    pub samples: u64,
    /// Vertices that samples and the renderer found, and that were to be kept.
    pub offered: usize,
    /// Cells that are split.
    pub split: usize,
    /// How full the table is; [`Occupancy::refused`] cells have no record because it is full.
    pub occupancy: Occupancy,
}
