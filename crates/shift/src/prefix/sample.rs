//! A prefix as a reservoir keeps it.

use crate::world::Place;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{PathSeed, luminance};

/// A prefix `x₁ … x_m` of paths, with its contribution in its domain.
///
/// The vertices before the last are stored as the seed of their random numbers, the last one as a
/// place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrefixSample {
    pub(crate) seed: PathSeed,
    pub(crate) index: u32,
    /// The lobe that left the vertex before the last.
    pub(crate) lobe: u8,
    pub(crate) place: Place,
    /// `p(x_m)`, in area measure: what a reconnection changes.
    pub(crate) density: f32,
    /// `F_p = f_p / p`.
    pub(crate) throughput: Vec3,
    /// Unit direction from the last vertex to the one before.
    pub(crate) wo: Vec3,
}

impl PrefixSample {
    /// Number `m` of the last vertex, the first surface being number 1.
    pub fn length(&self) -> u32 {
        self.index
    }

    /// Where the last vertex is.
    pub fn place(&self) -> Place {
        self.place
    }

    /// Unit direction from the last vertex to the one before it.
    pub fn wo(&self) -> Vec3 {
        self.wo
    }

    /// The throughput `F_p = f_p / p` in primary sample space: the share of the radiance leaving
    /// the last vertex along [`wo`](Self::wo) that reaches the viewer.
    #[inline(always)]
    pub fn throughput(&self) -> Vec3 {
        self.throughput
    }

    /// The target function, the luminance of the throughput (Kettunen 2023 eq. 19).
    #[inline(always)]
    pub fn target(&self) -> f64 {
        f64::from(luminance(self.throughput))
    }

    /// Whether two samples are the same prefix: equal except for the values that belong to their
    /// domains.
    pub fn is_same_prefix(&self, other: &Self) -> bool {
        let own = |x: &Self| (x.seed, x.index, x.lobe, x.place);
        own(self) == own(other)
    }
}
