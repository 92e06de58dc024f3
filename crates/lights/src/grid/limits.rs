//! Limits of a grid.

/// Most levels above the lights themselves: the finest then has 1,024 cells an axis.
pub const MAX_LEVELS: u32 = 11;

/// Greatest α.
pub const MAX_ALPHA: f32 = 64.0;

/// Greatest magnitude of a coordinate, so that squared distances stay finite.
pub(super) const MAX_COORDINATE: f32 = 1e18;
