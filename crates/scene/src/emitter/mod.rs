//! Emitters: choosing one, sampling a direction towards it, and the density of having done so.

mod area;
mod emission;
mod endpoint;
mod environment;
mod infinite;
mod lanes;
mod point;
mod selection;

#[cfg(test)]
mod tests;

pub(crate) use area::{AreaEmitter, AreaShape};
pub use emission::EmittedRay;
pub(crate) use emission::Surroundings;
pub use endpoint::{EmitterConnection, EmitterEndpoint};
pub use environment::Environment;
pub use lanes::EmitterLanes;
pub use selection::{EmitterExtent, EmitterOrientation};

use crate::surface::offset_along;
use crate::{EmitterDescription, FlatDelta, FlatEmitter, Ray, Rgb, SceneError, SurfacePoint, luminance};
use area::AreaRecord;
use glam::Vec3;
use infinite::Directional;
use lightshed_sampling::{AliasEntry, AliasTable, Density, SolidAngle};
use point::{Point, Spot};

/// All emitters of a scene.
///
/// An emitter is chosen in two steps: uniformly among the emitters at infinity and, as one more choice, all finite
/// ones together (the power of an emitter at infinity, which depends on the size of the scene, cannot be set against that
/// of a lamp); then among the finite ones in proportion to their power (luminous flux). So every emitter that emits has a
/// positive probability `p_sel`, the same at every point.
pub struct Emitters {
    /// Emitters `0 ..` by index: surfaces, …
    areas: Vec<AreaRecord>,
    /// … then points and spots, …
    points: Vec<PointEmitter>,
    /// … then those at infinity.
    directionals: Vec<Directional>,
    environment: Option<Environment>,
    /// Over `areas` and `points`; `None` where there are none.
    finite: Option<AliasTable>,
    /// Emitters at infinity, and one more if there are finite ones.
    groups: u32,
    /// One over `groups`.
    group_probability: f32,
}

/// Emitters at a point.
#[derive(Clone, Debug)]
enum PointEmitter {
    Point(Point),
    Spot(Spot),
}

/// A chosen emitter.
enum Selected {
    /// By index, with its probability among the finite ones.
    Finite { index: u32, pmf: f32 },
    /// By its number among those at infinity, the environment last.
    Infinite(usize),
}

/// A sampled direction towards an emitter, from a given reference point.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// Index of the emitter: surfaces first, in the order of the description, then the other emitters in theirs.
    pub emitter: u32,
    /// Unit direction from the reference point.
    pub direction: Vec3,
    /// Incident radiance over density, `L_i / p_ω`, selection included: the sum over emitters of `∫ L_i f cosθ dω` is
    /// estimated by `weight · f cosθ` without bias (but for occlusion). For emitters that are a point or a direction: the
    /// irradiance on a plane facing them, over the selection probability.
    pub weight: Rgb,
    /// Density `p_sel · p_ω` of this direction by this technique; zero for emitters that no other technique can hit.
    pub pdf: Density<SolidAngle>,
    /// Whether no other technique can hit the emitter, so that the sample has MIS weight 1.
    pub is_delta: bool,
    /// The point aimed at, moved off the emitter's surface; `None` at infinity.
    target: Option<Vec3>,
}

/// Where shadow rays end, as a share of the way: short of the target by the error of the intersection with the emitter
/// itself, which is relative to the distance.
const SEGMENT_END: f32 = 1.0 - 16.0 * f32::EPSILON;

impl EmitterSample {
    /// The segment that must be free for the emitter to be seen from `from`.
    #[inline(always)]
    pub fn shadow_ray(&self, from: &SurfacePoint) -> Ray {
        shadow_ray(from, self.direction, self.target)
    }

    /// The segment that must be free for the emitter to be seen from a point off all surfaces, in a medium: the reference point.
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
    pub(crate) fn new(areas: &[AreaEmitter], others: &[EmitterDescription]) -> Result<Self, SceneError> {
        let mut areas: Vec<AreaRecord> = areas.iter().map(AreaRecord::new).collect();
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
        let power = areas
            .iter()
            .map(AreaRecord::power)
            .chain(points.iter().map(PointEmitter::power));
        let power: Vec<f64> = power.collect();
        let finite = power
            .iter()
            .any(|&p| p > 0.0)
            .then(|| AliasTable::new(&power))
            .transpose()
            .map_err(|_| SceneError::Emitter {
                emitter: "all emitters".to_owned(),
                reason: "their power overflows",
            })?;
        let infinite = directionals.len() + usize::from(environment.is_some());
        let groups = infinite as u32 + u32::from(finite.is_some());
        let group_probability = if groups > 0 { 1.0 / groups as f32 } else { 0.0 };
        if let Some(table) = &finite {
            for (index, area) in areas.iter_mut().enumerate() {
                area.set_selection_probability(table.pmf(index as u32) * group_probability);
            }
        }
        Ok(Self {
            areas,
            points,
            directionals,
            environment,
            finite,
            groups,
            group_probability,
        })
    }

    /// Number of emitters.
    pub fn len(&self) -> usize {
        self.areas.len()
            + self.points.len()
            + self.directionals.len()
            + usize::from(self.environment().is_some())
    }

    /// Whether nothing emits.
    pub fn is_empty(&self) -> bool {
        self.groups == 0
    }

    /// Number of emitting triangles and spheres.
    pub fn area_count(&self) -> usize {
        self.areas.len()
    }

