//! Paths as lists of directions and distances, and what a pixel makes of them.
//!
//! A path is told by coordinates that do not depend on the pixel: the distance `z₁` along the camera ray to its first vertex, then for each
//! further vertex the direction `ω` and distance `z` to it, and the endpoint on an emitter. A vertex on a surface has no distance of its
//! own: it is the first surface in its direction. In another pixel the same coordinates are another path, *direction reuse* of Lin 2022
//! §5.4.2: the shift is the identity on coordinates, its Jacobian is 1, and all that differs is the target.
//!
//! In the measure `dz₁ dω₁ dz₂ … de` the integrand of a path with `k` scattering vertices is
//!
//! > `F = Π_{i=1}^{k} T(x_{i−1} ↔ x_i) s_i · T(x_k ↔ e) L_e |dω/de|`,
//!
//! `s_i = σ_s(x_i) ρ(ω_{i−1} → ω_i)` in media, `f |cos θ|` on surfaces (eqs. 5.10, 5.11 with G = 1); of a path that ends in a medium that emits,
//! `F = Π_{i=1}^{k} T s_i · T(x_k ↔ x_{k+1}) σ_a(x_{k+1}) L_e(x_{k+1})`.

use super::pixel::VolumePixel;
use super::through::{Through, Volumes, transmitted};
use crate::ray_tally::{RayKind, RayTally};
use lightshed_resampling::{Jacobian, Pulled, ShiftMapping, Shifted, Space, Undefined};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::{DVec3, Vec3};
use lightshed_scene::volume::{DensityField, PhaseFunction};
use lightshed_scene::{
    Bsdf, EmitterConnection, EmitterEndpoint, Medium, MediumDensity, Ray, Rgb, SurfacePoint,
};

/// Most scattering vertices of a path that is reused.
pub const MAX_SCATTERINGS: u32 = 8;

/// Most vertices: one more, that emits.
const MAX_VERTICES: usize = MAX_SCATTERINGS as usize + 1;

/// `dz₁ dω₁ dz₂ … de`, each factor where there is one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PathCoordinates;
impl Space for PathCoordinates {}

/// From a vertex to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Step {
    /// Unit direction; of no meaning for the first vertex, which is on the camera ray.
    pub direction: Vec3,
    /// Of no meaning for vertices on surfaces.
    pub distance: f32,
}

/// A path but for its pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VolumePath {
    steps: [Step; MAX_VERTICES],
    count: u8,
    /// Bit `i`: vertex `i` is on a surface.
    surfaces: u16,
    /// `None` for a path whose last vertex emits.
    endpoint: Option<EmitterEndpoint>,
    /// Radiance from an endpoint in the environment, which is the same everywhere and dear to look up.
    sky: Rgb,
    /// The target in the pixel that holds it.
    pub target: f32,
}

impl VolumePath {
    pub const EMPTY: Self = Self {
        steps: [Step {
            direction: Vec3::ZERO,
            distance: 0.0,
        }; MAX_VERTICES],
        count: 0,
        surfaces: 0,
        endpoint: None,
        sky: Rgb::ZERO,
        target: 0.0,
    };

    /// One more vertex.
    pub fn push(&mut self, step: Step, is_surface: bool) {
        let place = usize::from(self.count);
        if place < MAX_VERTICES {
            self.steps[place] = step;
            self.surfaces |= u16::from(is_surface) << place;
            self.count += 1;
        }
    }

    /// The path from here to an emitter, that sends `radiance`.
    pub fn with_endpoint(mut self, endpoint: EmitterEndpoint, radiance: Rgb) -> Self {
        (self.endpoint, self.sky) = (Some(endpoint), radiance);
        self
    }

    /// The same path, as a pixel holds it where its target is that.
    pub fn with_target(self, target: f32) -> Self {
        Self { target, ..self }
    }

    /// Distance of the first vertex along the camera ray; `None` where that is on a surface.
    pub fn first_distance(&self) -> Option<f32> {
        (self.surfaces & 1 == 0).then_some(self.steps[0].distance)
    }
}

