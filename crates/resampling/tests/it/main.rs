//! Resampling as a user's crate calls it.

mod exact;
mod frames;
mod properties;
mod reuse;
mod selection;
