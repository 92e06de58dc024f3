//! Methods that resample: pixels reuse from neighbours and from earlier frames.

mod candidates;
mod di;
mod gi;
mod indirect;
mod light;
mod primary;
pub(crate) mod pt;

pub use candidates::{EndpointSampler, LitPoint};
pub use di::{RestirDi, RestirDiError, RestirDiSettings};
pub use gi::RestirGi;

use lightshed_sampling::CounterRng;

/// Passes of a frame, each with random numbers of its own.
#[derive(Clone, Copy)]
enum Pass {
    Camera,
    Bsdf,
    Candidates,
    Survivors,
    Temporal,
    Indirect,
    IndirectTemporal,
    IndirectSpatial,
    /// The rounds follow each other.
    Spatial,
}

/// Words of one pass; far more than any draws.
const WORDS_PER_PASS: u32 = 1 << 24;

/// The random numbers of one pass (and round) of a pixel in a frame.
#[inline]
fn pass_rng(seed: u64, width: u32, pixel: usize, frame: u32, pass: Pass, round: u32) -> CounterRng {
    let (x, y) = (pixel as u32 % width, pixel as u32 / width);
    let mut rng = CounterRng::new(seed, y << 16 | x, frame);
    rng.set_dimension((pass as u32 + round % 128) * WORDS_PER_PASS);
    rng
}

/// Random bits for a pattern of neighbours, the same for all pixels.
#[inline]
fn pattern_key(seed: u64, frame: u32, round: u32) -> u32 {
    CounterRng::at(seed, u32::MAX, frame, round)
}
