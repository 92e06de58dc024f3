//! The options that methods take, and the parameters that they become.

mod caches;
mod cells;
mod cuts;
mod guides;
mod mixtures;
mod suffixes;
mod vpls;

pub use caches::{
    CACHE, CACHE_ALWAYS, CACHE_BORDERS, CACHE_CELLS, CACHE_FACETS, CACHE_PASSES, CACHE_REFINE, CACHE_SURVIVAL,
};
pub use cells::{RESERVOIRS, WORLD_BRING, WORLD_CAP, WORLD_CELLS, WORLD_READS};
pub use cuts::{CUT_BLOCK, CUT_INTERLEAVING, CUT_REBUILD, CUT_SUBTREES, CUT_TREE};
pub use guides::{
    GUIDE, GUIDE_ALWAYS, GUIDE_BITS, GUIDE_BORDERS, GUIDE_FROM, GUIDE_MEMORY, GUIDE_PRODUCT, GUIDE_SCATTER,
    GUIDE_STATES, GUIDE_TRAINING,
};
pub use mixtures::{SMIS, SMIS_EMITTERS, SMIS_SIZE, SMIS_STEPS};
pub use suffixes::{BORROWED, CAMERA_RAYS, CANONICAL, PREFIXES, SPACING};
pub use vpls::{
    ALPHA, FIRST_LEVEL, INTERLEAVE, LEVELS, SHADOW_FILTER, SHADOW_SAMPLES, SHADOW_SPREAD, VPL_CLAMP,
    VPL_FIXED, VPL_PATHS, VPL_SUBSET,
};

use super::option::{MethodOption, MethodValues, one_of, within};
use crate::{LightChoosing, MAX_DIRECT_SAMPLES, MixtureSets, PathMapping};
use lightshed_resampling::PairedPattern;
use lightshed_sampling::PointSet;
use lightshed_scene::SkySampling;

/// How emitters are chosen.
pub const LIGHTS: MethodOption = MethodOption::new(
    "lights",
    "HOW",
    "",
    |text| one_of(text, &LightChoosing::ALL.map(LightChoosing::name)),
    "How an emitter is chosen; by power and without regard to the point if not given",
);

/// Which directions towards an environment are sampled.
pub const SKY: MethodOption = MethodOption::new(
    "sky",
    "HOW",
    "above-mean",
    |text| one_of(text, &SkySampling::ALL.map(SkySampling::name)),
    "How samples of emitters choose directions towards the image of an environment: above-mean, in proportion to the light \
     above its mean (directions of scattering find the rest), or luminance, in proportion to all of its light",
);

/// The random numbers of a pixel's samples.
pub const POINTS: MethodOption = MethodOption::new(
    "points",
    "SET",
    "sobol",
    |text| one_of(text, &PointSet::ALL.map(PointSet::name)),
    "Random numbers of a pixel's samples: sobol, stratified over the samples, blue-noise, stratified over neighbouring pixels, too, or independent",
);

/// States of a pixel.
pub const STATES: MethodOption = MethodOption::new(
    "states",
    "N",
    "1",
    |text| match text.parse() {
        Ok(states) if crate::STATES.contains(&states) => Ok(()),
        _ => Err(format!("{text} is none of {:?}", crate::STATES)),
    },
    "States of a pixel, each with a lobe and a ray in each step: 1, 2, 4 or 8, at most as many as a set has techniques",
);

/// How emission that the camera sees is found.
pub const VISIBLE: MethodOption = MethodOption::new(
    "visible",
    "HOW",
    "rays",
    |text| one_of(text, &["rays", "paths"]),
    "How emission that the camera sees directly is found: by rays of its own, several a sample where emitters may be seen, or by paths",
);

/// How light of at most two edges is found.
pub const SHORT_PATHS: MethodOption = MethodOption::new(
    "short-paths",
    "HOW",
    "several",
    |text| one_of(text, &["several", "one"]),
    "How light of at most two edges is found: by several samples in pixels where it varies more than they cost, as a pilot \
     says (of images of 50 samples or more), or by one, which longer paths begin with",
);

