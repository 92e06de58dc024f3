//! Guides: directions besides those of the BSDF or phase function.

use lightshed_guiding::FlightEnd;
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle};
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::FlightGuiding;

/// A vertex, as a guide sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidedVertex {
    /// Position.
    pub position: Vec3,
    /// Unit shading normal, on either side of the surface; `None` in a medium.
    pub normal: Option<Vec3>,
    /// Unit direction towards the previous vertex.
    pub outgoing: Vec3,
    /// What the surface reflects; `None` in a medium, and for guides that do not ask for it.
    pub lit: Option<ShadingPoint>,
}

/// Proposes directions from which light is likely to come.
///
/// At a vertex with a guide `g` of share `α`, directions have the density
/// `p = (1 − α) p_s + α p_g`, with `p_s` that of the BSDF or phase function (without lobes that
/// have no width), in the solid-angle measure. This is one sample of the mixture, whose density
/// enters all weights, so estimates are unbiased for any guide, however wrong. A wrong guide costs
/// noise: at most a weight of `1/(1 − α)` times that without it.
///
/// Nothing is guided where all lobes have no width.
pub trait DirectionGuide: Sync {
    /// Whether it ever guides: false compiles to nothing.
    const IS_ACTIVE: bool = true;

    /// What it knows at a vertex.
    type Distribution<'g>: DirectionDistribution
    where
        Self: 'g;

    /// Whether it reads what surfaces reflect. If not, callers need not look for it.
    #[inline(always)]
    fn uses_reflection(&self) -> bool {
        false
    }

    /// The directions from which light comes to a vertex, and the share `α` of them; `None` leaves
    /// all to the BSDF. `α` is clamped to 0 to [`MAX_GUIDE_SHARE`]; NaN counts as 0. A pure
    /// function as long as paths are traced.
    fn guide(&self, vertex: &GuidedVertex) -> Option<(Self::Distribution<'_>, f32)>;

    /// The probability with which a path is to go on from a vertex that it reached with this
    /// `throughput` by its edge number `depth`; `None` leaves that to roulette by throughput. It is
    /// clamped to [`LEAST_SURVIVAL`] to 1. A pure function as long as paths are traced; it knows
    /// nothing of the direction in which the path would go on.
    #[inline(always)]
    fn survival(&self, _vertex: &GuidedVertex, _throughput: Rgb, _depth: u32) -> Option<f32> {
        None
    }

    /// How flights through media are guided between colliding and passing; `None` if they are not.
    #[inline(always)]
    fn flights(&self) -> Option<FlightGuiding> {
        None
    }

    /// The worth of a flight that ends at this position: the root of the second moment of what
    /// paths find there and behind, per unit of throughput. `None` where it is not known. A pure
    /// function as long as paths are traced.
    #[inline(always)]
    fn arrival_worth(&self, _position: Vec3, _end: FlightEnd) -> Option<f32> {
        None
    }
}

/// Least probability of survival that a guide may ask for: weights grow by at most its inverse.
pub const LEAST_SURVIVAL: f32 = 0.1;

/// Largest share of directions that a guide gets: light that it does not know must be found, too.
pub const MAX_GUIDE_SHARE: f32 = 0.99;

/// The share that counts: at most [`MAX_GUIDE_SHARE`]; `None` for zero and for what is no number.
#[inline(always)]
pub(crate) fn usable_share(share: f32) -> Option<f32> {
    (share > 0.0).then(|| share.min(MAX_GUIDE_SHARE))
}

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
    fn uses_reflection(&self) -> bool {
        G::uses_reflection(self)
    }

    #[inline(always)]
    fn guide(&self, vertex: &GuidedVertex) -> Option<(G::Distribution<'_>, f32)> {
        G::guide(self, vertex)
    }

    #[inline(always)]
    fn survival(&self, vertex: &GuidedVertex, throughput: Rgb, depth: u32) -> Option<f32> {
        G::survival(self, vertex, throughput, depth)
    }

    #[inline(always)]
    fn flights(&self) -> Option<FlightGuiding> {
        G::flights(self)
    }

    #[inline(always)]
    fn arrival_worth(&self, position: Vec3, end: FlightEnd) -> Option<f32> {
        G::arrival_worth(self, position, end)
    }
}
