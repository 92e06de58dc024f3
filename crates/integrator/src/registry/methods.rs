//! The table of methods: the one place that lists them and calls their constructors.
//!
//! A new method gets an entry here; command lines, help, races and the device read the table.

use super::capabilities::{MethodCapabilities, PathDepth};
use super::entry::MethodEntry;
use super::option::MethodValues;
use super::options;
use super::stage::{Motion, Stage, Started};
use crate::{
    DirectLight, LightSelection, Lightcuts, PathReuse, PathTracer, RestirDi, RestirDiSettings, RestirGi,
    RestirPt, RestirPtOptions, RestirVolume, RestirVolumeOptions, SelectedDirectLight, SelectedPathTracer,
    VolumePathTracer, VolumeTracking, VplBrute, VplGrid,
};
use lightshed_film::{FrameMethod, PixelEstimator};
use std::fmt::Display;

type Start<'b> = Result<Started<'b>, String>;

/// All methods.
pub const METHODS: &[MethodEntry] = &[
    MethodEntry {
        name: "path",
        help: "Path tracing with next-event estimation and multiple importance sampling",
        capabilities: MethodCapabilities {
            device: true,
            ..MethodCapabilities::SAMPLES
        },
        options: &[options::LIGHTS],
        start: |stage, values, _| match values.light_choosing() {
            None => samples(PathTracer::new(stage.scene())),
            Some(choosing) => {
                let (scene, settings) = (stage.scene(), stage.scene().settings());
                let selection = LightSelection::new(scene, choosing).map_err(reason)?;
                samples(SelectedPathTracer::new(
                    scene,
                    selection,
                    settings.max_depth,
                    settings.roulette_depth,
                ))
            }
        },
    },
    MethodEntry {
        name: "volpath",
        help: "The same through participating media, by null collisions",
        capabilities: MethodCapabilities {
            media: true,
            device: true,
            ..MethodCapabilities::SAMPLES
        },
        options: &[],
        start: |stage, _, _| samples(VolumePathTracer::new(stage.scene())),
    },
    MethodEntry {
        name: "volpath-decomposition",
        help: "The same by decomposition tracking and residual ratio tracking",
        capabilities: MethodCapabilities {
            media: true,
            ..MethodCapabilities::SAMPLES
        },
        options: &[],
        start: |stage, _, _| {
            samples(VolumePathTracer::new(stage.scene()).with_tracking(VolumeTracking::Decomposition))
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
        options: &[options::SCATTERINGS],
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
        options: &[options::LIGHTS, options::LIGHT_SAMPLES],
        start: |stage, values, _| match values.light_choosing() {
            None if values.has(&options::LIGHT_SAMPLES) => Err("light-samples asks for lights".to_owned()),
            None => samples(DirectLight::new(stage.scene())),
            Some(choosing) => {
                let selection = LightSelection::new(stage.scene(), choosing).map_err(reason)?;
                let direct = SelectedDirectLight::new(stage.scene(), selection, values.light_samples(), 1);
                samples(direct.map_err(reason)?)
            }
        },
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
        name: "path-reuse",
        help: "Path tracing by tiles of 16 pixels that share their paths",
        capabilities: MethodCapabilities::FRAMES,
        options: &[],
        start: |stage, _, _| Ok(Started::Frames(Box::new(PathReuse::new(stage.scene())))),
    },
    MethodEntry {
        name: "restir-di",
        help: "Direct light by reuse among pixels and frames",
        capabilities: MethodCapabilities {
            depth: PathDepth::Direct,
            device: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[options::LIGHTS],
        start: |stage, values, motion| restir_di(stage, values, motion, RestirDiSettings::UNBIASED),
    },
    MethodEntry {
        name: "restir-di-biased",
        help: "The same, cheaper and biased",
        capabilities: MethodCapabilities {
            depth: PathDepth::Direct,
            biased: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[options::LIGHTS],
        start: |stage, values, motion| restir_di(stage, values, motion, RestirDiSettings::BIASED),
    },
    MethodEntry {
        name: "restir-gi",
        help: "Indirect light by reuse of the points that send it, biased; direct light as restir-di",
        capabilities: MethodCapabilities {
            biased: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[],
        start: |stage, _, motion| {
            Ok(Started::Frames(Box::new(
                RestirGi::new(stage.scene()).with_motion(motion.camera),
            )))
        },
    },
    MethodEntry {
        name: "restir-pt",
        help: "ReSTIR path tracing, one tree of candidates a frame, with reuse from the frame before",
        capabilities: MethodCapabilities {
            device: true,
            ..MethodCapabilities::CHAIN
        },
        options: &[options::SHIFT],
        start: |stage, values, motion| {
            let options = RestirPtOptions::real_time(values.path_mapping());
            frames(RestirPt::new(stage.world(), options, motion.camera))
        },
    },
    MethodEntry {
        name: "restir-pt-offline",
        help: "ReSTIR path tracing in independent frames of 32 trees",
        capabilities: MethodCapabilities {
            camera_motion: true,
            ..MethodCapabilities::FRAMES
        },
        options: &[options::SHIFT],
        start: |stage, values, motion| {
            let options = RestirPtOptions::offline(values.path_mapping());
            frames(RestirPt::new(stage.world(), options, motion.camera))
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
        ],
        start: |stage, values, _| {
            frames(VplGrid::new(
                stage.scene(),
                values.vpl_grid_options(stage.scene()),
            ))
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
        ],
        start: vpl_brute,
    },
];

/// Virtual point lights: three diffuse bounces unless told otherwise (Lin 2022 §3.4), one at least, never without end.
const VPL: MethodCapabilities = MethodCapabilities {
    biased: true,
    depth: PathDepth::Bounded { least: 3, default: 5 },
    ..MethodCapabilities::FRAMES
};

fn restir_di<'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    motion: Motion<'b>,
    settings: RestirDiSettings,
) -> Start<'b> {
    match values.light_choosing() {
        None => {
            let method = RestirDi::with_settings(stage.scene(), settings);
            frames(method.map(|method| method.with_motion(motion.camera)))
        }
        Some(choosing) => {
            let selection = stage.selection(choosing).map_err(reason)?;
            let method = RestirDi::with_sampler(stage.scene(), selection, settings);
            frames(method.map(|method| method.with_motion(motion.camera)))
        }
    }
}

fn restir_volume<'b>(stage: &'b Stage<'_>, values: &MethodValues, motion: Motion<'b>) -> Start<'b> {
    let scene = stage.scene();
    let mut options = RestirVolumeOptions::of_scene(scene, scene.settings().max_depth);
    options.scatterings = values.get(&options::SCATTERINGS).unwrap_or(options.scatterings);
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
    let scene = stage.scene();
    let method = VplBrute::new(scene, values.vpl_options(scene), values.vpl_min_distance(scene));
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
