//! The programs, linked.

/// Path tracing by wavefronts.
pub(crate) const PATH: &str = include_str!("wgsl/path.wgsl");
/// Direct light by reuse among pixels and frames.
pub(crate) const RESTIR_DI: &str = include_str!("wgsl/restir_di.wgsl");
