//! Rendering on a GPU.

use crate::arguments::Arguments;
use crate::failure::Failure;
#[cfg(feature = "gpu")]
use lightshed::film::Budget;
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
    if arguments.motion.is_some() {
        return Err(Failure::new("--motion has no meaning with --device gpu"));
    }
    let gpu = lightshed::gpu::Gpu::new()?;
    let stage = lightshed::gpu::GpuStage::new(&gpu, scene, &arguments.method)?;
    let end = match options.budget {
        Budget::Samples(samples) => options.first.saturating_add(samples),
        Budget::Seconds(_) => u32::MAX,
    };
    let mut frames = lightshed::gpu::GpuFrames::new(stage.start()?).ahead_until(end);
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
