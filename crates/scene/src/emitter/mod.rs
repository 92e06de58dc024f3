//! Emitters: sampling a direction towards one, the density of that sample, and selection of one by
//! power.

mod area;
mod by_power;
mod emission;
mod endpoint;
mod environment;
mod environment_choice;
mod infinite;
mod lamps;
mod lanes;
#[cfg(test)]
mod lanes_tests;
mod on_one;
mod outline;
mod point;
mod sky_sampling;

#[cfg(test)]
mod tests;

pub(crate) use area::AreaEmitter;
pub use by_power::EmittersByPower;
pub(crate) use by_power::PowerTable;
pub use emission::EmittedRay;
pub(crate) use emission::Surroundings;
pub use endpoint::{EmitterConnection, EmitterEndpoint};
pub use environment::{Environment, EnvironmentLanes};
pub use environment_choice::EnvironmentChoice;
pub use lanes::EmitterLanes;
pub use on_one::{EmitterExtent, EmitterOrientation};
pub use outline::EmitterOutline;
pub use sky_sampling::{SkySampling, UnknownSkySampling};

use crate::SceneError;
use crate::surface::offset_along;
use crate::{EmitterDescription, FlatDelta, Ray, Rgb, SurfacePoint, luminance};
use glam::Vec3;
use infinite::Directional;
use lightshed_sampling::{Density, SolidAngle};
use point::{Point, Spot};
use std::sync::Arc;

/// All emitters of a scene, by index: their emission, and the densities of sampling a selected one.
/// The sampler of emitters multiplies them by the probability of the selection.
pub struct Emitters {
    /// Emitters `0 ..` by index: surfaces, …
    areas: Vec<AreaEmitter>,
    /// … then points and spots, …
    points: Vec<PointEmitter>,
    /// … then those at infinity.
    directionals: Vec<Directional>,
    environment: Option<Environment>,
    identity: EmittersIdentity,
}

/// Tells the emitters of one scene from those of any other: two are equal only if they are of the
/// same scene.
#[derive(Clone, Debug, Default)]
pub struct EmittersIdentity(Arc<()>);

impl PartialEq for EmittersIdentity {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Eq for EmittersIdentity {}

/// Emitters at a point.
#[derive(Clone, Debug)]
enum PointEmitter {
    Point(Point),
    Spot(Spot),
}

/// A sampled direction towards an emitter, from a given reference point.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// Index of the emitter: surfaces first, in the order of the description, then the other
    /// emitters in theirs.
    pub emitter: u32,
    /// Unit direction from the reference point.
    pub direction: Vec3,
    /// Incident radiance over density, `L_i / (P p_ω)`, where `P` is the probability with which
    /// the emitter was selected: `weight · f cosθ` estimates the sum over emitters of
    /// `∫ L_i f cosθ dω` without bias (without occlusion). For emitters that are a point or a
    /// direction: the irradiance on a plane facing them, over `P`.
    pub weight: Rgb,
    /// Density `P p_ω` of this direction by this technique; zero for emitters that no other
    /// technique can hit.
    pub pdf: Density<SolidAngle>,
    /// Whether no other technique can hit the emitter, so that the sample has MIS weight 1.
    pub is_delta: bool,
    /// The point aimed at, moved off the emitter's surface; `None` at infinity.
    target: Option<Vec3>,
}

/// End of shadow rays, as a share of the distance: short of the target by the error of the
/// intersection with the emitter itself, which is relative to the distance.
const SEGMENT_END: f32 = 1.0 - 16.0 * f32::EPSILON;

impl EmitterSample {
    /// The same, had the emitter been chosen with `probability`, where it was given before. `None`
    /// where the weight is no number then.
    #[inline(always)]
    pub fn chosen_with(self, probability: f32) -> Option<Self> {
        let sample = Self {
            weight: self.weight / probability,
            pdf: self.pdf * probability,
            ..self
        };
        sample.weight.is_finite().then_some(sample)
    }

