//! Visible lights, region by region.

mod block;
mod bucket_choice;
mod buckets;
mod cache;
mod entries;
mod exploration;
mod flat;
mod lists;
mod options;
mod record;
mod regions;
mod select;
mod share;
mod tree_cache;
mod units;
mod walk;

pub use cache::LightCache;
pub use exploration::{ExplorationTable, ExplorationWeights};
pub use flat::FlatLightCache;
pub use options::{BucketRule, Exploration, LightCacheOptions, LightTreeCacheOptions, MAX_BUCKET};
pub use record::{CacheMoments, CacheUse, LightCacheReport, LightRecord};
pub use tree_cache::LightTreeCache;
