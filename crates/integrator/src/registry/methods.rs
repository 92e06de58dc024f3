//! The table of methods: the only place that lists them and calls their constructors.
//!
//! A new method gets an entry here; command lines, help, comparisons and the device read the table.

use super::capabilities::{MethodCapabilities, PathDepth};
use super::entry::MethodEntry;
use super::option::{MethodOption, MethodValues};
use super::options;
use super::stage::{Motion, Stage, Started};
use crate::path::short::ShortLook;
use crate::{
    AnyEmitters, CachedPaths, CachedPathsOptions, EmitterSampler, GuidedPaths, GuidedPathsOptions,
    LightChoosing, Lightcuts, Mixture, PathGuiding, PathReuse, PathTracer, RestirDi, RestirDiSettings,
    RestirGi, RestirPt, RestirPtOffline, RestirPtOptions, RestirSuffix, RestirSuffixOptions, RestirVolume,
    RestirVolumeOptions, VolumePathReuse, VolumePathTracer, VolumeTracking, VplBrute, VplGrid,
};
use lightshed_film::{FrameMethod, PixelEstimator};
use std::fmt::Display;

type Start<'b> = Result<Started<'b>, String>;

/// The sampler of emitters that is asked for.
fn any_emitters<'b, 'a>(stage: &'b Stage<'a>, values: &MethodValues) -> Result<&'b AnyEmitters<'a>, String> {
    stage.emitters(values.light_choosing()).map_err(reason)
}

/// The same, with the environment sampled as asked for: above its mean unless told otherwise.
fn path_emitters<'b, 'a>(stage: &'b Stage<'a>, values: &MethodValues) -> Result<&'b AnyEmitters<'a>, String> {
    stage
        .emitters_by(values.light_choosing(), values.sky())
        .map_err(reason)
}

/// The name of path reuse.
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

fn restir_di<'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    motion: Motion<'b>,
    settings: RestirDiSettings,
) -> Start<'b> {
    let settings = RestirDiSettings {
        points: values.points(),
        visible_emission: values.visible_emission(),
        stratified: values.is_on(&options::STRATIFIED),
        ..in_world(values, settings)
    };
    let method = RestirDi::new(stage.scene(), any_emitters(stage, values)?, settings);
    frames(method.map(|method| method.with_motion(motion.camera)))
}

/// With reservoirs where the options say.
fn in_world(values: &MethodValues, settings: RestirDiSettings) -> RestirDiSettings {
    match values.world_reuse() {
        Some((world, both)) => settings.with_world(world, both),
        None => settings,
    }
}

fn mixture<'b>(stage: &'b Stage<'_>, values: &MethodValues, motion: Motion<'b>) -> Start<'b> {
    let options = values.mixture_options();
    let method = Mixture::new(stage.scene(), any_emitters(stage, values)?, options);
    frames(method.map(|method| method.with_motion(motion.camera)))
}

/// A path tracer with the random numbers and the visible emission of the options; with the longest
/// path and the first edge of roulette in place of the scene's. The only method compiled for each
/// sampler of emitters: with [`AnyEmitters`] it takes 1 to 2 % longer.
fn path_samples<'b>(stage: &'b Stage<'_>, values: &MethodValues, depths: Option<(u32, u32)>) -> Start<'b> {
    match path_emitters(stage, values)? {
        &AnyEmitters::Power(emitters) => samples(path_tracer(stage, values, emitters, depths)),
        AnyEmitters::Selection(emitters) => samples(path_tracer(stage, values, &**emitters, depths)),
    }
}

fn path_tracer<'b, S: EmitterSampler + 'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    sampler: S,
    depths: Option<(u32, u32)>,
) -> PathTracer<'b, S> {
    let tracer = plain_tracer(stage, values, sampler, depths);
    match values.several_short_paths() {
        true => tracer.with_short_paths(stage.samples()),
        false => tracer,
    }
}

/// The same without short paths of their own.
fn plain_tracer<'b, S: EmitterSampler + 'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    sampler: S,
    depths: Option<(u32, u32)>,
) -> PathTracer<'b, S> {
    let tracer = PathTracer::new(stage.scene(), sampler).with_emitter_samples(values.light_samples());
    let mut tracer = tracer.with_points(values.points());
    if let Some((longest, roulette)) = depths {
        tracer = tracer.with_depths(Some(longest), roulette);
    }
    match values.visible_emission() {
        true => tracer.with_visible_emission(),
        false => tracer,
    }
}

/// What a pilot sees of the short paths of a method, with so many in each of its sets.
pub(super) fn short_look(
    stage: &Stage<'_>,
    values: &MethodValues,
    of_set: usize,
) -> Result<ShortLook, String> {
    let tracer = plain_tracer(stage, values, path_emitters(stage, values)?, None);
    Ok(tracer.short_look(of_set))
}

/// Paths of two edges.
fn direct<'b>(stage: &'b Stage<'_>, values: &MethodValues, _: Motion<'b>) -> Start<'b> {
    path_samples(stage, values, Some((2, u32::MAX)))
}

fn path<'b>(stage: &'b Stage<'_>, values: &MethodValues, _: Motion<'b>) -> Start<'b> {
    let scene = stage.scene();
    match (values.guided_paths(), values.cached_paths(scene)) {
        (guide, Some(options)) => {
            let options = CachedPathsOptions { guide, ..options };
            frames(CachedPaths::new(scene, path_emitters(stage, values)?, options))
        }
        (Some(options), None) => frames(GuidedPaths::new(scene, path_emitters(stage, values)?, options)),
        (None, None) => path_samples(stage, values, None),
    }
}