    /// The segment that must be free for the emitter to be seen from `from`.
    #[inline(always)]
    pub fn shadow_ray(&self, from: &SurfacePoint) -> Ray {
        shadow_ray(from, self.direction, self.target)
    }

    /// The segment that must be free for the emitter to be seen from a point off all surfaces, in a
    /// medium: the reference point.
    #[inline(always)]
    pub fn shadow_ray_from(&self, position: Vec3) -> Ray {
        ray_towards(position, self.direction, self.target)
    }
}

/// The segment from a surface up to `target`, or without end.
#[inline(always)]
fn shadow_ray(from: &SurfacePoint, direction: Vec3, target: Option<Vec3>) -> Ray {
    ray_towards(from.origin_towards(direction), direction, target)
}

/// The segment from `origin` up to `target`, or without end.
#[inline(always)]
fn ray_towards(origin: Vec3, direction: Vec3, target: Option<Vec3>) -> Ray {
    match target {
        Some(target) => Ray::segment(origin, target - origin, SEGMENT_END),
        None => Ray::new(origin, direction),
    }
}

impl Emitters {
    pub(crate) fn new(areas: Vec<AreaEmitter>, others: &[EmitterDescription]) -> Result<Self, SceneError> {
        let (mut points, mut directionals, mut environment) = (Vec::new(), Vec::new(), None);
        for (index, emitter) in others.iter().enumerate() {
            let refuse = |reason| SceneError::Emitter {
                emitter: format!("emitter {index}"),
                reason,
            };
            match emitter {
                EmitterDescription::Point { position, intensity } => {
                    points.push(PointEmitter::Point(
                        Point::new(*position, *intensity).map_err(refuse)?,
                    ));
                }
                EmitterDescription::Spot {
                    position,
                    direction,
                    intensity,
                    beam_width,
                    cutoff_angle,
                } => {
                    let spot = Spot::new(*position, *direction, *intensity, *beam_width, *cutoff_angle);
                    points.push(PointEmitter::Spot(spot.map_err(refuse)?));
                }
                EmitterDescription::Directional {
                    direction,
                    irradiance,
                } => {
                    directionals.push(Directional::new(*direction, *irradiance).map_err(refuse)?);
                }
                EmitterDescription::Constant { radiance } => {
                    environment = Environment::constant(*radiance).map_err(refuse)?;
                }
                EmitterDescription::Environment(map) => {
                    environment = Environment::image(map).map_err(refuse)?;
                }
            }
        }
        Ok(Self {
            areas,
            points,
            directionals,
            environment,
            identity: EmittersIdentity::default(),
        })
    }

    /// What tells these emitters from others, as long as it is kept.
    pub fn identity(&self) -> EmittersIdentity {
        self.identity.clone()
    }

    /// Luminous flux of the finite emitters.
    fn power(&self) -> impl Iterator<Item = f64> {
        let areas = self.areas.iter().map(AreaEmitter::power);
        areas.chain(self.points.iter().map(PointEmitter::power))
    }

    /// Number of emitters.
    pub fn len(&self) -> usize {
        self.areas.len()
            + self.points.len()
            + self.directionals.len()
            + usize::from(self.environment().is_some())
    }

    /// Whether there is no emitter.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of emitting triangles and spheres.
    pub fn area_count(&self) -> usize {
        self.areas.len()
    }

    /// Number of emitters at a point.
    pub(crate) fn point_count(&self) -> usize {
        self.points.len()
    }

    /// What surrounds the scene.
    #[inline(always)]
    pub fn environment(&self) -> Option<&Environment> {
        if cfg!(lightshed_without = "environment") {
            return None;
        }
        self.environment.as_ref()
    }