    /// An emitting triangle as a shader reads it; `None` if the emitter of this index is none.
    pub(crate) fn flat_triangle(&self, index: u32) -> Option<FlatEmitter> {
        match self.areas.get(index as usize)? {
            AreaRecord::Triangle(triangle) => Some(triangle.flat()),
            AreaRecord::Sphere(_) => None,
        }
    }

    /// Emitters at a point, then those of a single direction, as shaders read them.
    pub(crate) fn flat_deltas(&self) -> Vec<FlatDelta> {
        let first = self.areas.len() as u32;
        let points = (first..).zip(&self.points).map(|(index, point)| FlatDelta {
            probability: self.selection_probability(index),
            ..point.flat()
        });
        let directions = self.directionals.iter().map(|light| FlatDelta {
            place: light.towards,
            probability: self.group_probability,
            intensity: light.irradiance,
            ..FlatDelta::default()
        });
        points.chain(directions).collect()
    }

    /// How many of [`Emitters::flat_deltas`] are emitters at a point.
    pub(crate) fn point_count(&self) -> usize {
        self.points.len()
    }

    /// The table by which one of the finite emitters is chosen; empty if there are none.
    pub(crate) fn finite_table(&self) -> &[AliasEntry] {
        self.finite.as_ref().map_or(&[], AliasTable::entries)
    }

    /// Emitters at infinity, and one more if there are finite ones.
    pub(crate) fn group_count(&self) -> u32 {
        self.groups
    }

    /// What surrounds the scene.
    #[inline(always)]
    pub fn environment(&self) -> Option<&Environment> {
        if cfg!(lightshed_without = "environment") {
            return None;
        }
        self.environment.as_ref()
    }

    /// Chooses an emitter by `u_select` and a direction towards it by `u`. `None` where nothing emits, or where the
    /// chosen emitter sends nothing to `from`: that outcome counts as a sample of value zero.
    #[inline]
    pub fn sample(&self, from: Vec3, u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        match self.select(u_select) {
            Selected::Finite { index, pmf } => self.sample_finite(from, index, pmf, u),
            Selected::Infinite(index) => self.sample_infinite(index, u),
        }
    }

    /// Chooses an emitter; one at infinity if nothing emits.
    #[inline(always)]
    fn select(&self, u_select: u64) -> Selected {
        // The high part of the product is the group, the low part a fresh uniform number within it.
        let routed = u128::from(u_select) * u128::from(self.groups);
        let group = (routed >> 64) as usize;
        match &self.finite {
            Some(table) if group == 0 => {
                let (index, pmf) = table.sample(routed as u64);
                Selected::Finite { index, pmf }
            }
            Some(_) => Selected::Infinite(group - 1),
            None => Selected::Infinite(group),
        }
    }

    #[inline(always)]
    fn sample_finite(&self, from: Vec3, index: u32, pmf: f32, u: [f32; 2]) -> Option<EmitterSample> {
        if let Some(area) = self.areas.get(index as usize) {
            return area.sample(from, index, u);
        }
        let probability = pmf * self.group_probability;
        let (position, intensity) = self.points[index as usize - self.areas.len()].towards(from);
        let to_emitter = position - from;
        let distance_squared = to_emitter.length_squared();
        if intensity == Rgb::ZERO || !(distance_squared > 0.0) {
            return None;
        }
        let weight = intensity / (distance_squared * probability);
        // So near the light that its irradiance is no number any more.
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

    #[inline(always)]
    fn sample_infinite(&self, index: usize, u: [f32; 2]) -> Option<EmitterSample> {
        let emitter = (self.areas.len() + self.points.len() + index) as u32;
        if let Some(light) = self.directionals.get(index) {
            return Some(EmitterSample {
                emitter,
                direction: light.towards,
                weight: light.irradiance / self.group_probability,
                pdf: Density::ZERO,
                is_delta: true,
                target: None,
            });
        }
        let (direction, radiance, pdf) = self.environment()?.sample(u)?;
        let pdf = pdf * self.group_probability;
        Some(EmitterSample {
            emitter,
            direction,
            weight: radiance / pdf.value(),
            pdf,
            is_delta: false,
            target: None,
        })
    }

    /// Radiance that leaves `point` against the ray direction `incoming` (towards `−incoming`).
    #[inline(always)]
    pub fn radiance(&self, point: &SurfacePoint, incoming: Vec3) -> Rgb {
        match self.areas.get(point.emitter as usize) {
            Some(area) if incoming.dot(point.geometric_normal) < 0.0 => area.radiance(),
            _ => Rgb::ZERO,
        }
    }

    /// Density with which [`Emitters::sample`] at `from` would have chosen the direction to `point`, which lies on an
    /// area emitter; zero if it does not.
    #[inline(always)]
    pub fn pdf(&self, from: Vec3, point: &SurfacePoint) -> Density<SolidAngle> {
        match self.areas.get(point.emitter as usize) {
            Some(area) => area.pdf(from, point),
            None => Density::ZERO,
        }
    }

    /// Density with which [`Emitters::sample`] would have chosen `direction` towards the environment.
    #[inline(always)]
    pub fn pdf_environment(&self, direction: Vec3) -> Density<SolidAngle> {
        match self.environment() {
            Some(environment) => environment.pdf(direction) * self.group_probability,
            None => Density::ZERO,
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
