//! Whole frames on a GPU, kernel by kernel, by its own clock.
//!
//! ```text
//! cargo bench -p lightshed-gpu --bench frames -- [WIDTHxHEIGHT] [SCENE…]
//! ```
//!
//! At 1920x1080 `direct, tree, 4` over many lights is what Lin 2022, chapter 4, measures on an RTX
//! 2080: 11.5 ms for four samples of lights with their shadow rays and shading.
//!
//! Says SKIPPED where there is no adapter, or none with a clock.

mod opening;

use lightshed_gpu::{
    GpuCachedPaths, GpuDirectLight, GpuError, GpuGuidedPaths, GpuLightcuts, GpuMethod, GpuMixture,
    GpuPathTracer, GpuRestirDi, GpuRestirPt, GpuRestirSuffix, GpuRestirVolume, GpuScene, GpuVolumePathTracer,
    GpuVplGrid,
};
use lightshed_integrator::caching::Termination;
use lightshed_integrator::{
    CachedPathsOptions, GuideKind, GuidedPathsOptions, LightcutOptions, MixtureOptions, PathMapping,
    RestirDiSettings, RestirPtOptions, RestirVolumeOptions, VplGridOptions, WorldReuse,
};
use lightshed_scene::{Scene, builtin};
use std::collections::BTreeMap;
use std::time::Instant;

/// Frames of which the median counts; fewer where they take long.
const FRAMES: usize = 9;
/// Seconds of frames before those that count: a device that was idle has a slow clock.
const WARM_UP: f64 = 0.3;
/// Frames of paths whose guide learns from them.
const TRAINING: u32 = 4;
/// Seconds after which a row begins no more frames. A first frame that takes so long counts itself.
const LONG: f64 = 5.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let size = arguments.iter().find_map(|argument| {
        let (width, height) = argument.split_once('x')?;
        Some((width.parse().ok()?, height.parse().ok()?))
    });
    const SURFACES: [&str; 3] = ["cornell", "cornell-glossy", "many-lights"];
    const MEDIA: [&str; 2] = ["smoke-in-cornell", "cloud"];
    let is_named = |name: &&str| arguments.iter().any(|argument| argument == name);
    let all = !SURFACES.iter().chain(&MEDIA).any(is_named);
    let is_wanted = |name: &&str| all || is_named(name);
    let (width, height) = size.unwrap_or((1280, 720));
    let Some(gpu) = opening::clocked_gpu() else {
        return Ok(());
    };
    println!(
        "{}, {width}x{height}, median of {FRAMES} frames, or of as many as {LONG} s allow\n",
        gpu.description()
    );
    println!("| scene | method | frame (ms) | M samples/s | M rays/s | kernels (ms) |");
    println!("|---|---|---|---|---|---|");
    let scene = |name: &str, max_depth: Option<u32>| -> Result<Scene, Box<dyn std::error::Error>> {
        let mut description = builtin::by_name(name).ok_or("it is built in")?;
        (description.settings.width, description.settings.height) = (width, height);
        description.settings.max_depth = max_depth.or(description.settings.max_depth);
        Ok(Scene::new(&description)?)
    };
    for name in SURFACES.into_iter().filter(is_wanted) {
        let whole = scene(name, None)?;
        let on_device = GpuScene::new(&gpu, &whole)?;
        row(name, "path", GpuPathTracer::new(&gpu, &on_device)?)?;
        let guide = GuidedPathsOptions {
            training: TRAINING,
            may_drop: false,
            ..GuidedPathsOptions::new(GuideKind::Quadtree)
        };
        let guided = GpuGuidedPaths::with_options(&gpu, &whole, &on_device, guide)?;
        row_after(TRAINING, name, "path, guided by quadtrees", guided)?;
        let ends = Termination::Variance {
            threshold: 0.3,
            relative: true,
        };
        let cache = CachedPathsOptions::new(ends, &whole);
        let cached = GpuCachedPaths::new(&gpu, &whole, &on_device, cache)?;
        row(name, "path, ended by a cache", cached)?;
        let shallow = GpuScene::new(&gpu, &scene(name, Some(2))?)?;
        row(name, "direct, power", GpuPathTracer::new(&gpu, &shallow)?)?;
        row(name, "direct, tree", GpuDirectLight::new(&gpu, &on_device, 1, 1)?)?;
        row(
            name,
            "direct, tree, 4",
            GpuDirectLight::new(&gpu, &on_device, 4, 1)?,
        )?;
        let cuts = LightcutOptions::default();
        row(name, "lightcuts, 8", GpuLightcuts::new(&gpu, &on_device, cuts)?)?;
        row(name, "restir-di", GpuRestirDi::new(&gpu, &on_device)?)?;
        let settings = RestirDiSettings::UNBIASED;
        let by_tree = GpuRestirDi::with_tree(&gpu, &on_device, settings)?;
        row(name, "restir-di, tree", by_tree)?;
        let cells = WorldReuse::default();
        for (variant, both) in [("restir-di, world", false), ("restir-di, both", true)] {
            let settings = RestirDiSettings::UNBIASED.with_world(cells, both);
            row(
                name,
                variant,
                GpuRestirDi::with_settings(&gpu, &on_device, settings)?,
            )?;
        }
        let chains = GpuMixture::new(&gpu, &shallow, MixtureOptions::default())?;
        row(name, "mcmm", chains)?;
        row(name, "restir-pt", GpuRestirPt::new(&gpu, &on_device)?)?;
        for (variant, both) in [("restir-pt, world", false), ("restir-pt, both", true)] {
            let options = RestirPtOptions::real_time(PathMapping::Hybrid).with_world(cells, both);
            row(
                name,
                variant,
                GpuRestirPt::with_options(&gpu, &on_device, options)?,
            )?;
        }
        row(name, "restir-suffix", GpuRestirSuffix::new(&gpu, &on_device)?)?;
        let lights = VplGridOptions::new(0.01 * whole.extent());
        row(
            name,
            "vpl-grid",
            GpuVplGrid::new(&gpu, &whole, &on_device, lights)?,
        )?;
    }
    for name in MEDIA.into_iter().filter(is_wanted) {
        let single = scene(name, Some(2))?;
        let on_device = GpuScene::with_medium(&gpu, &single)?;
        row(
            name,
            "volpath, once",
            GpuVolumePathTracer::with_max_depth(&gpu, &on_device, Some(2))?,
        )?;
        row(
            name,
            "volpath",
            GpuVolumePathTracer::with_max_depth(&gpu, &on_device, None)?,
        )?;
        let options = RestirVolumeOptions::of_scene(&single, Some(2)).with_neighbours();
        row(
            name,
            "restir-volume",
            GpuRestirVolume::new(&gpu, &on_device, options)?,
        )?;
    }
    Ok(())
}

