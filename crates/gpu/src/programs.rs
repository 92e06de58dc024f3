//! The programs, linked.

/// Path tracing by wavefronts.
pub(crate) const PATH: &str = include_str!("wgsl/path.wgsl");
