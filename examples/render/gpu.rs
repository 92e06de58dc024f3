//! Rendering on a GPU.

use crate::arguments::Arguments;
use crate::failure::Failure;
use lightshed::film::{Progress, RenderOptions, RenderOutcome};
use lightshed::scene::Scene;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

/// The outcome, the device, and seconds that the kernels of each name ran.
type OnGpu = (RenderOutcome, String, BTreeMap<String, f64>);

/// Renders on the first GPU.
#[cfg(feature = "gpu")]
pub fn on_gpu(
    arguments: &Arguments,
    scene: &Scene,
    options: &RenderOptions,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<OnGpu, Failure> {
    use crate::arguments::{Mapping, Method};
    use crate::session::LIGHT_SAMPLES;
    use lightshed::gpu::{
        Gpu, GpuDirectLight, GpuLightcuts, GpuPathTracer, GpuRestirDi, GpuRestirPt, GpuRestirVolume,
        GpuScene, GpuVolumePathTracer, GpuVplGrid,
    };
    use lightshed::integrator::{
        LightChoosing, PathMapping, RestirDiSettings, RestirPtOptions, RestirVolumeOptions,
    };

    if arguments.motion.is_some() {
        return Err(Failure::new("--motion has no meaning with --device gpu"));
    }
    let by_tree = match (arguments.lights, arguments.method) {
        (None, _) => false,
        (Some(LightChoosing::Tree), Method::Direct | Method::RestirDi) => true,
        _ => {
            return Err(Failure::new(
                "with --device gpu --lights has to be tree, and the method direct or restir-di",
            ));
        }
    };
    let gpu = Gpu::new()?;
    if arguments.method == Method::Volpath {
        let on_device = GpuScene::with_medium(&gpu, scene)?;
        let method = GpuVolumePathTracer::new(&gpu, &on_device)?;
        return render(&gpu, method, options, observer, cancel);
    }
    if arguments.method == Method::RestirVolume {
        let on_device = GpuScene::with_medium(&gpu, scene)?;
        let parameters = RestirVolumeOptions::of_scene(scene, scene.settings().max_depth).with_neighbours();
        let method = GpuRestirVolume::new(&gpu, &on_device, parameters)?;
        return render(&gpu, method, options, observer, cancel);
    }
    let on_device = GpuScene::new(&gpu, scene)?;
    match arguments.method {
        Method::Direct if by_tree => {
            let samples = arguments.light_samples.unwrap_or(LIGHT_SAMPLES);
            let method = GpuDirectLight::new(&gpu, &on_device, samples, 1)?;
            render(&gpu, method, options, observer, cancel)
        }
        Method::Path | Method::Direct => render(
            &gpu,
            GpuPathTracer::new(&gpu, &on_device)?,
            options,
            observer,
            cancel,
        ),
        Method::Lightcuts => {
            let method = GpuLightcuts::new(&gpu, &on_device, arguments.lightcuts.options())?;
            render(&gpu, method, options, observer, cancel)
        }
        Method::RestirDi => {
            let settings = RestirDiSettings::UNBIASED;
            let method = if by_tree {
                GpuRestirDi::with_tree(&gpu, &on_device, settings)?
            } else {
                GpuRestirDi::with_settings(&gpu, &on_device, settings)?
            };
            render(&gpu, method, options, observer, cancel)
        }
        Method::RestirPt => {
            let mapping = match arguments.shift {
                Mapping::Hybrid => PathMapping::Hybrid,
                Mapping::Reconnection => PathMapping::Reconnection,
            };
            let parameters = RestirPtOptions::real_time(mapping);
            render(
                &gpu,
                GpuRestirPt::with_options(&gpu, &on_device, parameters)?,
                options,
                observer,
                cancel,
            )
        }
        Method::VplGrid => {
            let max_depth = scene.settings().max_depth.unwrap_or_default();
            let parameters = arguments.vpl.grid_options(scene, max_depth);
            let method = GpuVplGrid::new(&gpu, scene, &on_device, parameters)?;
            render(&gpu, method, options, observer, cancel)
        }
        method => Err(Failure::new(format_args!(
            "--device gpu has path, direct, lightcuts, restir-di, restir-pt, restir-volume, volpath and vpl-grid, not {}",
            method.name()
        ))),
    }
}

#[cfg(feature = "gpu")]
fn render<M: lightshed::gpu::GpuMethod + Send>(
    gpu: &lightshed::gpu::Gpu,
    method: M,
    options: &RenderOptions,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<OnGpu, Failure> {
    let mut frames = lightshed::gpu::GpuFrames::new(method);
    let outcome = lightshed::film::render_frames(&mut frames, options, observer, cancel)?;
    match frames.failure() {
        Some(failure) => Err(Failure::new(failure)),
        None => Ok((outcome, gpu.name().to_owned(), frames.pass_seconds().clone())),
    }
}

/// Says that there is none.
#[cfg(not(feature = "gpu"))]
pub fn on_gpu(
    _: &Arguments,
    _: &Scene,
    _: &RenderOptions,
    _: &(dyn Fn(&Progress) + Sync),
    _: &AtomicBool,
) -> Result<OnGpu, Failure> {
    Err(Failure::new(
        "--device gpu needs the feature gpu: cargo run --features gpu …",
    ))
}
