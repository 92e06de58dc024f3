//! Where paths end in a cache, and what a cache is.

use super::super::option::{MethodOption, MethodValues, any, within};
use crate::{CacheRule, CachedPathsOptions, MAX_CACHE_PASSES};
use lightshed_caching::{Facets, Refinement};
use lightshed_scene::Scene;

/// Where paths end in a cache.
pub const CACHE: MethodOption = MethodOption::new(
    "cache",
    "RULE",
    "none",
    |text| match text {
        "none" => Ok(()),
        _ => text
            .parse::<CacheRule>()
            .map(|_| ())
            .map_err(|error| error.to_string()),
    },
    "Where paths end in a cache of radiance, which is biased: none, fixed[:EDGE], spread[:SHARE], variance:T (relative to the \
     squared brightness) or variance-absolute:T, as late as that bound on a sample's variance allows, or mse:S, where the error \
     of S samples is least",
);

/// Passes that fill a cache.
pub const CACHE_PASSES: MethodOption = MethodOption::new(
    "cache-passes",
    "N",
    "64",
    |text| within(text, 1..=MAX_CACHE_PASSES),
    "Passes that fill the cache of --cache before the first frame",
);

/// A cache that is updated for ever.
pub const CACHE_ALWAYS: MethodOption = MethodOption::switch(
    "cache-always",
    "Update the cache of --cache before each frame, too",
);

/// How large the cells of a cache are seen.
pub const CACHE_CELLS: MethodOption = MethodOption::new(
    "cache-cells",
    "ANGLE",
    "0.05",
    any::<f32>,
    "Side of the cells of --cache, seen from the camera, in radians; rounded down to a power of two times the finest",
);

/// Cells of a cache that are split.
pub const CACHE_REFINE: MethodOption = MethodOption::new(
    "cache-refine",
    "LEVELS",
    "0",
    |text| within(text, 0..=lightshed_caching::MAX_REFINEMENT),
    "How often cells of --cache are halved where their own bias dominates",
);

/// Records by direction.
pub const CACHE_FACETS: MethodOption = MethodOption::new(
    "cache-facets",
    "N",
    "0",
    |text| within(text, 0..=u32::from(lightshed_caching::MAX_FACETS)),
    "Records of --cache for glossy surfaces, in each of N² facets of directions; 0 if paths pass these surfaces",
);

/// Cells of a cache that are not interpolated.
pub const CACHE_BORDERS: MethodOption = MethodOption::switch(
    "cache-borders",
    "Let the cells of --cache end at their borders instead of looking them up at places moved at random",
);

/// Roulette of paths with a cache.
pub const CACHE_SURVIVAL: MethodOption = MethodOption::new(
    "cache-survival",
    "P",
    "1",
    any::<f32>,
    "Probability with which paths of --cache survive each vertex but their first",
);

impl MethodValues {
    /// Where paths end in a cache, if they do.
    pub fn cache_rule(&self) -> Option<CacheRule> {
        self.get(&CACHE)
    }

    /// How paths end in a cache of a scene, if they do.
    pub fn cached_paths(&self, scene: &Scene) -> Option<CachedPathsOptions> {
        let mut options = CachedPathsOptions::new(self.cache_rule()?.0, scene);
        options.passes = self.get(&CACHE_PASSES).unwrap_or(options.passes);
        options.every_frame = self.is_on(&CACHE_ALWAYS);
        options.cache.cells.growth = self.get(&CACHE_CELLS).unwrap_or(options.cache.cells.growth);
        options.cache.refinement = match self.get(&CACHE_REFINE).unwrap_or(0) {
            0 => None,
            levels => Some(Refinement {
                levels,
                ..Refinement::default()
            }),
        };
        options.facets = Facets::new(self.get(&CACHE_FACETS).unwrap_or(0)).ok();
        options.jitter = !self.is_on(&CACHE_BORDERS);
        options.survival = self.get(&CACHE_SURVIVAL).unwrap_or(options.survival);
        options.points = self.points();
        options.visible_emission = self.visible_emission();
        Some(options)
    }
}