/// A vertex that scatters.
// A box would be an allocation for each vertex.
#[allow(clippy::large_enum_variant)]
pub(crate) enum Vertex<'a> {
    Medium {
        medium: &'a Medium,
        index: u32,
        position: Vec3,
        /// Of the ray that came.
        incoming: Vec3,
    },
    Surface {
        point: SurfacePoint,
        bsdf: Bsdf,
        wo: Vec3,
        /// What is around it where the ray came from.
        medium: Option<u32>,
    },
}

impl Vertex<'_> {
    pub fn position(&self) -> Vec3 {
        match self {
            Self::Medium { position, .. } => *position,
            Self::Surface { point, .. } => point.position,
        }
    }

    /// `σ_s ρ` or `f |cos θ|`, towards a unit direction.
    pub fn scattered(&self, direction: Vec3) -> DVec3 {
        match self {
            Self::Medium {
                medium,
                position,
                incoming,
                ..
            } => {
                let phase = medium.phase().phase_between(*incoming, direction);
                scattering(medium, *position) * f64::from(phase)
            }
            Self::Surface { point, bsdf, wo, .. } => bsdf
                .evaluate(*wo, point.shading.to_local(direction))
                .value
                .as_dvec3(),
        }
    }

    /// The ray that leaves in a unit direction, and the medium that it gets into.
    pub fn leave(&self, volumes: &Volumes<'_>, direction: Vec3) -> (Ray, Option<u32>) {
        match self {
            Self::Medium { position, index, .. } => (Ray::new(*position, direction), Some(*index)),
            Self::Surface { point, .. } => (point.spawn(direction), self.medium_towards(volumes, direction)),
        }
    }

    /// The segment to an endpoint, and the medium that it starts in.
    fn shadow_ray(&self, volumes: &Volumes<'_>, connection: &EmitterConnection) -> (Ray, Option<u32>) {
        match self {
            Self::Medium { position, index, .. } => (connection.shadow_ray_from(*position), Some(*index)),
            Self::Surface { point, .. } => (
                connection.shadow_ray(point),
                self.medium_towards(volumes, connection.direction),
            ),
        }
    }

    fn medium_towards(&self, volumes: &Volumes<'_>, direction: Vec3) -> Option<u32> {
        match self {
            Self::Medium { index, .. } => Some(*index),
            Self::Surface { point, medium, .. } => match volumes.scene.medium_sides(point.primitive) {
                Some(sides) => sides.towards(direction.dot(point.geometric_normal)),
                None => *medium,
            },
        }
    }
}

/// `σ_t(x)` by channel.
fn extinction(medium: &Medium, position: Vec3) -> DVec3 {
    let density = match medium.density() {
        MediumDensity::Homogeneous => 1.0,
        MediumDensity::Grid(field) => {
            let (place, bounds) = (field.to_field().transform_point3(position), field.grid().bounds());
            let inside = place.cmpge(bounds.min()).all() && place.cmple(bounds.max()).all();
            if inside { field.grid().density(place) } else { 0.0 }
        }
    };
    medium.extinction().as_dvec3() * f64::from(density)
}

/// `σ_s(x)`.
fn scattering(medium: &Medium, position: Vec3) -> DVec3 {
    extinction(medium, position) * medium.albedo().as_dvec3()
}

/// `σ_a(x) L_e(x)`.
pub(crate) fn emission(medium: &Medium, position: Vec3) -> DVec3 {
    extinction(medium, position) * medium.emission_per_collision(position).as_dvec3()
}

/// How paths are evaluated.
pub(crate) struct Evaluation<'a> {
    pub volumes: &'a Volumes<'a>,
    pub tally: &'a RayTally,
    /// Level of densities in transmittances between vertices.
    pub level: u32,
    /// The same towards emitters.
    pub shadow_level: u32,
}

/// What light arrives at a vertex, and how likely emitter sampling finds it there.
pub(crate) struct Lit {
    /// `s T L_e |dω/de|`.
    pub value: DVec3,
    /// Of the endpoint, in its measure.
    pub pdf: f64,
    /// From the endpoint.
    pub radiance: Rgb,
}