/// Measures a method. Rays per second are those of the kernels that trace nothing but rays.
fn row(scene: &str, name: &str, method: impl GpuMethod) -> Result<(), GpuError> {
    row_after(0, scene, name, method)
}

/// The same, after frames that do not count.
fn row_after(training: u32, scene: &str, name: &str, mut method: impl GpuMethod) -> Result<(), GpuError> {
    let [width, height] = method.size();
    let mut frames: Vec<(f64, f64, BTreeMap<String, f64>)> = Vec::new();
    for frame in 0..training {
        method.begin(frame, 1)?.finish()?;
    }
    let start = Instant::now();
    for frame in training.. {
        let is_warm = frame > training && start.elapsed().as_secs_f64() > WARM_UP;
        let finished = method.begin(frame, 1)?.finish()?;
        let rays = finished.rays;
        let mut kernels = BTreeMap::new();
        for pass in finished.times {
            let kernel = pass.label.rsplit(' ').next().unwrap_or_default();
            *kernels.entry(kernel.to_owned()).or_insert(0.0) += pass.seconds;
        }
        let traced = rays.camera + rays.path + rays.emitter;
        let is_long = start.elapsed().as_secs_f64() > LONG;
        if is_warm || is_long {
            frames.push((kernels.values().sum(), traced as f64, kernels));
        }
        if is_long || frames.len() == FRAMES {
            break;
        }
    }
    frames.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (seconds, rays, kernels) = &frames[frames.len() / 2];
    let tracing: f64 = ["extend", "connect"]
        .iter()
        .filter_map(|&kernel| kernels.get(kernel))
        .sum();
    let samples = f64::from(width) * f64::from(height);
    let listed: Vec<String> = kernels
        .iter()
        .map(|(kernel, seconds)| format!("{kernel} {:.2}", 1e3 * seconds))
        .collect();
    println!(
        "| {scene} | {name} | {:.2} | {:.2} | {} | {} |",
        1e3 * seconds,
        1e-6 * samples / seconds,
        if tracing > 0.0 {
            format!("{:.2}", 1e-6 * rays / tracing)
        } else {
            "–".to_owned()
        },
        listed.join(", ")
    );
    Ok(())
}
