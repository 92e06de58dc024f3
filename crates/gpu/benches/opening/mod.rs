//! What the benches begin with.

use lightshed_gpu::Gpu;

/// The device, if there is one with a clock; says SKIPPED where there is not.
pub fn clocked_gpu() -> Option<Gpu> {
    match Gpu::new() {
        Ok(gpu) if gpu.has_timestamps() => Some(gpu),
        Ok(gpu) => {
            println!("SKIPPED: {} has no clock", gpu.description());
            None
        }
        Err(error) => {
            println!("SKIPPED: {error}");
            None
        }
    }
}
