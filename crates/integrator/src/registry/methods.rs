//! The table of methods: the only place that lists them. `starts.rs` calls most of their
//! constructors.
//!
//! A new method gets an entry here; command lines, help, comparisons and the device read the table.

use super::capabilities::{MethodCapabilities, PathDepth};
use super::entry::MethodEntry;
use super::option::MethodOption;
use super::options;
use super::stage::Started;
use super::starts::{
    any_emitters, direct, frames, in_world, mixture, path, path_emitters, path_reuse, restir_di, restir_pt,
    restir_suffix, restir_volume, shared_restir_pt, volpath, vpl_brute,
};
use crate::{
    LightChoosing, Lightcuts, RestirDiSettings, RestirGi, RestirPtOptions, RestirSuffixOptions,
    VolumePathReuse, VolumeTracking, VplGrid,
};

/// Names by which other tables know a method.
pub(super) const PATH_REUSE: &str = "path-reuse";
pub(super) const RESTIR_PT_OFFLINE: &str = "restir-pt-offline";

/// All methods. Not a constant: each crate that names one compiles the functions in it again.
pub static METHODS: &[MethodEntry] = &[
    MethodEntry {
        name: "path",
        help: "Path tracing with next-event estimation and multiple importance sampling",
        capabilities: MethodCapabilities {
            device: true,
            ..MethodCapabilities::SAMPLES
        },
        options: &[
            options::LIGHTS,
            options::SKY,
            options::POINTS,
            options::VISIBLE,
            options::SHORT_PATHS,
            options::GUIDE,
            options::GUIDE_BITS,
            options::GUIDE_PRODUCT,
            options::GUIDE_TRAINING,
            options::GUIDE_ALWAYS,
            options::GUIDE_BORDERS,
            options::CACHE,
            options::CACHE_PASSES,
            options::CACHE_ALWAYS,
            options::CACHE_CELLS,
            options::CACHE_BORDERS,
            options::CACHE_REFINE,
            options::CACHE_SURVIVAL,
            options::GUIDE_STATES,
            options::GUIDE_MEMORY,
            options::CACHE_FACETS,
            options::LIGHT_SAMPLES,
        ],
        start: path,
    },
    MethodEntry {
        name: "volpath",
        help: "The same through participating media, by null collisions",
        capabilities: MethodCapabilities {
            media: true,
            device: true,
            ..MethodCapabilities::SAMPLES
        },
        options: VOLPATH_OPTIONS,
        start: |stage, values, _| volpath(stage, values, VolumeTracking::Delta),
    },
    MethodEntry {
        name: "volpath-decomposition",
        help: "The same by decomposition tracking and residual ratio tracking",
        capabilities: MethodCapabilities {
            media: true,
            ..MethodCapabilities::SAMPLES
        },
        options: VOLPATH_OPTIONS,
        start: |stage, values, _| volpath(stage, values, VolumeTracking::Decomposition),
    },
    MethodEntry {
        name: "volpath-reuse",
        help: "Path tracing through participating media by small tiles of pixels that share their paths",
        capabilities: MethodCapabilities {
            media: true,
            ..MethodCapabilities::FRAMES
        },
        options: &[options::LIGHTS, options::SKY, options::POINTS],
        start: |stage, values, _| {
            let method = VolumePathReuse::new(stage.scene(), path_emitters(stage, values)?);
            frames(Ok::<_, String>(method.with_points(values.points())))
        },
    },
    MethodEntry {
        name: "restir-volume",
        help: "Paths through participating media by reuse among pixels and frames",
        capabilities: MethodCapabilities {
            media: true,
            media_motion: true,
            device: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[options::SCATTERINGS, options::POINTS],
        start: restir_volume,
    },
    MethodEntry {
        name: "direct",
        help: "Direct light only",
        capabilities: MethodCapabilities {
            depth: PathDepth::Direct,
            device: true,
            ..MethodCapabilities::SAMPLES
        },
        options: &[
            options::LIGHTS,
            options::SKY,
            options::LIGHT_SAMPLES,
            options::POINTS,
            options::VISIBLE,
            options::SHORT_PATHS,
        ],
        start: direct,
    },
    MethodEntry {
        name: "lightcuts",
        help: "Direct light by cuts through a light tree that blocks of pixels share",
        capabilities: MethodCapabilities {
            depth: PathDepth::Direct,
            device: true,
            ..MethodCapabilities::FRAMES
        },
        options: &[
            options::CUT_TREE,
            options::CUT_SUBTREES,
            options::CUT_BLOCK,
            options::CUT_INTERLEAVING,
            options::CUT_REBUILD,
        ],
        start: |stage, values, _| frames(Lightcuts::new(stage.scene(), values.lightcut_options())),
    },
    MethodEntry {
        name: PATH_REUSE,
        help: "Path tracing by pixels that share their paths: bright ones by up to 256",
        capabilities: MethodCapabilities::FRAMES,
        options: &[
            options::LIGHTS,
            options::SKY,
            options::POINTS,
            options::VISIBLE,
            options::SHORT_PATHS,
        ],
        start: |stage, values, _| Ok(Started::Frames(Box::new(path_reuse(stage, values)?))),
    },
    MethodEntry {
        name: "mcmm",
        help: "Light at what the camera sees by Markov chain mixtures, without a list of lights; \
               direct light unless longer paths are asked for",
        capabilities: MethodCapabilities {
            depth: PathDepth::Bounded { least: 2, default: 2 },
            device: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[
            options::SMIS,
            options::SMIS_SIZE,
            options::SMIS_STEPS,
            options::STATES,
            options::SMIS_EMITTERS,
            options::LIGHTS,
            options::POINTS,
            options::VISIBLE,
        ],
        start: mixture,
    },
    MethodEntry {
        name: "restir-di",
        help: "Direct light by reuse among pixels and frames",
        capabilities: MethodCapabilities {
            depth: PathDepth::Direct,
            device: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[
            options::LIGHTS,
            options::POINTS,
            options::VISIBLE,
            options::STRATIFIED,
            options::PAIRS,
            options::MUTATIONS,
            options::RESERVOIRS,
            options::WORLD_CELLS,
            options::WORLD_CAP,
            options::WORLD_BRING,
            options::WORLD_READS,
        ],
        start: |stage, values, motion| {
            let mut settings = RestirDiSettings {
                mutations: values.get(&options::MUTATIONS).unwrap_or(0),
                ..RestirDiSettings::UNBIASED
            };
            if let Some(block) = values.get(&options::PAIRS) {
                (settings.pairs, settings.spatial_rounds) = (Some(block), PAIRED_ROUNDS);
            }
            restir_di(stage, values, motion, settings)
        },
    },
    MethodEntry {
        name: "restir-di-biased",
        help: "The same, cheaper and biased",
        capabilities: MethodCapabilities {
            depth: PathDepth::Direct,
            biased: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[
            options::LIGHTS,
            options::POINTS,
            options::VISIBLE,
            options::STRATIFIED,
            options::RESERVOIRS,
            options::WORLD_CELLS,
            options::WORLD_CAP,
            options::WORLD_BRING,
            options::WORLD_READS,
        ],
        start: |stage, values, motion| {
            if values.world_reuse().is_some_and(|(_, both)| both) {
                return Err("biased reservoirs are on the screen or in the world, not both".to_owned());
            }
            restir_di(stage, values, motion, RestirDiSettings::BIASED)
        },
    },
    MethodEntry {
        name: "restir-gi",
        help: "Indirect light by reuse of the points that send it, biased; direct light as restir-di",
        capabilities: MethodCapabilities {
            biased: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[
            options::LIGHTS,
            options::POINTS,
            options::VISIBLE,
            options::STRATIFIED,
            options::RESERVOIRS,
            options::WORLD_CELLS,
            options::WORLD_CAP,
            options::WORLD_BRING,
            options::WORLD_READS,
        ],
        start: |stage, values, motion| {
            let knows_the_point = values
                .light_choosing()
                .is_some_and(LightChoosing::knows_the_point);
            let mut settings = RestirDiSettings {
                points: values.points(),
                visible_emission: values.visible_emission(),
                stratified: values.is_on(&options::STRATIFIED),
                ..RestirDiSettings::UNBIASED
            };
            if knows_the_point {
                settings.emitter_candidates = CHOSEN_CANDIDATES;
            }
            let settings = in_world(values, settings);
            let method = RestirGi::new(stage.scene(), any_emitters(stage, values)?, settings);
            frames(method.map(|method| method.with_motion(motion.camera)))
        },
    },
    MethodEntry {
        name: "restir-pt",
        help: "ReSTIR path tracing, one tree of candidates a frame, with reuse from the frame before",
        capabilities: MethodCapabilities {
            device: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[
            options::SHIFT,
            options::LIGHTS,
            options::POINTS,
            options::VISIBLE,
            options::PAIRS,
            options::DIRECT_SAMPLES,
            options::CAP,
            options::RESERVOIRS,
            options::WORLD_CELLS,
            options::WORLD_CAP,
            options::WORLD_BRING,
            options::WORLD_READS,
            options::FOOTPRINT,
            options::MUTATIONS,
            options::GUIDE,
            options::GUIDE_BITS,
            options::GUIDE_TRAINING,
            options::GUIDE_BORDERS,
            options::GUIDE_FROM,
        ],
        start: |stage, values, motion| {
            let mut options = RestirPtOptions::real_time(values.path_mapping());
            if let Some(block) = values.get(&options::PAIRS) {
                (options.pairs, options.rounds) = (Some(block), PAIRED_ROUNDS);
            }
            options.direct_samples = values.direct_samples(options.direct_samples);
            options.temporal_cap = values.temporal_cap(options.temporal_cap);
            if let Some((world, both)) = values.world_reuse() {
                options = options.with_world(world, both);
            }
            options.mutations = values.get(&options::MUTATIONS).unwrap_or(0);
            restir_pt(stage, values, motion, options)
        },
    },
    MethodEntry {
        name: RESTIR_PT_OFFLINE,
        help: "Path reuse and, where it pays, ReSTIR path tracing of what smooth surfaces scatter, in independent frames, for \
               stills",
        capabilities: MethodCapabilities {
            camera_motion: true,
            ..MethodCapabilities::FRAMES
        },
        options: &[
            options::SHIFT,
            options::LIGHTS,
            options::DIRECT_SAMPLES,
            options::POINTS,
            options::VISIBLE,
            options::SHORT_PATHS,
            options::FOOTPRINT,
            options::SHARING,
        ],
        start: |stage, values, motion| {
            let mut settings = RestirPtOptions::offline(values.path_mapping());
            if values.shares_paths() && motion.camera.is_still() {
                return shared_restir_pt(stage, values, settings);
            }
            settings.direct_samples = values.direct_samples(settings.direct_samples);
            restir_pt(stage, values, motion, settings)
        },
    },
    MethodEntry {
        name: "restir-suffix",
        help: "Path tracing by short prefixes that share what is behind them, with reuse from the frame before",
        capabilities: MethodCapabilities {
            device: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[
            options::SHIFT,
            options::LIGHTS,
            options::POINTS,
            options::PREFIXES,
            options::CANONICAL,
            options::BORROWED,
            options::CAMERA_RAYS,
            options::DIRECT_SAMPLES,
            options::VISIBLE,
            options::PAIRS,
            options::SPACING,
            options::CAP,
            options::GUIDE,
            options::GUIDE_BITS,
            options::GUIDE_TRAINING,
            options::GUIDE_BORDERS,
        ],
        start: |stage, values, motion| {
            let mut options = RestirSuffixOptions::real_time(values.path_mapping());
            options.suffixes.points = values.points();
            if let Some(block) = values.get(&options::PAIRS) {
                (options.suffixes.pairs, options.suffixes.rounds) = (Some(block), PAIRED_ROUNDS);
            }
            restir_suffix(stage, values, motion, options)
        },
    },
    MethodEntry {
        name: "restir-suffix-offline",
        help: "The same in independent frames of 32 prefixes",
        capabilities: MethodCapabilities {
            camera_motion: true,
            ..MethodCapabilities::FRAMES
        },
        options: &[
            options::SHIFT,
            options::LIGHTS,
            options::PREFIXES,
            options::CANONICAL,
            options::BORROWED,
            options::CAMERA_RAYS,
            options::DIRECT_SAMPLES,
            options::VISIBLE,
            options::GUIDE,
            options::GUIDE_BITS,
            options::GUIDE_TRAINING,
            options::GUIDE_BORDERS,
        ],
        start: |stage, values, motion| {
            let options = RestirSuffixOptions::offline(values.path_mapping());
            restir_suffix(stage, values, motion, options)
        },
    },
    MethodEntry {
        name: "vpl-grid",
        help: "Indirect light by a lighting grid hierarchy over virtual point lights, biased",
        capabilities: MethodCapabilities { device: true, ..VPL },
        options: &[
            options::VPL_PATHS,
            options::VPL_CLAMP,
            options::VPL_FIXED,
            options::ALPHA,
            options::LEVELS,
            options::FIRST_LEVEL,
            options::SHADOW_SAMPLES,
            options::SHADOW_SPREAD,
            options::SHADOW_FILTER,
            options::INTERLEAVE,
            options::LIGHTS,
        ],
        start: |stage, values, _| {
            let options = values.vpl_grid_options(stage.scene());
            frames(VplGrid::new(stage.scene(), any_emitters(stage, values)?, options))
        },
    },
    MethodEntry {
        name: "vpl-brute",
        help: "Indirect light by a sum over virtual point lights, biased",
        capabilities: VPL,
        options: &[
            options::VPL_PATHS,
            options::VPL_CLAMP,
            options::VPL_FIXED,
            options::VPL_SUBSET,
            options::LIGHTS,
        ],
        start: vpl_brute,
    },
];

/// Virtual point lights: three diffuse bounces by default (Lin 2022 §3.4), at least one, never
/// unbounded.
const VPL: MethodCapabilities = MethodCapabilities {
    biased: true,
    depth: PathDepth::Bounded { least: 3, default: 5 },
    ..MethodCapabilities::FRAMES
};

/// Candidates of direct light beside reuse of indirect light, where each is chosen for the point
/// that it lights: such a choice costs more than one by power and leaves less to resample.
const CHOSEN_CANDIDATES: u32 = 8;

/// Options of paths through media.
const VOLPATH_OPTIONS: &[MethodOption] = &[
    options::LIGHTS,
    options::SKY,
    options::GUIDE,
    options::GUIDE_BITS,
    options::GUIDE_PRODUCT,
    options::GUIDE_TRAINING,
    options::GUIDE_ALWAYS,
    options::GUIDE_BORDERS,
    options::GUIDE_SCATTER,
    options::POINTS,
    options::GUIDE_STATES,
    options::GUIDE_MEMORY,
];

/// Rounds of reuse in pairs: as many partners as neighbours in a disk.
const PAIRED_ROUNDS: u32 = 3;
