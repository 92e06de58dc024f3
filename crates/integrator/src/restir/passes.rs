//! Passes of direct and indirect light.

use lightshed_sampling::FramePasses;

/// Passes of a frame of direct and indirect light.
#[derive(Clone, Copy)]
pub(super) enum Pass {
    Camera,
    Bsdf,
    Candidates,
    Survivors,
    Temporal,
    Indirect,
    IndirectTemporal,
    IndirectSpatial,
    /// In rounds.
    Spatial,
}

impl From<Pass> for u32 {
    fn from(pass: Pass) -> Self {
        pass as Self
    }
}

/// Most rounds of spatial reuse.
pub(super) const MAX_ROUNDS: u32 = 64;

pub(super) const PASSES: FramePasses = match FramePasses::new(Pass::Spatial as u32 + 1, MAX_ROUNDS, 3) {
    Ok(passes) => passes,
    Err(_) => panic!("few passes"),
};
