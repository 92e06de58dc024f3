//! What a pixel makes of a path.

use super::path::{Connection, Step, VolumePath};
use super::pixel::VolumePixel;
use super::through::{Through, Volumes};
use super::vertex::{Vertex, emission, surface_vertex};
use lightshed_film::{RayKind, RayTally};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::{DVec3, Vec3};
use lightshed_scene::{Camera, EmitterEndpoint, Ray, Rgb};

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
    pub reach: Reach,
}

/// The least length of an edge that is connected; the same for a path in every pixel.
#[derive(Clone, Copy)]
pub(crate) struct Reach {
    /// Per unit of the first distance.
    pub per_distance: f32,
    /// Of a path whose first vertex is on a surface.
    pub from_surface: f32,
}

impl Reach {
    /// For a path.
    pub fn of(&self, path: &VolumePath) -> f32 {
        match path.first_distance() {
            Some(distance) => self.per_distance * distance,
            None => self.from_surface,
        }
    }
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

/// Part of a path.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Segment {
    /// From the camera.
    Camera,
    /// Between vertices.
    Between,
    /// To an emitter.
    Emitter,
}

/// What finds out about a segment: the ray, and the medium that it starts in.
pub(crate) trait Look: FnMut(&Ray, Option<u32>, Segment) -> Through {}
impl<F: FnMut(&Ray, Option<u32>, Segment) -> Through> Look for F {}

/// `F` in its factors, with the connection as it is in the pixel.
struct Followed {
    value: DVec3,
    connection: Connection,
}

