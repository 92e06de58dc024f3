//! Direct light only: emission and light that is scattered once.

pub(crate) mod lightcuts;
pub(crate) mod plain;
pub(crate) mod selected;
mod shadow_batch;
