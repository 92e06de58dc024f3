//! Path tracing with paths that end in a cache of radiance.

mod ending;
mod frames;
mod options;
mod vertices;

pub use ending::CacheEnding;
pub use frames::CachedPaths;
pub use options::{CacheRule, CachedPathsError, CachedPathsOptions, MAX_CACHE_PASSES};
pub use vertices::SceneVertices;
