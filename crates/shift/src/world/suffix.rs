//! Suffixes of paths: light behind a reconnection vertex that no shift traces.

use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, PathSeed, SolidAngle};

/// The rest of a path, starting with the ray that leaves its reconnection vertex. Shifts copy its
/// radiance and never ask how it was found.
#[derive(Clone, Copy, Debug)]
pub struct Suffix<R, S> {
    /// The ray.
    pub ray: R,
    /// Its unit direction.
    pub direction: Vec3,
    /// The vertex that it leaves, as the selection of emitters uses it.
    pub site: S,
    /// Density of the direction over all lobes of that vertex except delta lobes; the direction
    /// does not come from a delta lobe.
    pub total_pdf: Density<SolidAngle>,
    /// Source of the random numbers.
    pub seed: PathSeed,
    /// Weight of radiance along the ray, for roulette: the largest component of its colour.
    pub importance: f32,
}

/// How far suffixes go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SuffixLimits {
    /// Number of the vertices that the rays lead to.
    pub first: u32,
    /// Longest path, in edges.
    pub max_length: u32,
    /// Roulette may end a path at vertices with this number or a higher one.
    pub roulette_from: u32,
}

/// Light that arrives along a suffix's ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SuffixLight {
    /// From what the ray itself leads to.
    Met {
        /// Radiance.
        radiance: Vec3,
        /// Density with which emitter sampling at the reconnection vertex finds the direction.
        emitter_pdf: Density<SolidAngle>,
    },
    /// By way of other vertices.
    Scattered {
        /// Edges of the whole path.
        length: u32,
        /// Whether its end was found by emitter sampling; otherwise a direction hit it.
        is_sampled_emitter: bool,
        /// One sample of the radiance: divided by the densities of everything behind the ray,
        /// weighted between the two techniques, and divided by the probability of having survived
        /// roulette.
        radiance: Vec3,
    },
}
