//! Direct light.

mod bsdf_batch;
pub(crate) mod light;
pub(crate) mod lightcuts;
mod shadow_batch;
