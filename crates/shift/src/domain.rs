//! The paths behind one surface point seen from the camera.

use crate::connectability::Connectability;
use crate::sample::{MAX_PATH_LENGTH, PathSample};
use crate::world::World;
use lightshed_resampling::Domain;
use lightshed_sampling::PrimarySample;
use lightshed_sampling::glam::Vec3;

/// The domain of a pixel: all paths `x₁ x₂ … x_k`, `2 ≤ k ≤ max_length`, that start at a given surface point `x₁` seen from a
/// given direction, with a sequence of lobes (Lin 2022 §6.6.6), in primary sample space.
///
/// **Integrand.** `F = ω f / p`, with `f` the product of one lobe at every vertex (of all of them where the last vertex was
/// found by sampling an emitter) and of the emitted radiance, `p` the density with which [`TreeTracer`](crate::TreeTracer)
/// finds the path, roulette aside, and `ω` the power heuristic between the two ways to find the last vertex. Its
/// integral over the domain is the radiance that leaves `x₁` towards the viewer, but for what `x₁` emits.
///
/// **Measure.** `dμ = p(x̄) dx̄`: of a path that is sampled by the domain's own sampler the weight is 1.
///
/// **Target.** `p̂ = luminance(F)`, visibility included.
pub struct PathDomain<'w, W: World> {
    pub(crate) world: &'w W,
    pub(crate) first: W::Vertex,
    pub(crate) wo: Vec3,
    pub(crate) connectability: Connectability,
    pub(crate) max_length: u32,
}

impl<W: World> Clone for PathDomain<'_, W> {
    fn clone(&self) -> Self {
        Self {
            first: self.first.clone(),
            ..*self
        }
    }
}

impl<'w, W: World> PathDomain<'w, W> {
    /// The paths behind `first` as seen from `wo` (the unit direction to the viewer), of at most `max_length` edges with that
    /// from the camera ([`MAX_PATH_LENGTH`] if that is less). A domain of the previous frame has that frame's world, vertex and
    /// direction.
    pub fn new(
        world: &'w W,
        first: W::Vertex,
        wo: Vec3,
        connectability: Connectability,
        max_length: u32,
    ) -> Self {
        Self {
            world,
            first,
            wo,
            connectability,
            max_length: max_length.min(MAX_PATH_LENGTH),
        }
    }

    /// The unit direction from there to the viewer.
    pub fn wo(&self) -> Vec3 {
        self.wo
    }

    /// The point that the paths start at.
    pub fn first(&self) -> &W::Vertex {
        &self.first
    }
}

impl<W: World> Domain for PathDomain<'_, W> {
    type Sample = PathSample;
    type Space = PrimarySample;

    /// Of a sample of *this* domain.
    #[inline(always)]
    fn target(&self, x: &PathSample) -> f64 {
        x.target()
    }
}
