//! The lighting grid hierarchy: many point lights at several resolutions (Lin 2022 ch. 3).

mod blend;
mod error;
mod grid_light;
mod hierarchy;
mod level;
mod light;
mod light_id;
mod limits;
mod moments;
mod options;
mod query;
mod scratch;
mod shadow;
mod update;

#[cfg(test)]
mod tests;

pub use blend::BlendingFunctions;
pub use error::GridError;
pub use grid_light::GridLight;
pub use hierarchy::LightingGrid;
pub use light::PointLight;
pub use light_id::LightId;
pub use limits::{MAX_ALPHA, MAX_LEVELS};
pub use options::{Construction, GridOptions, Levels};
pub use query::{GridQuery, Influence};
pub use shadow::{Gathered, MAX_SHADOW_SAMPLES};
pub use update::{GridChange, UpdateReport};