fn volpath<'b>(stage: &'b Stage<'_>, values: &MethodValues, tracking: VolumeTracking) -> Start<'b> {
    let volume = Some(tracking);
    let guided = values
        .guided_paths()
        .map(|guided| GuidedPathsOptions { volume, ..guided });
    if let Some(options) = guided {
        return frames(GuidedPaths::new(
            stage.scene(),
            path_emitters(stage, values)?,
            options,
        ));
    }
    let method = VolumePathTracer::new(stage.scene(), path_emitters(stage, values)?);
    samples(method.with_tracking(tracking).with_points(values.points()))
}

fn restir_pt<'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    motion: Motion<'b>,
    options: RestirPtOptions,
) -> Start<'b> {
    let options = RestirPtOptions {
        points: values.points(),
        visible_emission: values.visible_emission(),
        footprint: values.get(&options::FOOTPRINT),
        ..options
    };
    let choosing = values.light_choosing();
    let Some(guide) = values.guided_candidates() else {
        let world = stage.world(choosing).map_err(reason)?;
        return frames(RestirPt::new(world, options, motion.camera));
    };
    let worlds = stage.guided_worlds(choosing).map_err(reason)?;
    let guiding = PathGuiding::new(worlds, guide).map_err(reason)?;
    let method = RestirPt::new(worlds.first(), options, motion.camera);
    let source = values.guide_source();
    frames(method.map(|method| method.with_guiding_from(guiding, source)))
}

pub(super) fn path_reuse<'b, 'a>(
    stage: &'b Stage<'a>,
    values: &MethodValues,
) -> Result<PathReuse<'b, &'b AnyEmitters<'a>>, String> {
    let reuse = plain_path_reuse(stage, values)?;
    Ok(match values.several_short_paths() {
        true => reuse.with_short_paths(stage.samples()),
        false => reuse,
    })
}

/// The same without short paths of their own.
fn plain_path_reuse<'b, 'a>(
    stage: &'b Stage<'a>,
    values: &MethodValues,
) -> Result<PathReuse<'b, &'b AnyEmitters<'a>>, String> {
    let reuse = PathReuse::new(stage.scene(), path_emitters(stage, values)?).with_points(values.points());
    Ok(match values.visible_emission() {
        true => reuse.with_visible_emission(),
        false => reuse,
    })
}

fn shared_restir_pt<'b>(stage: &'b Stage<'_>, values: &MethodValues, options: RestirPtOptions) -> Start<'b> {
    let world = stage.world(values.light_choosing()).map_err(reason)?;
    let reuse = plain_path_reuse(stage, values)?;
    let options = RestirPtOptions {
        points: values.points(),
        ..options
    };
    let method = RestirPtOffline::new(reuse, world, options);
    // How many frames of path reuse a frame has is known only now.
    frames(method.map(|method| match values.several_short_paths() {
        true => method.with_short_paths(stage.samples()),
        false => method,
    }))
}

fn restir_suffix<'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    motion: Motion<'b>,
    options: RestirSuffixOptions,
) -> Start<'b> {
    let options = values.restir_suffix_options(options);
    let choosing = values.light_choosing();
    let Some(guide) = values.guided_candidates() else {
        let world = stage.world(choosing).map_err(reason)?;
        return frames(RestirSuffix::new(world, options, motion.camera));
    };
    let worlds = stage.guided_worlds(choosing).map_err(reason)?;
    let guiding = PathGuiding::new(worlds, guide).map_err(reason)?;
    let method = RestirSuffix::new(worlds.first(), options, motion.camera);
    frames(method.map(|method| method.with_guiding(guiding)))
}

fn restir_volume<'b>(stage: &'b Stage<'_>, values: &MethodValues, motion: Motion<'b>) -> Start<'b> {
    let scene = stage.scene();
    let mut options = RestirVolumeOptions::of_scene(scene, scene.settings().max_depth);
    options.points = values.points();
    options.scatterings = values.scatterings(options.scatterings);
    if motion.media.is_some() || !motion.camera.is_still() {
        options = options.under_motion(scene);
    }
    match motion.media {
        None => frames(RestirVolume::new(scene, options, motion.camera)),
        Some(media) => frames(RestirVolume::animated(
            media.scenes,
            media.before,
            options,
            motion.camera,
        )),
    }
}

fn vpl_brute<'b>(stage: &'b Stage<'_>, values: &MethodValues, _: Motion<'b>) -> Start<'b> {
    let (scene, distance) = (stage.scene(), values.vpl_min_distance(stage.scene()));
    let emitters = any_emitters(stage, values)?;
    let method = VplBrute::new(scene, emitters, values.vpl_options(scene), distance);
    let mut method = method.map_err(reason)?;
    if let Some(lights) = values.get(&options::VPL_SUBSET) {
        method = method.with_lights_per_point(lights);
    }
    if values.is_on(&options::VPL_FIXED) {
        method = method.with_fixed_lights();
    }
    Ok(Started::Frames(Box::new(method)))
}

fn samples<'b>(estimator: impl PixelEstimator + Send + 'b) -> Start<'b> {
    Ok(Started::Samples(Box::new(estimator)))
}

fn frames<'b, M: FrameMethod + 'b>(method: Result<M, impl Display>) -> Start<'b> {
    match method {
        Ok(method) => Ok(Started::Frames(Box::new(method))),
        Err(error) => Err(reason(error)),
    }
}

fn reason(error: impl Display) -> String {
    error.to_string()
}
