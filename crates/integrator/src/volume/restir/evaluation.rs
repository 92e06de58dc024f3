//! A scene with media as shifts of paths through volumes see it.

use super::pixel::VolumePixel;
use super::through::{Through, Volumes};
use super::vertex::{Vertex, emission, surface_vertex};
use lightshed_film::{RayKind, RayTally};
use lightshed_scene::glam::{DVec3, Vec3};
use lightshed_scene::{Camera, EmitterEndpoint, Ray, Rgb};
use lightshed_shift::{ConnectionReach, EdgeEnd, Reflection, SensorPlace, Transmittance, VolumeWorld};

/// How paths are evaluated.
pub(crate) struct Evaluation<'a> {
    pub volumes: &'a Volumes<'a>,
    pub tally: &'a RayTally,
    pub camera: Camera,
    /// What that is in.
    pub camera_medium: Option<u32>,
    /// Level of densities in transmittances from the camera.
    pub camera_level: u32,
    /// The same between vertices.
    pub level: u32,
    /// The same towards emitters.
    pub shadow_level: u32,
    /// Which edges are connected.
    pub reach: ConnectionReach,
}

/// What light arrives at a vertex, and how likely emitter sampling finds it there.
pub(crate) struct Lit {
    /// Unit direction to the endpoint.
    pub direction: Vec3,
    /// `T L_e |dω/de|`.
    pub arriving: DVec3,
    /// `s T L_e |dω/de|`.
    pub value: DVec3,
    /// Of the endpoint, in its measure.
    pub pdf: f64,
    /// `|dω/de|`.
    pub per_endpoint: f64,
    /// From the endpoint.
    pub radiance: Rgb,
}

impl<'a> Evaluation<'a> {
    fn through(
        &self,
        ray: &Ray,
        medium: Option<u32>,
        level: u32,
        transmittance: &mut Transmittance<'_>,
    ) -> Through {
        match transmittance {
            Transmittance::Target => self.volumes.through(ray, medium, level),
            Transmittance::Estimate(rng) => self.volumes.estimate(ray, medium, rng),
        }
    }

    /// The vertex at the end of a ray, which goes no further than `end`, and the transmittance up
    /// to it.
    fn arrive(
        &self,
        mut ray: Ray,
        medium: Option<u32>,
        end: EdgeEnd,
        level: u32,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vertex<'a>, DVec3)> {
        if let EdgeEnd::Medium(distance) = end {
            ray.t_max = distance;
        }
        let through = self.through(&ray, medium, level, transmittance);
        let vertex = match (end, through.surface, through.medium) {
            (EdgeEnd::Surface, Some(point), medium) => surface_vertex(self.volumes, point, &ray, medium),
            (EdgeEnd::Medium(_), None, Some(index)) => Vertex::Medium {
                medium: &self.volumes.scene.media()[index as usize],
                index,
                position: ray.origin + ray.direction * ray.t_max,
                incoming: ray.direction,
            },
            _ => return None,
        };
        Some((vertex, through.transmittance))
    }

    /// Light from an endpoint at a vertex. `None` if nothing arrives.
    pub fn light_from(
        &self,
        vertex: &Vertex<'_>,
        endpoint: &EmitterEndpoint,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<Lit> {
        let connection = self.volumes.emitters().connect(vertex.position(), endpoint)?;
        let per_endpoint = f64::from(connection.solid_angle_per_endpoint);
        let scattered = vertex.scattered(connection.direction);
        let radiance = connection.radiance.as_dvec3() * per_endpoint;
        if !((scattered * radiance).max_element() > 0.0) {
            return None;
        }
        let (ray, medium) = vertex.shadow_ray(self.volumes, &connection);
        self.tally.add(RayKind::Emitter, 1);
        let through = self.through(&ray, medium, self.shadow_level, transmittance);
        if through.surface.is_some() {
            return None;
        }
        let arriving = radiance * through.transmittance;
        Some(Lit {
            direction: connection.direction,
            arriving,
            value: scattered * arriving,
            pdf: f64::from(connection.pdf_endpoint),
            per_endpoint,
            radiance: connection.radiance,
        })
    }
}

impl<'a> VolumeWorld for Evaluation<'a> {
    type Vertex = Vertex<'a>;
    type Pixel = VolumePixel;
    type Endpoint = EmitterEndpoint;

    fn first(
        &self,
        pixel: &VolumePixel,
        place: SensorPlace,
        end: EdgeEnd,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vertex<'a>, DVec3)> {
        let ray = self.camera.ray(pixel.corner + place.film, place.lens);
        self.tally.add(RayKind::Camera, 1);
        self.arrive(ray, self.camera_medium, end, self.camera_level, transmittance)
    }

    fn next(
        &self,
        from: &Vertex<'a>,
        direction: Vec3,
        end: EdgeEnd,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vertex<'a>, DVec3)> {
        let (ray, medium) = from.leave(self.volumes, direction);
        self.tally.add(RayKind::Reconnection, 1);
        self.arrive(ray, medium, end, self.level, transmittance)
    }

    fn position(&self, vertex: &Vertex<'a>) -> Vec3 {
        vertex.position()
    }

    fn set_position(&self, vertex: &mut Vertex<'a>, place: Vec3) {
        if let Vertex::Medium { position, .. } = vertex {
            *position = place;
        }
    }

    fn scattered(&self, vertex: &Vertex<'a>, direction: Vec3) -> DVec3 {
        vertex.scattered(direction)
    }

    fn scattering(&self, vertex: &Vertex<'a>) -> DVec3 {
        vertex.scattering()
    }

    fn phase(&self, vertex: &Vertex<'a>, direction: Vec3) -> f64 {
        vertex.phase(direction)
    }

    fn reflected(&self, vertex: &Vertex<'a>, lobe: u8) -> Option<Reflection> {
        let reflected = vertex.reflected(lobe)?;
        Some(Reflection {
            direction: reflected.direction,
            share: reflected.share,
        })
    }

    fn emitted(&self, vertex: &Vertex<'a>) -> DVec3 {
        match vertex {
            Vertex::Medium { medium, position, .. } => emission(medium, *position),
            Vertex::Surface { .. } => vertex.emitted(self.volumes.scene.emitters()),
        }
    }

    fn lit(
        &self,
        vertex: &Vertex<'a>,
        endpoint: &EmitterEndpoint,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<(Vec3, DVec3)> {
        let lit = self.light_from(vertex, endpoint, transmittance)?;
        Some((lit.direction, lit.arriving))
    }

    fn environment_direction(&self, endpoint: &EmitterEndpoint) -> Option<Vec3> {
        match endpoint {
            EmitterEndpoint::Environment { direction } => Some(*direction),
            _ => None,
        }
    }

    fn environment(&self, direction: Vec3) -> DVec3 {
        let environment = self.volumes.scene.emitters().environment();
        environment.map_or(DVec3::ZERO, |sky| sky.radiance(direction).as_dvec3())
    }

    fn transmittance_to_environment(
        &self,
        vertex: &Vertex<'a>,
        direction: Vec3,
        transmittance: &mut Transmittance<'_>,
    ) -> Option<DVec3> {
        let (ray, medium) = vertex.leave(self.volumes, direction);
        self.tally.add(RayKind::Emitter, 1);
        let through = self.through(&ray, medium, self.shadow_level, transmittance);
        through.surface.is_none().then_some(through.transmittance)
    }

    fn connection_reach(&self) -> ConnectionReach {
        self.reach
    }
}