    /// Towards a point or spot that was chosen with `probability`.
    #[inline(always)]
    fn sample_point(&self, from: Vec3, index: u32, probability: f32) -> Option<EmitterSample> {
        let (position, intensity) = self.points[index as usize - self.areas.len()].towards(from);
        let to_emitter = position - from;
        let distance_squared = to_emitter.length_squared();
        if intensity == Rgb::ZERO || !(distance_squared > 0.0) {
            return None;
        }
        let weight = intensity / (distance_squared * probability);
        // So near the light that its irradiance overflows.
        if !weight.is_finite() {
            return None;
        }
        Some(EmitterSample {
            emitter: index,
            direction: to_emitter / distance_squared.sqrt(),
            weight,
            pdf: Density::ZERO,
            is_delta: true,
            target: Some(position),
        })
    }

    /// Towards an emitter at infinity, by its number among those, that was chosen with
    /// `probability`.
    #[inline(always)]
    fn sample_infinite(
        &self,
        sky: SkySampling,
        index: usize,
        probability: f32,
        u: [f32; 2],
    ) -> Option<EmitterSample> {
        if let Some(light) = self.directionals.get(index) {
            return Some(EmitterSample {
                emitter: self.infinite_index(index),
                direction: light.towards,
                weight: light.irradiance / probability,
                pdf: Density::ZERO,
                is_delta: true,
                target: None,
            });
        }
        let (direction, radiance, pdf) = self.environment()?.sample_by(sky, u)?;
        let pdf = pdf * probability;
        Some(EmitterSample {
            emitter: self.infinite_index(index),
            direction,
            weight: radiance / pdf.value(),
            pdf,
            is_delta: false,
            target: None,
        })
    }

    /// Index of an emitter by its number among those at infinity.
    #[inline(always)]
    fn infinite_index(&self, number: usize) -> u32 {
        (self.areas.len() + self.points.len() + number) as u32
    }

    /// Index of the environment, if there is one: it is the last of those at infinity.
    #[inline(always)]
    fn environment_index(&self) -> u32 {
        self.infinite_index(self.directionals.len())
    }

    /// Whether the emitter of this number among those at infinity is the environment.
    #[inline(always)]
    fn is_environment(&self, number: usize) -> bool {
        number == self.directionals.len() && self.environment().is_some()
    }

    /// Radiance that leaves `point` against the ray direction `incoming` (towards `−incoming`).
    #[inline(always)]
    pub fn radiance(&self, point: &SurfacePoint, incoming: Vec3) -> Rgb {
        match self.areas.get(point.emitter as usize) {
            Some(area) if incoming.dot(point.geometric_normal) < 0.0 => area.radiance(),
            _ => Rgb::ZERO,
        }
    }
}

impl PointEmitter {
    /// Where it is, and its radiant intensity towards `from`.
    #[inline(always)]
    fn towards(&self, from: Vec3) -> (Vec3, Rgb) {
        match self {
            Self::Point(point) => (point.position, point.intensity),
            Self::Spot(spot) => (spot.position, spot.intensity_towards(from)),
        }
    }

    fn flat(&self) -> FlatDelta {
        match self {
            Self::Point(point) => FlatDelta {
                place: point.position,
                intensity: point.intensity,
                // All directions are within the beam.
                cos_beam: -2.0,
                cos_cutoff: -2.0,
                ..FlatDelta::default()
            },
            Self::Spot(spot) => spot.flat(),
        }
    }

    fn power(&self) -> f64 {
        match self {
            Self::Point(point) => point.power(),
            Self::Spot(spot) => spot.power(),
        }
    }
}

/// Why an RGB quantity is refused, or nothing.
fn check_rgb(rgb: Rgb) -> Result<(), &'static str> {
    if rgb.is_finite() && rgb.min_element() >= 0.0 {
        Ok(())
    } else {
        Err("its colour must be finite and not negative")
    }
}

/// Luminance in `f64`.
fn luminance_f64(rgb: Rgb) -> f64 {
    f64::from(luminance(rgb))
}

/// The point aimed at on a surface, moved off it towards `from`.
#[inline(always)]
fn target_on_surface(point: Vec3, normal: Vec3, magnitude: Vec3, extent: f32, from: Vec3) -> Vec3 {
    let offset = SurfacePoint::offset_for(normal, magnitude, extent);
    offset_along(point, normal, offset, from - point)
}
