//! What tests share.

use crate::Gpu;

/// The device, or `None` with a word about it where there is none; with `LIGHTSHED_REQUIRE_GPU=1` there must be one.
pub(crate) fn gpu() -> Option<Gpu> {
    match Gpu::new() {
        Ok(gpu) => {
            println!("adapter: {}", gpu.description());
            Some(gpu)
        }
        Err(error) => {
            let required = std::env::var("LIGHTSHED_REQUIRE_GPU").is_ok_and(|value| value == "1");
            assert!(!required, "LIGHTSHED_REQUIRE_GPU=1, but {error}");
            println!("SKIPPED: {error}");
            None
        }
    }
}
