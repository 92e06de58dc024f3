//! What a method can do.

/// Capabilities and properties of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MethodCapabilities {
    /// It renders participating media; without, scenes that have some are refused.
    pub media: bool,
    /// It makes whole frames; without, samples of independent pixels.
    pub frames: bool,
    /// Its frames depend on those before.
    pub chain: bool,
    /// Its expectation differs from the image.
    pub biased: bool,
    /// The camera may move from frame to frame.
    pub camera_motion: bool,
    /// Media may move from frame to frame.
    pub media_motion: bool,
    /// The crate `lightshed-gpu` has it too.
    pub device: bool,
    /// How long its paths may be.
    pub depth: PathDepth,
}

impl MethodCapabilities {
    /// An unbiased method of independent samples, of surfaces alone, with paths of any length.
    pub const SAMPLES: Self = Self {
        media: false,
        frames: false,
        chain: false,
        biased: false,
        camera_motion: false,
        media_motion: false,
        device: false,
        depth: PathDepth::Any,
    };

    /// The same, one independent frame after the other.
    pub const FRAMES: Self = Self {
        frames: true,
        ..Self::SAMPLES
    };

    /// Frames that reuse those before, with a camera that may move.
    pub const CHAIN: Self = Self {
        chain: true,
        camera_motion: true,
        ..Self::FRAMES
    };
}

/// Lengths of a method's paths, in edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathDepth {
    /// Any length, also unbounded.
    Any,
    /// One and two edges: emitters, and light that is scattered once.
    Direct,
    /// Any length, but not unbounded.
    Bounded {
        /// Shortest longest path.
        least: u32,
        /// Longest path by default.
        default: u32,
    },
}
