//! Supporting prefixes and the suffixes behind them, as a frame has them.

use crate::emitter_sampler::EmitterSampler;
use crate::reuse_frames::{Reservoirs, TwoFrames};
use crate::{SceneVertex, SceneWorld};
use lightshed_resampling::{Conditional, DomainReservoir};
use lightshed_sampling::PrimarySample;
use lightshed_scene::glam::Vec3;
use lightshed_shift::{PathDomain, PrefixDomain};

/// The prefixes of a pixel.
pub(super) type Prefixes<'a, E> = PrefixDomain<'a, SceneWorld<'a, E>>;
/// The suffixes behind a prefix, which is held fixed.
pub(super) type Suffixes<'a, E> = Conditional<PathDomain<'a, SceneWorld<'a, E>>, PrimarySample>;
/// A suffix with its conditional weight.
pub(super) type SuffixReservoir<'a, E> = DomainReservoir<Suffixes<'a, E>>;

/// What is kept of a frame's pixels.
pub(super) struct Supports<'a, E: EmitterSampler> {
    /// The prefixes that a pixel may have.
    pub prefixes: Vec<Option<Prefixes<'a, E>>>,
    /// The suffixes behind the one that it has.
    pub suffixes: Vec<Option<Suffixes<'a, E>>>,
}

// Not derived: a derive would ask for `E: Default`.
impl<E: EmitterSampler> Default for Supports<'_, E> {
    fn default() -> Self {
        Self {
            prefixes: Vec::new(),
            suffixes: Vec::new(),
        }
    }
}

impl<E: EmitterSampler> Supports<'_, E> {
    /// Whether surfaces that two pixels see lie alike. It asks nothing of samples, so it is no
    /// bias.
    pub fn sees_alike(&self, own: usize, other: &Self, index: usize) -> bool {
        let normal = |supports: &Self, index: usize| normal_of(supports.prefixes[index].as_ref()?.first());
        alike(normal(self, own), normal(other, index))
    }

    /// Whether the last vertices of two supporting prefixes lie alike. It asks nothing of suffixes.
    pub fn ends_alike(&self, own: usize, other: usize) -> bool {
        let normal = |index: usize| normal_of(self.suffixes[index].as_ref()?.domain().first());
        alike(normal(own), normal(other))
    }
}

fn normal_of(first: Option<(&SceneVertex, Vec3)>) -> Option<Vec3> {
    first.map(|(vertex, _)| vertex.point().geometric_normal)
}

fn alike(own: Option<Vec3>, other: Option<Vec3>) -> bool {
    match (own, other) {
        (Some(own), Some(other)) => own.dot(other).abs() >= LEAST_COSINE,
        _ => false,
    }
}

/// Of the angle between normals.
const LEAST_COSINE: f32 = 0.5;

/// What is kept of two frames.
pub(super) struct History<'a, E: EmitterSampler> {
    pub supports: TwoFrames<Supports<'a, E>>,
    pub prefixes: Reservoirs<Prefixes<'a, E>>,
    pub suffixes: Reservoirs<Suffixes<'a, E>>,
}

// Not derived: a derive would ask for `E: Default`.
impl<E: EmitterSampler> Default for History<'_, E> {
    fn default() -> Self {
        Self {
            supports: TwoFrames::default(),
            prefixes: Reservoirs::default(),
            suffixes: Reservoirs::default(),
        }
    }
}

/// Passes of a frame.
#[derive(Clone, Copy)]
pub(super) enum Pass {
    Camera,
    Prefixes,
    PrefixTemporal,
    Suffixes,
    SuffixTemporal,
    Gather,
    /// In rounds.
    SuffixSpatial,
}

impl From<Pass> for u32 {
    fn from(pass: Pass) -> Self {
        pass as Self
    }
}

/// Pixels that one thread takes at a time, with the same working memory.
pub(super) const GROUP: usize = 512;

/// Paths that are traced together.
pub(super) const BATCH: usize = 64;
