//! Passage along a ray: optical depths, boundaries of media, the first surface.

use super::coarse::CoarseMedium;
use super::lobe::has_lobe;
use crate::volume::volpath::{Crossing, MOST_CROSSINGS, end_of};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::DVec3;
use lightshed_scene::volume::{DensityField, Interval, unbiased_ray_marching, unbiased_ray_marching_lookups};
use lightshed_scene::{
    EmitterEndpoint, EmittersByPower, Material, Medium, MediumDensity, Ray, Scene, SkySampling, SurfacePoint,
};

/// A scene's media and their coarse copies.
pub(crate) struct Volumes<'a> {
    pub scene: &'a Scene,
    pub coarse: Vec<CoarseMedium>,
    /// Whether there is one medium and nothing else: coarse densities then are all that blocks
    /// light, and no ray needs to be traced for them. (If the boundary cuts off part of a grid,
    /// they overestimate; a target may.)
    alone: bool,
    /// Whether, in addition, nothing cuts off that medium's grid: then it is all that any ray
    /// passes.
    clear: bool,
    /// By medium, whether it scatters into a narrow lobe.
    pub has_lobe: Vec<bool>,
    /// Whether there are emitters that have an area, and rays meet them all.
    pub shows_lamps: bool,
}

/// The media and surfaces along a segment.
pub(crate) struct Through {
    /// `e^{−∫σ_t}` along it, by channel, or an estimate.
    pub transmittance: DVec3,
    /// The medium at its end.
    pub medium: Option<u32>,
    /// The surface that ends it, if one does before its own end.
    pub surface: Option<SurfacePoint>,
}

/// Where a free flight went.
pub(crate) enum Landing {
    /// Into a collision in a medium, at that distance from the start.
    Collision { distance: f64, medium: u32 },
    /// To a surface.
    Surface(Met),
    /// Out of the scene.
    Away,
}

/// A surface that a ray has met.
pub(crate) struct Met {
    pub point: SurfacePoint,
    /// The place on an emitter, where it is one.
    pub endpoint: Option<EmitterEndpoint>,
}

/// A free flight by a coarse density, with the parts of its density.
pub(crate) struct CoarseFlight {
    pub landing: Landing,
    /// Density per unit of length of a collision, probability of anything else.
    pub pdf: f64,
    /// `∫ σ*_t` on the way, by channel.
    pub depth: DVec3,
    /// The medium at its end.
    pub medium: Option<u32>,
}

/// Part of a ray in one medium.
pub(crate) struct Part {
    pub ray: Ray,
    /// In units of the length of the ray's direction.
    pub t_max: f32,
    /// From the start of the whole ray to that of this part, the same.
    pub before: f64,
    pub medium: Option<u32>,
}

/// The mean coefficient, which proposals use: positive if any is.
pub(crate) fn proposal_extinction(medium: &Medium) -> f32 {
    medium.extinction().element_sum() * (1.0 / 3.0)
}

