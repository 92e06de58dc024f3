//! # lightshed
//!
//! Reusable sampling libraries for light transport. This package re-exports the workspace's crates, one
//! feature a crate; a renderer usually depends on the single crate it needs.
#[cfg(feature = "integrator")]
pub use lightshed_integrator as integrator;
#[cfg(feature = "resampling")]
pub use lightshed_resampling as resampling;
#[cfg(feature = "sampling")]
pub use lightshed_sampling as sampling;
#[cfg(feature = "scene")]
pub use lightshed_scene as scene;