impl Evaluation<'_> {
    /// The path as a pixel holds it: with its target, `|F|` over the channels with transmittances of these levels, and its connection.
    ///
    /// `is_known`: what is behind the connection is what the path says.
    pub fn settled(&self, pixel: &VolumePixel, path: &VolumePath, is_known: bool) -> VolumePath {
        let look = |ray: &Ray, medium, segment| self.look(ray, medium, segment);
        match self.follow(pixel, path, is_known, look) {
            Some(Followed { value, connection }) => path.held(connection, target_of(value)),
            None => path.held(path.connection, 0.0),
        }
    }

    /// An unbiased estimate of `F` with exact transmittances; it may be negative.
    pub fn estimate(&self, pixel: &VolumePixel, path: &VolumePath, rng: &mut CounterRng) -> DVec3 {
        let look = |ray: &Ray, medium, _| self.volumes.estimate(ray, medium, rng);
        self.follow(pixel, path, false, look)
            .map_or(DVec3::ZERO, |followed| followed.value)
    }

    fn look(&self, ray: &Ray, medium: Option<u32>, segment: Segment) -> Through {
        let level = match segment {
            Segment::Camera => self.camera_level,
            Segment::Between => self.level,
            Segment::Emitter => self.shadow_level,
        };
        self.volumes.through(ray, medium, level)
    }

    /// `None` where no light comes.
    fn follow(
        &self,
        pixel: &VolumePixel,
        path: &VolumePath,
        is_known: bool,
        mut look: impl Look,
    ) -> Option<Followed> {
        let connected = path.connected_vertex().unwrap_or(usize::MAX);
        let mut connection = path.connection;
        // In front of the connection's vertex, and behind.
        let (mut front, mut behind) = (DVec3::ONE, DVec3::ONE);
        let (mut vertex, through) = self.first(pixel, path, &mut look)?;
        front *= through;
        for place in 1..path.vertices() {
            let (mut step, is_surface) = path.step(place);
            if place == connected {
                let between = connection.place - vertex.position();
                connection.length = between.length();
                if !(connection.length >= self.reach.of(path)) {
                    return None;
                }
                step = Step {
                    direction: between / connection.length,
                    distance: connection.length,
                };
            }
            let scattered = if let Some(lobe) = path.lobe_to(place) {
                let reflected = vertex.reflected(lobe)?;
                step.direction = reflected.direction;
                reflected.share
            } else if place == connected.saturating_add(1) {
                connection.onward = step.direction;
                front *= vertex.phase(step.direction);
                vertex.scattering()
            } else {
                vertex.scattered(step.direction)
            };
            if !(scattered.max_element() > 0.0) {
                return None;
            }
            let (next, through) = self.next(&vertex, step, is_surface, &mut look)?;
            let factor = if place > connected {
                &mut behind
            } else {
                &mut front
            };
            *factor *= scattered * through;
            vertex = next;
            if place == connected {
                if let Vertex::Medium { position, .. } = &mut vertex {
                    *position = connection.place;
                }
                if is_known {
                    let phase = if connection.onward == Vec3::ZERO {
                        1.0
                    } else {
                        vertex.phase(connection.onward)
                    };
                    return Some(Followed {
                        value: front * phase * connection.behind,
                        connection,
                    });
                }
            }
        }
        let last = path.vertices() - 1;
        let (light, onward) = match (&path.endpoint, &vertex) {
            (None, Vertex::Medium { medium, position, .. }) => (emission(medium, *position), Vec3::ZERO),
            (None, Vertex::Surface { .. }) => {
                path.lobe_to(last)?;
                (vertex.emitted(self.volumes.scene.emitters()), Vec3::ZERO)
            }
            (Some(_), _) if let Some(lobe) = path.lobe_to(path.vertices()) => {
                let reflected = vertex.reflected(lobe)?;
                let sky = self
                    .volumes
                    .scene
                    .emitters()
                    .environment()?
                    .radiance(reflected.direction);
                let (ray, medium) = vertex.leave(self.volumes, reflected.direction);
                self.tally.add(RayKind::Emitter, 1);
                let through = look(&ray, medium, Segment::Emitter);
                if through.surface.is_some() {
                    return None;
                }
                (
                    reflected.share * sky.as_dvec3() * through.transmittance,
                    Vec3::ZERO,
                )
            }
            (Some(EmitterEndpoint::Environment { direction }), _) => {
                let (ray, medium) = vertex.leave(self.volumes, *direction);
                self.tally.add(RayKind::Emitter, 1);
                let through = look(&ray, medium, Segment::Emitter);
                if through.surface.is_some() {
                    return None;
                }
                (path.sky.as_dvec3() * through.transmittance, *direction)
            }
            (Some(endpoint), _) => {
                let lit = self.lit_by(&vertex, endpoint, &mut look)?;
                (lit.arriving, lit.direction)
            }
        };
        let scattered = if onward == Vec3::ZERO {
            DVec3::ONE
        } else if last == connected {
            front *= vertex.phase(onward);
            vertex.scattering()
        } else {
            vertex.scattered(onward)
        };
        if last == connected {
            connection.onward = onward;
        }
        if last >= connected {
            behind *= scattered * light;
            connection.behind = behind;
        } else {
            front *= scattered * light;
        }
        Some(Followed {
            value: front * behind,
            connection,
        })
    }

    /// The vertex on the camera ray, and the transmittance up to it.
    fn first(
        &self,
        pixel: &VolumePixel,
        path: &VolumePath,
        look: &mut impl Look,
    ) -> Option<(Vertex<'_>, DVec3)> {
        let (step, is_surface) = path.step(0);
        let mut ray = self.camera.ray(pixel.corner + path.film, path.lens);
        if !is_surface {
            ray.t_max = step.distance;
        }
        self.tally.add(RayKind::Camera, 1);
        let through = look(&ray, self.camera_medium, Segment::Camera);
        let vertex = self.vertex(&ray, is_surface, &through)?;
        Some((vertex, through.transmittance))
    }

    /// What is at the end of a ray.
    fn vertex(&self, ray: &Ray, is_surface: bool, through: &Through) -> Option<Vertex<'_>> {
        match (is_surface, through.surface, through.medium) {
            (true, Some(point), medium) => Some(surface_vertex(self.volumes, point, ray, medium)),
            (false, None, Some(index)) => Some(Vertex::Medium {
                medium: &self.volumes.scene.media()[index as usize],
                index,
                position: ray.origin + ray.direction * ray.t_max,
                incoming: ray.direction,
            }),
            _ => None,
        }
    }

    /// The vertex a step behind another, and the transmittance in between.
    fn next(
        &self,
        from: &Vertex<'_>,
        step: Step,
        is_surface: bool,
        look: &mut impl Look,
    ) -> Option<(Vertex<'_>, DVec3)> {
        let (mut ray, medium) = from.leave(self.volumes, step.direction);
        if !is_surface {
            ray.t_max = step.distance;
        }
        self.tally.add(RayKind::Reconnection, 1);
        let through = look(&ray, medium, Segment::Between);
        let vertex = self.vertex(&ray, is_surface, &through)?;
        Some((vertex, through.transmittance))
    }

    /// Light from an endpoint at a vertex, with transmittances of these levels. `None` if nothing arrives.
    pub fn lit(&self, vertex: &Vertex<'_>, endpoint: &EmitterEndpoint) -> Option<Lit> {
        let mut look = |ray: &Ray, medium, segment| self.look(ray, medium, segment);
        self.lit_by(vertex, endpoint, &mut look)
    }

    fn lit_by(&self, vertex: &Vertex<'_>, endpoint: &EmitterEndpoint, look: &mut impl Look) -> Option<Lit> {
        let connection = self
            .volumes
            .scene
            .emitters()
            .connect(vertex.position(), endpoint)?;
        let per_endpoint = f64::from(connection.solid_angle_per_endpoint);
        let scattered = vertex.scattered(connection.direction);
        let radiance = connection.radiance.as_dvec3() * per_endpoint;
        if !((scattered * radiance).max_element() > 0.0) {
            return None;
        }
        let (ray, medium) = vertex.shadow_ray(self.volumes, &connection);
        self.tally.add(RayKind::Emitter, 1);
        let through = look(&ray, medium, Segment::Emitter);
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

/// `|F|` over the channels as it is stored: of all targets that one gives the least mean squared error of the colour. By luminance, red
/// and blue light would be chosen too rarely for what it adds.
pub(crate) fn target_of(value: DVec3) -> f32 {
    let target = (value.length() * THIRD_ROOT) as f32;
    if target < f32::INFINITY { target } else { f32::MAX }
}

/// `1/√3`: white light has the target of its channels.
const THIRD_ROOT: f64 = 0.577_350_269_189_625_8;
