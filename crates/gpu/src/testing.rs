//! What tests share.

use crate::Gpu;
use lightshed_scene::{EmitterDescription, SceneDescription, builtin};
use lightshed_testkit::found_or_skipped;

/// The sky over the built-in cloud, an image with a sun in it, over another scene.
pub(crate) fn under_the_sky(mut scene: SceneDescription) -> SceneDescription {
    let is_image = |emitter: &EmitterDescription| matches!(emitter, EmitterDescription::Environment(_));
    scene
        .emitters
        .extend(builtin::cloud().emitters.into_iter().filter(is_image));
    scene
}

/// The device, or `None` with a word about it where there is none; with `LIGHTSHED_REQUIRE_GPU=1` there must be one.
pub(crate) fn gpu() -> Option<Gpu> {
    let gpu = found_or_skipped(Gpu::new(), "LIGHTSHED_REQUIRE_GPU")?;
    println!("adapter: {}", gpu.description());
    Some(gpu)
}
