//! How a path left a vertex, and what it finds where it arrives.

use crate::mis::scattering_weight;
use crate::world::{End, Sight, World};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, SolidAngle};

/// How a path left the previous vertex.
pub(crate) struct Departure<S> {
    pub site: S,
    pub position: Vec3,
    /// Direction to the viewer there.
    pub wo: Vec3,
    /// The path's throughput before it was scattered there.
    pub throughput: Vec3,
    pub direction: Vec3,
    pub lobe: u8,
    pub roughness: f32,
    /// Of the lobe, joint.
    pub pdf: Density<SolidAngle>,
    /// Over all lobes.
    pub total_pdf: Density<SolidAngle>,
    pub is_delta: bool,
}

/// A vertex that the path has reached. Computed from the two positions, as a shift does, not from
/// the direction that led from one to the other, which differs by the offsets of rays.
#[derive(Clone, Copy)]
pub(crate) struct Arrival {
    /// Unit direction from the vertex before.
    pub direction: Vec3,
    /// The lobe by which the path left the vertex before.
    pub lobe_before: u8,
    /// `p(x_m)` of the lobe, joint, in area measure.
    pub density_area: f32,
    /// Of the two vertices.
    pub distance_squared: f32,
    /// `Π f / p` over all vertices but the one arrived at.
    pub throughput: Vec3,
}

impl<S> Departure<S> {
    /// The arrival along `sight`, from `before`, which is the vertex that was left.
    #[inline(always)]
    pub fn arrival<W: World<Site = S>>(&self, world: &W, before: &W::Vertex, sight: &Sight) -> Arrival {
        let scattering = world.evaluate_lobe(before, self.wo, sight.direction, self.lobe);
        Arrival {
            direction: sight.direction,
            lobe_before: self.lobe,
            density_area: sight.to_area(scattering.pdf).value(),
            distance_squared: sight.distance_squared,
            throughput: self.throughput * scattering.weight(),
        }
    }

    /// Radiance that the path has met at its end, and the density with which an emitter sample
    /// would have found it: zero behind a lobe without width. `None` if nothing is emitted there.
    #[inline(always)]
    pub fn met<W: World<Site = S>>(
        &self,
        world: &W,
        end: End<'_, W::Vertex>,
    ) -> Option<(Vec3, Density<SolidAngle>)> {
        let radiance = end.radiance(world, self.direction);
        if radiance == Vec3::ZERO {
            return None;
        }
        let emitter_pdf = if self.is_delta {
            Density::ZERO
        } else {
            end.emitter_pdf(world, &self.site, self.direction, radiance)
        };
        Some((radiance, emitter_pdf))
    }

    /// MIS weight of scattering at the vertex that was left, where an emitter sample has this
    /// density.
    #[inline(always)]
    pub fn weight(&self, emitter_pdf: Density<SolidAngle>) -> f32 {
        scattering_weight(self.total_pdf, emitter_pdf)
    }
}
