//! Where a ray leads: a surface or the environment.

use super::lighting::WorldLighting;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, SolidAngle};

/// What a ray meets.
pub(crate) enum End<'a, V> {
    Surface(&'a V),
    Environment,
}

impl<'a, V> End<'a, V> {
    /// The end of a ray that has found `vertex`, or nothing.
    #[inline(always)]
    pub fn of(vertex: Option<&'a V>) -> Self {
        vertex.map_or(Self::Environment, Self::Surface)
    }

    /// Radiance against a ray of this direction.
    #[inline(always)]
    pub fn radiance<W: WorldLighting<Vertex = V> + ?Sized>(&self, world: &W, direction: Vec3) -> Vec3 {
        match *self {
            Self::Surface(vertex) => world.emitted(vertex, -direction),
            Self::Environment => world.environment(direction),
        }
    }

    /// Density with which emitter sampling at `from` finds the direction, if `radiance` arrives
    /// from it; otherwise 0, without a call.
    #[inline(always)]
    pub fn emitter_pdf<W: WorldLighting<Vertex = V> + ?Sized>(
        &self,
        world: &W,
        from: &W::Site,
        direction: Vec3,
        radiance: Vec3,
    ) -> Density<SolidAngle> {
        match *self {
            _ if radiance == Vec3::ZERO => Density::ZERO,
            Self::Surface(vertex) => world.emitter_pdf(from, vertex),
            Self::Environment => world.environment_pdf(from, direction),
        }
    }
}