/// What finds out about a segment: the ray, the medium that it starts in, and whether it goes to an emitter.
pub(crate) trait Look: FnMut(&Ray, Option<u32>, bool) -> Through {}
impl<F: FnMut(&Ray, Option<u32>, bool) -> Through> Look for F {}

impl Evaluation<'_> {
    /// `F` of the path in a pixel, with transmittances of these levels; its factors may be of any size.
    pub fn value(&self, pixel: &VolumePixel, path: &VolumePath) -> DVec3 {
        let look = |ray: &Ray, medium, to_emitter| self.look(ray, medium, to_emitter);
        self.follow(pixel, path, true, look).unwrap_or(DVec3::ZERO)
    }

    /// `|F|` over the channels, as a target.
    pub fn target(&self, pixel: &VolumePixel, path: &VolumePath) -> f32 {
        target_of(self.value(pixel, path))
    }

    /// An unbiased estimate of `F` with exact transmittances; it may be negative.
    pub fn estimate(&self, pixel: &VolumePixel, path: &VolumePath, rng: &mut CounterRng) -> DVec3 {
        let look = |ray: &Ray, medium, _| self.volumes.estimate(ray, medium, rng);
        self.follow(pixel, path, false, look).unwrap_or(DVec3::ZERO)
    }

    fn look(&self, ray: &Ray, medium: Option<u32>, to_emitter: bool) -> Through {
        let level = if to_emitter { self.shadow_level } else { self.level };
        self.volumes.through(ray, medium, level)
    }

    /// `by_pixel`: transmittances from the camera are those that the pixel knows.
    fn follow(
        &self,
        pixel: &VolumePixel,
        path: &VolumePath,
        by_pixel: bool,
        mut look: impl Look,
    ) -> Option<DVec3> {
        let mut vertex = None;
        let mut value = DVec3::ONE;
        for place in 0..usize::from(path.count) {
            let (step, is_surface) = (path.steps[place], path.surfaces >> place & 1 == 1);
            let (next, transmittance) = match &vertex {
                None => self.first(pixel, step.distance, is_surface, by_pixel, &mut look)?,
                Some(from) => self.next(from, step, is_surface, &mut value, &mut look)?,
            };
            value *= transmittance;
            vertex = Some(next);
        }
        let vertex = vertex?;
        value *= match (&path.endpoint, &vertex) {
            (None, Vertex::Medium { medium, position, .. }) => emission(medium, *position),
            (None, Vertex::Surface { .. }) => return None,
            (Some(EmitterEndpoint::Environment { direction }), _) => {
                let scattered = vertex.scattered(*direction) * path.sky.as_dvec3();
                if !(scattered.max_element() > 0.0) {
                    return None;
                }
                let (ray, medium) = vertex.leave(self.volumes, *direction);
                self.tally.add(RayKind::Emitter, 1);
                let through = look(&ray, medium, true);
                if through.surface.is_some() {
                    return None;
                }
                scattered * through.transmittance
            }
            (Some(endpoint), _) => self.lit_by(&vertex, endpoint, &mut look)?.value,
        };
        Some(value)
    }

    /// The vertex on the camera ray, and the transmittance up to it.
    fn first(
        &self,
        pixel: &VolumePixel,
        distance: f32,
        is_surface: bool,
        by_pixel: bool,
        look: &mut impl Look,
    ) -> Option<(Vertex<'_>, DVec3)> {
        if is_surface {
            let vertex = pixel.surface_vertex()?;
            let transmittance = if by_pixel {
                transmitted(pixel.depth_of_surface())
            } else {
                look(&pixel.ray, pixel.medium, false).transmittance
            };
            return Some((vertex, transmittance));
        }
        let (index, depth) = pixel.depth_at(distance)?;
        let transmittance = if by_pixel {
            transmitted(depth)
        } else {
            let ray = Ray::segment(pixel.ray.origin, pixel.ray.direction, distance);
            look(&ray, pixel.medium, false).transmittance
        };
        let vertex = Vertex::Medium {
            medium: &self.volumes.scene.media()[index as usize],
            index,
            position: pixel.ray.origin + pixel.ray.direction * distance,
            incoming: pixel.ray.direction,
        };
        Some((vertex, transmittance))
    }

    /// The vertex a step behind another, the transmittance in between, and the scattering towards it in `value`.
    fn next(
        &self,
        from: &Vertex<'_>,
        step: Step,
        is_surface: bool,
        value: &mut DVec3,
        look: &mut impl Look,
    ) -> Option<(Vertex<'_>, DVec3)> {
        let scattered = from.scattered(step.direction);
        if scattered == DVec3::ZERO {
            return None;
        }
        *value *= scattered;
        let (mut ray, medium) = from.leave(self.volumes, step.direction);
        if !is_surface {
            ray.t_max = step.distance;
        }
        self.tally.add(RayKind::Reconnection, 1);
        let through = look(&ray, medium, false);
        let vertex = match (is_surface, through.surface, through.medium) {
            (true, Some(point), medium) => surface_vertex(self.volumes, point, &ray, medium),
            (false, None, Some(index)) => Vertex::Medium {
                medium: &self.volumes.scene.media()[index as usize],
                index,
                position: ray.origin + ray.direction * step.distance,
                incoming: ray.direction,
            },
            _ => return None,
        };
        Some((vertex, through.transmittance))
    }

    /// Light from an endpoint at a vertex, with transmittances of these levels. `None` if nothing arrives.
    pub fn lit(&self, vertex: &Vertex<'_>, endpoint: &EmitterEndpoint) -> Option<Lit> {
        let mut look = |ray: &Ray, medium, to_emitter| self.look(ray, medium, to_emitter);
        self.lit_by(vertex, endpoint, &mut look)
    }

    fn lit_by(&self, vertex: &Vertex<'_>, endpoint: &EmitterEndpoint, look: &mut impl Look) -> Option<Lit> {
        let connection = self
            .volumes
            .scene
            .emitters()
            .connect(vertex.position(), endpoint)?;
        let per_endpoint = f64::from(connection.solid_angle_per_endpoint);
        let value = vertex.scattered(connection.direction) * connection.radiance.as_dvec3() * per_endpoint;
        if !(value.max_element() > 0.0) {
            return None;
        }
        let (ray, medium) = vertex.shadow_ray(self.volumes, &connection);
        self.tally.add(RayKind::Emitter, 1);
        let through = look(&ray, medium, true);
        if through.surface.is_some() {
            return None;
        }
        Some(Lit {
            value: value * through.transmittance,
            pdf: f64::from(connection.pdf_endpoint),
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

/// A vertex on a surface that `ray` met, having come through `medium`.
pub(crate) fn surface_vertex<'a>(
    volumes: &Volumes<'_>,
    point: SurfacePoint,
    ray: &Ray,
    medium: Option<u32>,
) -> Vertex<'a> {
    Vertex::Surface {
        bsdf: volumes.scene.bsdf(&point),
        wo: point.shading.to_local(-ray.direction),
        point,
        medium,
    }
}

/// Direction reuse: coordinates stay, the target is that of where they arrive.
///
/// Pixels of two frames have targets by what was there in theirs; each is odd or even.
pub(crate) struct DirectionReuse<'a> {
    pub even: Evaluation<'a>,
    pub odd: Evaluation<'a>,
}

impl DirectionReuse<'_> {
    fn target(&self, pixel: &VolumePixel, path: &VolumePath) -> f32 {
        let frame = if pixel.odd_frame { &self.odd } else { &self.even };
        frame.target(pixel, path)
    }
}

impl ShiftMapping<VolumePixel> for DirectionReuse<'_> {
    fn shift(
        &self,
        x: &VolumePath,
        _from: &VolumePixel,
        to: &VolumePixel,
    ) -> Result<Shifted<VolumePath>, Undefined> {
        let target = self.target(to, x);
        Ok(Shifted {
            sample: VolumePath { target, ..*x },
            jacobian: Jacobian::IDENTITY,
            target: f64::from(target),
        })
    }

    fn pull(&self, y: &VolumePath, _to: &VolumePixel, from: &VolumePixel) -> Result<Pulled, Undefined> {
        Ok(Pulled {
            jacobian: Jacobian::IDENTITY,
            proxy: f64::from(self.target(from, y)),
        })
    }
}