impl<'a> Volumes<'a> {
    /// The emitters, chosen by power. Walks find the environment, too, so that it is sampled above
    /// its mean.
    #[inline]
    pub fn emitters(&self) -> EmittersByPower<'a> {
        self.scene.emitters_by_power().with_sky(SkySampling::AboveMean)
    }

    /// With coarse copies up to level `most`.
    pub fn new(scene: &'a Scene, most: u32) -> Self {
        let media = scene.media();
        let is_null = |material: &Material| matches!(material, Material::Null);
        let alone = matches!(media, [medium] if matches!(medium.density(), MediumDensity::Grid(_)))
            && scene.materials().iter().all(is_null);
        Self {
            coarse: media
                .iter()
                .map(|medium| CoarseMedium::new(medium, most))
                .collect(),
            alone,
            clear: alone && scene.medium_is_clear(0),
            has_lobe: media.iter().map(has_lobe).collect(),
            shows_lamps: shows_lamps(scene),
            scene,
        }
    }

    pub fn medium(&self, index: u32) -> (&Medium, &CoarseMedium) {
        (&self.scene.media()[index as usize], &self.coarse[index as usize])
    }

    /// The parts of a ray up to the first surface that light does not pass: `each` takes them and
    /// says whether to go on. The surface, if it was reached.
    pub fn parts(
        &self,
        ray: &Ray,
        medium: Option<u32>,
        mut each: impl FnMut(&Part) -> bool,
    ) -> (Option<Met>, Option<u32>) {
        let mut part = Part {
            ray: *ray,
            t_max: 0.0,
            before: 0.0,
            medium,
        };
        if self.clear {
            (part.t_max, part.medium) = (ray.t_max, Some(0));
            each(&part);
            return (None, part.medium);
        }
        let end = end_of(ray);
        for _ in 0..MOST_CROSSINGS {
            let hit = self.scene.nearest(&part.ray);
            part.t_max = hit.map_or(part.ray.t_max, |hit| hit.t);
            if !each(&part) {
                return (None, part.medium);
            }
            let Some(hit) = hit else {
                return (None, part.medium);
            };
            let point = self.scene.surface(&part.ray, &hit);
            if !matches!(self.scene.materials()[point.material as usize], Material::Null) {
                let endpoint =
                    (point.emitter != SurfacePoint::NO_EMITTER).then(|| EmitterEndpoint::Surface {
                        emitter: point.emitter,
                        coordinates: self.scene.coordinates(&part.ray, &hit),
                    });
                return (Some(Met { point, endpoint }), part.medium);
            }
            let crossing = Crossing::new(self.scene, &point, &part.ray, part.medium, end);
            part.before += f64::from((crossing.ray.origin - part.ray.origin).dot(ray.direction))
                / f64::from(ray.direction.length_squared());
            (part.ray, part.medium) = (crossing.ray, crossing.medium);
        }
        (None, part.medium)
    }

    /// Along the whole of `ray`, by densities of a level.
    pub fn through(&self, ray: &Ray, medium: Option<u32>, level: u32) -> Through {
        if self.alone {
            let index = medium.unwrap_or(0);
            let (medium, coarse) = self.medium(index);
            let interval = Interval {
                t0: 0.0,
                t1: ray.t_max,
            };
            let depth = optical_depth(medium, ray, coarse.depth(medium, ray, interval, level));
            return Through {
                transmittance: transmitted(depth),
                medium: Some(index),
                surface: None,
            };
        }
        let mut depth = DVec3::ZERO;
        let (surface, medium) = self.parts(ray, medium, |part| {
            if let Some(index) = part.medium {
                let (medium, coarse) = self.medium(index);
                let interval = Interval {
                    t0: 0.0,
                    t1: part.t_max,
                };
                depth += optical_depth(
                    medium,
                    &part.ray,
                    coarse.depth(medium, &part.ray, interval, level),
                );
            }
            true
        });
        Through {
            transmittance: transmitted(depth),
            medium,
            surface: surface.map(|met| met.point),
        }
    }

    /// The same with an unbiased estimate of the transmittance, by unbiased ray marching; exact
    /// where extinction differs by channel.
    pub fn estimate(&self, ray: &Ray, medium: Option<u32>, rng: &mut CounterRng) -> Through {
        let mut transmittance = DVec3::ONE;
        let (surface, medium) = self.parts(ray, medium, |part| {
            if let Some(index) = part.medium {
                transmittance *= self.estimate_part(index, part, rng);
            }
            true
        });
        Through {
            transmittance,
            medium,
            surface: surface.map(|met| met.point),
        }
    }

    fn estimate_part(&self, index: u32, part: &Part, rng: &mut CounterRng) -> DVec3 {
        let medium = &self.scene.media()[index as usize];
        let interval = Interval {
            t0: 0.0,
            t1: part.t_max,
        };
        match medium.density() {
            MediumDensity::Grid(field) if medium.is_grey() => {
                let field_ray = field.field_ray(&part.ray);
                let segments = field.majorants().segments(&field_ray, interval);
                let k = medium.extinction().x * part.ray.direction.length();
                let bound: f32 = segments
                    .clone()
                    .map(|s| (s.majorant * (s.t1 - s.t0)).max(0.0))
                    .sum();
                // The rule is for a bound near the depth; super-voxels' are some times as much.
                let lookups = unbiased_ray_marching_lookups(LOOKUP_DEPTH * k * bound);
                let mut density = field.grid().accessor();
                let estimate = unbiased_ray_marching(&mut density, &field_ray, segments, k, lookups, rng);
                DVec3::splat(f64::from(estimate.value))
            }
            _ => transmitted(optical_depth(
                medium,
                &part.ray,
                CoarseMedium::exact_depth(medium, &part.ray, interval),
            )),
        }
    }

    /// A free flight along `ray`, whose direction is of unit length, with densities of a level of
    /// at least 1; `u` is asked for uniform numbers.
    pub fn fly(
        &self,
        ray: &Ray,
        medium: Option<u32>,
        levels: [u32; 2],
        mut u: impl FnMut() -> f64,
    ) -> CoarseFlight {
        let (mut depth, mut pdf, mut collision) = (DVec3::ZERO, 1.0, None);
        let mut fly = |part: &Part| {
            let Some(index) = part.medium else { return true };
            let (medium, coarse) = self.medium(index);
            let interval = Interval {
                t0: 0.0,
                t1: part.t_max,
            };
            let k = f64::from(proposal_extinction(medium));
            // In optical depth of the proposal's coefficient.
            let target = -(-u()).ln_1p();
            let (mut inside, mut found) = (0.0, None);
            coarse.stretches(medium, &part.ray, interval, levels, |stretch| {
                let density = f64::from(stretch.density);
                let whole = density * (stretch.t1 - stretch.t0);
                if target < k * (inside + whole) {
                    let t = (stretch.t0 + (target / k - inside) / density).min(stretch.t1);
                    inside = target / k;
                    pdf *= k * density;
                    found = Some(t);
                } else {
                    inside += whole;
                }
                found.is_none()
            });
            depth += optical_depth(medium, &part.ray, inside);
            pdf *= (-k * inside).exp();
            collision = found.map(|t| (part.before + t, index));
            collision.is_none()
        };
        let (surface, medium) = if self.alone && medium.is_some() {
            fly(&Part {
                ray: *ray,
                t_max: ray.t_max,
                before: 0.0,
                medium,
            });
            (None, medium)
        } else {
            self.parts(ray, medium, fly)
        };
        let landing = match (collision, surface) {
            (Some((distance, medium)), _) => Landing::Collision { distance, medium },
            (None, Some(met)) => Landing::Surface(met),
            (None, None) => Landing::Away,
        };
        CoarseFlight {
            landing,
            pdf,
            depth,
            medium,
        }
    }
}

