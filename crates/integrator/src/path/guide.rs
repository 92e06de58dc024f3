//! Directions by a guide, besides those of what scatters.

use lightshed_sampling::{Density, DirectionDistribution, SolidAngle};
use lightshed_scene::glam::Vec3;

/// A vertex, as a guide knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidedVertex {
    /// Position.
    pub position: Vec3,
    /// Unit shading normal, on either side of the surface; `None` in a medium.
    pub normal: Option<Vec3>,
    /// Unit direction towards the vertex before.
    pub outgoing: Vec3,
}

/// Says where light is likely to come from.
///
/// At a vertex with a guide `g` of share `α`, directions have the density
/// `p = (1 − α) p_s + α p_g`, with `p_s` that of what scatters there (its lobes without width
/// apart), in the solid-angle measure: one sample of the mixture, whose density enters all weights,
/// so that estimates are unbiased for any guide, however wrong. A wrong one costs noise: at most a
/// weight of `1/(1 − α)` times that without it.
///
/// Nothing is guided where only lobes without width scatter.
pub trait DirectionGuide: Sync {
    /// Whether it ever guides: false compiles to nothing.
    const IS_ACTIVE: bool = true;

    /// What it knows at a vertex.
    type Distribution<'g>: DirectionDistribution
    where
        Self: 'g;

    /// The directions from which light comes to a vertex, and the share `α` of them; `None` leaves
    /// them to what scatters. `α` is brought into 0 to [`MAX_GUIDE_SHARE`]; not a number is 0. A
    /// pure function as long as paths are traced.
    fn guide(&self, vertex: &GuidedVertex) -> Option<(Self::Distribution<'_>, f32)>;
}

/// Largest share of directions that is left to a guide: what it does not know of must be found as
/// well.
pub const MAX_GUIDE_SHARE: f32 = 0.99;

/// No guide.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoGuide;

/// There is none.
#[derive(Clone, Copy, Debug)]
pub enum NoDirections {}

impl DirectionDistribution for NoDirections {
    fn sample(&self, _u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        match *self {}
    }

    fn pdf(&self, _direction: Vec3) -> Density<SolidAngle> {
        match *self {}
    }
}

impl DirectionGuide for NoGuide {
    const IS_ACTIVE: bool = false;

    type Distribution<'g> = NoDirections;

    #[inline(always)]
    fn guide(&self, _vertex: &GuidedVertex) -> Option<(NoDirections, f32)> {
        None
    }
}

impl<G: DirectionGuide> DirectionGuide for &G {
    const IS_ACTIVE: bool = G::IS_ACTIVE;

    type Distribution<'g>
        = G::Distribution<'g>
    where
        Self: 'g;

    #[inline(always)]
    fn guide(&self, vertex: &GuidedVertex) -> Option<(G::Distribution<'_>, f32)> {
        G::guide(self, vertex)
    }
}
