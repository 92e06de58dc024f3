//! Options that have no effect beside others.

use super::option::{MethodOption, MethodValues};
use super::options::{
    CACHE_ALWAYS, CACHE_BORDERS, CACHE_CELLS, CACHE_FACETS, CACHE_PASSES, CACHE_REFINE, CACHE_SURVIVAL, CAP,
    GUIDE, GUIDE_ALWAYS, GUIDE_BITS, GUIDE_BORDERS, GUIDE_FROM, GUIDE_MEMORY, GUIDE_PRODUCT, GUIDE_SCATTER,
    GUIDE_STATES, GUIDE_TRAINING, LIGHT_SAMPLES, PAIRS, SHADOW_FILTER, SHADOW_SAMPLES, SHADOW_SPREAD,
    SHORT_PATHS, WORLD_BRING, WORLD_CAP, WORLD_CELLS, WORLD_READS,
};

/// The reason why a given option would change nothing beside the others.
pub(super) fn idle_option(values: &MethodValues) -> Option<String> {
    let guided = values.guided_paths().is_some();
    let cached = values.cache_rule().is_some();
    let guide = |names: &[&str]| {
        let guide = values.get::<String>(&GUIDE);
        guide.is_some_and(|guide| names.contains(&guide.as_str()))
    };
    let world = values.world_reuse();
    let shadows = values.get(&SHADOW_SAMPLES) != Some(0u32);
    let rules: [(&[&MethodOption], bool, &str); 11] = [
        (
            &[
                &GUIDE_TRAINING,
                &GUIDE_ALWAYS,
                &GUIDE_BORDERS,
                &GUIDE_SCATTER,
                &GUIDE_FROM,
            ],
            guided,
            "without --guide",
        ),
        (
            &[&LIGHT_SAMPLES],
            !guided && !cached,
            "with --guide or --cache, whose paths have one",
        ),
        (
            &[&SHORT_PATHS],
            values.shares_paths(),
            "where paths are resampled alone",
        ),
        (
            &[&GUIDE_BITS, &GUIDE_PRODUCT],
            guide(&["cdq"]),
            "without --guide cdq",
        ),
        (
            &[&GUIDE_STATES],
            guide(&["mcmm", "mcmm-grid"]),
            "without --guide mcmm or mcmm-grid",
        ),
        (
            &[&GUIDE_MEMORY],
            guide(&["mcmm-grid"]),
            "without --guide mcmm-grid",
        ),
        (
            &[&GUIDE_TRAINING, &GUIDE_ALWAYS],
            !cached,
            "with --cache, whose passes train the guide",
        ),
        (
            &[
                &CACHE_PASSES,
                &CACHE_ALWAYS,
                &CACHE_CELLS,
                &CACHE_BORDERS,
                &CACHE_REFINE,
                &CACHE_FACETS,
                &CACHE_SURVIVAL,
            ],
            cached,
            "without --cache",
        ),
        (
            &[&WORLD_CELLS, &WORLD_CAP, &WORLD_BRING, &WORLD_READS],
            world.is_some(),
            "without --reservoirs world or both",
        ),
        (
            &[&PAIRS, &CAP],
            world.is_none_or(|(_, both)| both),
            "with --reservoirs world",
        ),
        (
            &[&SHADOW_SPREAD, &SHADOW_FILTER],
            shadows,
            "with --shadow-samples 0",
        ),
    ];
    let is_given = |wanted: &MethodOption| {
        let mut given = values.given();
        given.any(|(option, value)| option.name == wanted.name && value != option.default)
    };
    let mut idle = rules.iter().filter(|(_, is_used, _)| !is_used);
    idle.find_map(|(options, _, why)| {
        let option = options.iter().find(|option| is_given(option))?;
        Some(format!("--{} has no meaning {why}", option.name))
    })
}