/// Whether there are emitters that have an area, none of a shape that all light passes.
fn shows_lamps(scene: &Scene) -> bool {
    let lamps = scene.emitters().area_count() as u32;
    let is_passed = |primitive| {
        let material = scene.primitive_material(primitive) as usize;
        matches!(scene.materials()[material], Material::Null)
    };
    lamps > 0 && !(0..lamps).any(|lamp| scene.emitter_primitive(lamp).is_some_and(is_passed))
}

/// Part of the majorants' depth that sets the number of lookups.
const LOOKUP_DEPTH: f32 = 0.6;

/// `e^{−τ}` of each channel.
#[inline]
pub(crate) fn transmitted(depth: DVec3) -> DVec3 {
    // One exponential where there is one depth.
    if depth == DVec3::splat(depth.x) {
        DVec3::splat((-depth.x).exp())
    } else {
        (-depth).exp()
    }
}

/// `k ∫ ρ ds`, from `∫ ρ dt`.
pub(crate) fn optical_depth(medium: &Medium, ray: &Ray, depth: f64) -> DVec3 {
    // Without extinction nothing is in the way, however far.
    let channel = |k: f32| {
        if k > 0.0 {
            f64::from(k * ray.direction.length()) * depth
        } else {
            0.0
        }
    };
    let k = medium.extinction();
    DVec3::new(channel(k.x), channel(k.y), channel(k.z))
}