/// Samples of emitters at a point.
pub const LIGHT_SAMPLES: MethodOption = MethodOption::new(
    "light-samples",
    "N",
    "1",
    |text| within(text, 1..=MAX_DIRECT_SAMPLES),
    "Samples of emitters, chosen as --lights says, at the point that a camera ray meets",
);

/// Samples of direct light beside resampled paths.
pub const DIRECT_SAMPLES: MethodOption = MethodOption::new(
    "direct-samples",
    "N",
    "",
    |text| within(text, 0..=MAX_DIRECT_SAMPLES),
    "Samples of direct light a frame, each behind a camera ray of its own, beside resampled longer paths: 4 of \
     restir-pt-offline, 8 of restir-suffix and 32 of its offline frames, if not given; 0 resamples direct light, too",
);

/// Whether pixels share paths beside resampled ones.
pub const SHARING: MethodOption = MethodOption::new(
    "sharing",
    "HOW",
    "paths",
    |text| one_of(text, &["paths", "none"]),
    "What pixels share, so that at most what they cannot share is resampled: paths, or none, as \
     where the camera moves and with options that are about resampled paths alone (--shift reconnection, --direct-samples, \
     --footprint)",
);

/// The shift mapping.
pub const SHIFT: MethodOption = MethodOption::new(
    "shift",
    "SHIFT",
    "hybrid",
    |text| one_of(text, &["hybrid", "reconnection"]),
    "How paths are carried between pixels: hybrid, by random replay up to the first vertices that can be reconnected, or \
     reconnection, to the second surface",
);

/// How long reservoirs are kept.
pub const CAP: MethodOption = MethodOption::new(
    "cap",
    "FRAMES",
    "",
    |text| match text.parse::<f32>() {
        Ok(cap) if cap >= 1.0 && cap.is_finite() => Ok(()),
        _ => Err(format!("{text} is not a finite number from 1 on")),
    },
    "Confidence cap of reuse from the frame before, at least 1, about the number of frames that a sample stays: 20 if not \
     given. A denoiser that averages over frames itself is left least error by about 5",
);

/// Reuse in pairs.
pub const PAIRS: MethodOption = MethodOption::new(
    "pairs",
    "BLOCK",
    "",
    |text| {
        PairedPattern::new(text.parse().unwrap_or(0))
            .map(|_| ())
            .map_err(|error| error.to_string())
    },
    "Reuse among pixels in three rounds of pairs that reuse from each other, within blocks of so many pixels (a power of \
     two), in place of neighbours in a disk",
);

/// Steps of Markov chains.
pub const MUTATIONS: MethodOption = MethodOption::new(
    "mutations",
    "N",
    "0",
    |text| within(text, 0..=64),
    "Steps of a Markov chain on each pixel's sample after reuse from the frame before: its point of an emitter, or the \
     vertex at which its path reconnects",
);

/// Candidates that know of each other.
pub const STRATIFIED: MethodOption = MethodOption::switch(
    "stratified",
    "Stratify a pixel's candidates for light: a lattice with one random shift",
);

/// Reconnections by the spread of paths.
pub const FOOTPRINT: MethodOption = MethodOption::new(
    "footprint",
    "PIXELS",
    "",
    |text| match text.parse::<f32>() {
        Ok(pixels) if pixels > 0.0 && pixels.is_finite() => Ok(()),
        _ => Err(format!("{text} is not a positive number of pixels")),
    },
    "Reconnect paths where they spread over the area of so many pixels, in place of a least distance of vertices and a \
     least roughness of lobes",
);

/// Most scattering vertices.
pub const SCATTERINGS: MethodOption = MethodOption::new(
    "scatterings",
    "N",
    "",
    |text| within(text, 1..=crate::MAX_SCATTERINGS),
    "Most scattering vertices of a path; as many as the longest path allows if not given",
);

impl MethodValues {
    /// How emitters are chosen, if not by power.
    pub fn light_choosing(&self) -> Option<LightChoosing> {
        self.get(&LIGHTS)
    }

