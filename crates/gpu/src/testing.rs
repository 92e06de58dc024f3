//! What tests share.

use crate::Gpu;
use lightshed_testkit::found_or_skipped;

/// The device, or `None` with a word about it where there is none; with `LIGHTSHED_REQUIRE_GPU=1` there must be one.
pub(crate) fn gpu() -> Option<Gpu> {
    let gpu = found_or_skipped(Gpu::new(), "LIGHTSHED_REQUIRE_GPU")?;
    println!("adapter: {}", gpu.description());
    Some(gpu)
}
