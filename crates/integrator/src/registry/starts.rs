//! Methods made ready: what their options mean for constructors.

use super::option::MethodValues;
use super::options;
use super::stage::{Motion, Stage, Started};
use crate::path::short::{LongPaths, ShortLook};
use crate::{
    AnyEmitters, CachedPaths, CachedPathsOptions, EmitterSampler, GuidedPaths, GuidedPathsOptions, Mixture,
    PathGuiding, PathReuse, PathTracer, RestirDi, RestirDiSettings, RestirPt, RestirPtOffline,
    RestirPtOptions, RestirSuffix, RestirSuffixOptions, RestirVolume, RestirVolumeOptions, VolumePathTracer,
    VolumeTracking, VplBrute,
};
use lightshed_film::{FrameMethod, PixelEstimator};
use std::fmt::Display;

/// A method that was made ready, or why not.
pub(super) type Start<'b> = Result<Started<'b>, String>;

/// The sampler of emitters that is asked for.
pub(super) fn any_emitters<'b, 'a>(
    stage: &'b Stage<'a>,
    values: &MethodValues,
) -> Result<&'b AnyEmitters<'a>, String> {
    stage.emitters(values.light_choosing()).map_err(reason)
}

/// The same, with the environment sampled as asked for: above its mean unless told otherwise.
pub(super) fn path_emitters<'b, 'a>(
    stage: &'b Stage<'a>,
    values: &MethodValues,
) -> Result<&'b AnyEmitters<'a>, String> {
    stage
        .emitters_by(values.light_choosing(), values.sky())
        .map_err(reason)
}

pub(super) fn restir_di<'b>(
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
pub(super) fn in_world(values: &MethodValues, settings: RestirDiSettings) -> RestirDiSettings {
    match values.world_reuse() {
        Some((world, both)) => settings.with_world(world, both),
        None => settings,
    }
}

pub(super) fn mixture<'b>(stage: &'b Stage<'_>, values: &MethodValues, motion: Motion<'b>) -> Start<'b> {
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
        true => tracer.with_emitters_on_film(stage.emitters_on_film()),
        false => tracer,
    }
}

/// What a pilot sees of the short paths of a method with one sample of the emitters, with so many
/// paths in each of its sets.
pub(super) fn short_look(
    stage: &Stage<'_>,
    values: &MethodValues,
    of_set: usize,
) -> Result<ShortLook, String> {
    let tracer = plain_tracer(stage, values, path_emitters(stage, values)?, None);
    Ok(tracer.with_emitter_samples(1).short_look(of_set))
}

/// The look at paths with one emitter sample, with one at the method's own beside it where short
/// paths may take their place.
pub(super) fn compared_short_look(
    stage: &Stage<'_>,
    values: &MethodValues,
    of_one: &ShortLook,
    long: LongPaths,
) -> Result<ShortLook, String> {
    let tracer = plain_tracer(stage, values, path_emitters(stage, values)?, None);
    Ok(tracer.compared_short_look(of_one, long))
}

/// Paths of two edges.
pub(super) fn direct<'b>(stage: &'b Stage<'_>, values: &MethodValues, _: Motion<'b>) -> Start<'b> {
    path_samples(stage, values, Some((2, u32::MAX)))
}

pub(super) fn path<'b>(stage: &'b Stage<'_>, values: &MethodValues, _: Motion<'b>) -> Start<'b> {
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

pub(super) fn volpath<'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    tracking: VolumeTracking,
) -> Start<'b> {
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

pub(super) fn restir_pt<'b>(
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
        true => reuse.with_emitters_on_film(stage.emitters_on_film()),
        false => reuse,
    })
}

pub(super) fn shared_restir_pt<'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    options: RestirPtOptions,
) -> Start<'b> {
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

pub(super) fn restir_suffix<'b>(
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

pub(super) fn restir_volume<'b>(
    stage: &'b Stage<'_>,
    values: &MethodValues,
    motion: Motion<'b>,
) -> Start<'b> {
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

pub(super) fn vpl_brute<'b>(stage: &'b Stage<'_>, values: &MethodValues, _: Motion<'b>) -> Start<'b> {
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

pub(super) fn frames<'b, M: FrameMethod + 'b>(method: Result<M, impl Display>) -> Start<'b> {
    match method {
        Ok(method) => Ok(Started::Frames(Box::new(method))),
        Err(error) => Err(reason(error)),
    }
}

fn reason(error: impl Display) -> String {
    error.to_string()
}