    /// Which directions towards an environment are sampled: those above the mean, unless several
    /// samples of the emitters are taken for one direction of scattering, which is then too rare to
    /// find the rest.
    pub fn sky(&self) -> SkySampling {
        let usual = match self.light_samples() {
            1 => SkySampling::AboveMean,
            _ => SkySampling::Luminance,
        };
        self.sky_given().unwrap_or(usual)
    }

    /// The same, if told.
    pub fn sky_given(&self) -> Option<SkySampling> {
        self.has(&SKY).then(|| self.get(&SKY)).flatten()
    }

    /// The random numbers of a pixel's samples: stratified unless told otherwise.
    pub fn points(&self) -> PointSet {
        self.get(&POINTS).unwrap_or(PointSet::Sobol)
    }

    /// The same, if told.
    pub fn points_given(&self) -> Option<PointSet> {
        self.has(&POINTS).then(|| self.points())
    }

    /// Whether the cells of a cache are neither split nor separated by direction.
    pub(super) fn cache_has_plain_cells(&self) -> bool {
        [&CACHE_REFINE, &CACHE_FACETS]
            .iter()
            .all(|option| self.get(option).unwrap_or(0u32) == 0)
    }

    /// Whether emission that the camera sees directly has rays of its own.
    pub fn visible_emission(&self) -> bool {
        self.get::<String>(&VISIBLE).is_none_or(|how| how == "rays")
    }

    /// The same, if told.
    pub fn visible_given(&self) -> Option<bool> {
        self.has(&VISIBLE).then(|| self.visible_emission())
    }

    /// Whether light of at most two edges may have several samples.
    pub fn several_short_paths(&self) -> bool {
        self.get::<String>(&SHORT_PATHS)
            .is_none_or(|how| how == "several")
    }

    /// The same, if told.
    pub fn short_paths_given(&self) -> Option<bool> {
        self.has(&SHORT_PATHS).then(|| self.several_short_paths())
    }

    /// Samples of emitters at a point.
    pub fn light_samples(&self) -> u32 {
        self.get(&LIGHT_SAMPLES).unwrap_or(1)
    }

    /// Samples of direct light beside resampled paths.
    pub fn direct_samples(&self, default: u32) -> u32 {
        self.get(&DIRECT_SAMPLES).unwrap_or(default)
    }

    /// Whether pixels share paths beside resampled ones, where the camera stands still and the
    /// method takes that option.
    pub fn shares_paths(&self) -> bool {
        let none = self.get::<String>(&SHARING).is_some_and(|how| how == "none");
        let resampled = [&DIRECT_SAMPLES, &FOOTPRINT]
            .iter()
            .any(|option| self.has(option));
        !none && !resampled && self.path_mapping() == PathMapping::Hybrid
    }

    /// Most scattering vertices of a path through media.
    pub fn scatterings(&self, default: u32) -> u32 {
        self.get(&SCATTERINGS).unwrap_or(default)
    }

    /// The shift mapping of ReSTIR path tracing.
    pub fn path_mapping(&self) -> PathMapping {
        match self.get::<String>(&SHIFT).as_deref() {
            Some("reconnection") => PathMapping::Reconnection,
            _ => PathMapping::Hybrid,
        }
    }

    /// The confidence cap of reuse from the frame before.
    pub fn temporal_cap(&self, default: Option<f32>) -> Option<f32> {
        self.get(&CAP).or(default)
    }

    /// Whether candidates are stratified, or reuse is in pairs, by footprints, or followed by steps
    /// of Markov chains.
    pub fn is_decorrelated(&self) -> bool {
        self.is_on(&STRATIFIED)
            || self.get::<u32>(&PAIRS).is_some()
            || self.get::<f32>(&FOOTPRINT).is_some()
            || self.get(&MUTATIONS).is_some_and(|steps: u32| steps > 0)
    }

    /// Whether Markov chain mixtures have spatial sets of one step and one state a frame, as they
    /// do if nothing else is told.
    pub(super) fn has_spatial_step(&self) -> bool {
        let options = self.mixture_options();
        options.sets == MixtureSets::Spatial && options.steps_of_frame() == 1 && options.states == 1
    }
}
