//! Direct light.

pub(crate) mod light;
pub(crate) mod lightcuts;
mod shadow_batch;
