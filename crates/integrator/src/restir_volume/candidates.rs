//! Candidates: random walks through coarse densities, of which each vertex ends a path at an emitter, and where media emit another.

use super::evaluation::{Evaluation, target_of};
use super::path::{MAX_SCATTERINGS, PathCoordinates, Step, VolumePath};
use super::pixel::{First, VolumePixel, VolumeReservoir};
use super::through::{Landing, transmitted};
use super::vertex::{Vertex, emission, surface_vertex};
use crate::ray_tally::RayKind;
use lightshed_resampling::{ContributionWeight, MixtureRis};
use lightshed_sampling::{CounterRng, f32_from_u32, f64_from_u64};
use lightshed_scene::EmitterEndpoint;
use lightshed_scene::glam::{DVec3, Vec2, Vec3};
use lightshed_scene::volume::PhaseFunction;

/// Scattering vertices from which on roulette may end a walk (Lin 2022 §5.6.1).
const ROULETTE_VERTICES: u32 = 3;

/// A walk on its way.
struct Walk<'a> {
    path: VolumePath,
    /// `F` so far, with the proposals' transmittances.
    value: DVec3,
    /// Density of the walk so far, in the measure of coordinates.
    pdf: f64,
    vertex: Vertex<'a>,
}

/// How a walk goes on.
enum Onward {
    /// At another vertex.
    Arrived,
    /// From its vertex into the environment, in a direction of that density; in a medium, or by a lobe without width, of that probability.
    Away {
        direction: Vec3,
        pdf: f64,
    },
    Ended,
}

/// Points of the unit cube that fill it evenly, each of them uniform by a random shift: the additive recurrence of the powers of `1/g`,
/// `g⁴ = g + 1` (Roberts 2018).
#[derive(Clone, Copy)]
pub(crate) struct Sequence {
    /// In 2⁻⁶⁴.
    place: [u64; 3],
}

impl Sequence {
    /// From point number `index` on, of those shifted by `shift`.
    pub fn new(shift: [u64; 3], index: u64) -> Self {
        Self {
            place: core::array::from_fn(|axis| {
                shift[axis].wrapping_add(Self::STEP[axis].wrapping_mul(index))
            }),
        }
    }

    /// `2⁶⁴ g⁻¹`, `2⁶⁴ g⁻²`, `2⁶⁴ g⁻³`.
    const STEP: [u64; 3] = [
        0xd1b5_4a32_d192_ed03,
        0xabc9_8388_fb8f_ac03,
        0x8cb9_2ba7_2f3d_8dd7,
    ];

    /// The next point.
    pub fn next(&mut self) -> [u64; 3] {
        let point = self.place;
        for (place, step) in self.place.iter_mut().zip(Self::STEP) {
            *place = place.wrapping_add(step);
        }
        point
    }
}

impl Evaluation<'_> {
    /// One path of the pixel out of `walks` random walks of at most `scatterings` scattering vertices, by RIS with this evaluation's target
    /// (Lin 2022 eqs. 5.17, 5.18, A.1). After their first vertex walks go through densities of this evaluation's level, and of cubes of
    /// `cubes`.
    ///
    /// The path has the walk's own target, of the proposals' transmittances.
    ///
    /// `start` has the numbers of first distances and first emitter samples, each set uniform, all together more even than chance.
    ///
    /// The paths of a walk differ in length or kind, but for those into the environment, which end by an emitter sample or by flying away: these
    /// two techniques share by the balance heuristic of their densities of directions, all others have no rival; and all walks share alike.
    pub fn resample_walks(
        &self,
        pixel: &VolumePixel,
        walks: u32,
        scatterings: u32,
        cubes: u32,
        mut start: Sequence,
        rng: &mut CounterRng,
    ) -> VolumeReservoir {
        if pixel.is_empty() {
            return VolumeReservoir::empty(1.0);
        }
        let mut ris = MixtureRis::new();
        let share = 1.0 / f64::from(walks);
        for _ in 0..walks {
            let [u_first, u_light @ ..] = start.next();
            let Some(mut walk) = self.begin(pixel, f64_from_u64(u_first)) else {
                continue;
            };
            let mut scattered = 0;
            loop {
                let mut offer =
                    |path: VolumePath, value: DVec3, pdf: f64, part: f64, rng: &mut CounterRng| {
                        let target = target_of(value);
                        let path = path.held(path.connection, target);
                        if target > 0.0
                            && let Ok(weight) = ContributionWeight::<PathCoordinates, f64>::new(pdf.recip())
                        {
                            ris.candidate(path, f64::from(target), share * part, weight, rng);
                        }
                    };
                let emitters = self.volumes.scene.emitters();
                match &walk.vertex {
                    Vertex::Medium { medium, position, .. } if medium.emission().is_some() => {
                        let value = walk.value * emission(medium, *position);
                        offer(walk.path, value, walk.pdf, 1.0, rng);
                    }
                    // What a mirror shows no emitter sample finds.
                    Vertex::Surface { .. } if walk.path.lobe_to(walk.path.vertices() - 1).is_some() => {
                        let value = walk.value * walk.vertex.emitted(emitters);
                        offer(walk.path, value, walk.pdf, 1.0, rng);
                    }
                    _ => (),
                }
                if scattered == scatterings.min(MAX_SCATTERINGS) {
                    break;
                }
                let u = if scattered == 0 {
                    u_light.map(|u| f32_from_u32((u >> 32) as u32))
                } else {
                    rng.next_2d()
                };
                let endpoint = emitters.sample_endpoint(walk.vertex.position(), rng.next_u64(), u);
                if let Some(endpoint) = endpoint
                    && let Some(lit) = self.lit(&walk.vertex, &endpoint)
                {
                    let path = walk.path.with_endpoint(endpoint, lit.radiance);
                    let part = self.share_of_endpoint(&walk.vertex, &endpoint, lit.pdf);
                    offer(path, walk.value * lit.value, walk.pdf * lit.pdf, part, rng);
                }
                scattered += 1;
                match self.walk_on(&mut walk, scattered, scatterings, cubes, rng) {
                    Onward::Arrived => (),
                    Onward::Away { direction, pdf } => {
                        let endpoint = EmitterEndpoint::Environment { direction };
                        if let Some(sky) = emitters.connect(walk.vertex.position(), &endpoint) {
                            let path = walk.path.with_endpoint(endpoint, sky.radiance);
                            let part = match walk.path.lobe_to(walk.path.vertices()) {
                                None => pdf / (pdf + f64::from(sky.pdf_endpoint)),
                                Some(_) => 1.0,
                            };
                            offer(path, walk.value * sky.radiance.as_dvec3(), walk.pdf, part, rng);
                        }
                        break;
                    }
                    Onward::Ended => break,
                }
            }
        }
        ris.finish(1.0)
    }

    /// Share of an emitter sample under balance MIS with the phase function, which finds the environment too: `p_e/(p_e + p_ω)`.
    fn share_of_endpoint(&self, vertex: &Vertex<'_>, endpoint: &EmitterEndpoint, pdf: f64) -> f64 {
        match (vertex, endpoint) {
            (Vertex::Medium { .. }, EmitterEndpoint::Environment { direction }) => {
                pdf / (pdf + vertex.phase(*direction))
            }
            _ => 1.0,
        }
    }

    /// The first vertex of a walk.
    fn begin(&self, pixel: &VolumePixel, u: f64) -> Option<Walk<'_>> {
        let mut path = VolumePath::seen(pixel.film, pixel.lens);
        let (vertex, depth, pdf) = match pixel.fly(u) {
            First::Medium { distance, pdf } => {
                path.push(
                    Step {
                        distance,
                        ..Step::default()
                    },
                    false,
                );
                let (index, depth) = pixel.depth_at(distance)?;
                let vertex = Vertex::Medium {
                    medium: &self.volumes.scene.media()[index as usize],
                    index,
                    position: pixel.ray.origin + pixel.ray.direction * distance,
                    incoming: pixel.ray.direction,
                };
                (vertex, depth, pdf)
            }
            First::Surface { pdf } => {
                path.push(Step::default(), true);
                (pixel.surface_vertex()?, pixel.depth_of_surface(), pdf)
            }
            First::Nowhere => return None,
        };
        Some(Walk {
            path,
            value: transmitted(depth),
            pdf,
            vertex,
        })
    }

    /// Scatters and flies on.
    fn walk_on<'s>(
        &'s self,
        walk: &mut Walk<'s>,
        scattered: u32,
        scatterings: u32,
        cubes: u32,
        rng: &mut CounterRng,
    ) -> Onward {
        let volumes = self.volumes;
        let scene = volumes.scene;
        // Behind the last vertex that scatters are only what emits and the environment.
        let emits_behind = scene.media().iter().any(|medium| medium.emission().is_some());
        let has_environment = scene.emitters().environment().is_some();
        let is_last = scattered == scatterings && !emits_behind;
        if is_last
            && !(has_environment && matches!(walk.vertex, Vertex::Medium { .. }))
            && walk.vertex.is_wide()
        {
            return Onward::Ended;
        }
        let (u_lobe, u) = (rng.next_f32(), rng.next_2d());
        let (mut lobe, mut eta) = (None, 1.0);
        let (direction, pdf, towards) = match &walk.vertex {
            Vertex::Medium { medium, incoming, .. } => {
                let sample = medium.phase().sample(*incoming, u);
                let pdf = f64::from(sample.pdf_solid_angle);
                (sample.direction, pdf, walk.vertex.scattered(sample.direction))
            }
            Vertex::Surface { point, bsdf, wo, .. } => match bsdf.sample(*wo, u_lobe, Vec2::from(u)) {
                Some(sample) if sample.is_delta => {
                    let Some(reflected) = walk.vertex.reflected(sample.lobe) else {
                        return Onward::Ended;
                    };
                    (lobe, eta) = (Some(sample.lobe), reflected.eta);
                    (reflected.direction, reflected.probability, reflected.share)
                }
                Some(sample) if !is_last => {
                    let direction = point.shading.to_world(sample.wi);
                    let pdf = f64::from(sample.pdf.value());
                    (direction, pdf, walk.vertex.scattered(direction))
                }
                _ => return Onward::Ended,
            },
        };
        if !(pdf > 0.0 && towards.max_element() > 0.0) {
            return Onward::Ended;
        }
        if let Some(lobe) = lobe {
            walk.path.scatter_by(lobe);
        }
        let looks_out = has_environment && (lobe.is_some() || matches!(walk.vertex, Vertex::Medium { .. }));
        // The albedo that was met, as far as it is one.
        let throughput = (towards * (eta * eta) / pdf).max_element();
        walk.value *= towards;
        walk.pdf *= pdf;
        if scattered >= ROULETTE_VERTICES {
            let survival = match &walk.vertex {
                Vertex::Medium { medium, .. } => f64::from(medium.albedo().max_element()),
                Vertex::Surface { .. } => throughput.min(0.95),
            };
            if !(f64_from_u64(rng.next_u64()) < survival) {
                return Onward::Ended;
            }
            walk.pdf *= survival;
        }
        let (ray, medium) = walk.vertex.leave(volumes, direction);
        self.tally.add(RayKind::Path, 1);
        let flight = volumes.fly(&ray, medium, [self.level, cubes], || f64_from_u64(rng.next_u64()));
        let mut connection = None;
        let (step, is_surface) = match flight.landing {
            Landing::Collision { distance, medium } => {
                let distance = distance as f32;
                let (before, position) = (walk.vertex.position(), ray.origin + ray.direction * distance);
                walk.vertex = Vertex::Medium {
                    medium: &volumes.scene.media()[medium as usize],
                    index: medium,
                    position,
                    incoming: direction,
                };
                let length = position.distance(before);
                // Where the direction is not free, no place can be kept.
                if lobe.is_none()
                    && walk.path.connected_vertex().is_none()
                    && length >= self.reach.of(&walk.path)
                {
                    connection = Some((position, length));
                }
                (Step { direction, distance }, false)
            }
            Landing::Surface(point) => {
                walk.vertex = surface_vertex(volumes, point, &ray, flight.medium);
                (
                    Step {
                        direction,
                        distance: 0.0,
                    },
                    true,
                )
            }
            Landing::Away if looks_out => {
                walk.value *= transmitted(flight.depth);
                walk.pdf *= flight.pdf;
                return Onward::Away { direction, pdf };
            }
            Landing::Away => return Onward::Ended,
        };
        walk.path.push(step, is_surface);
        if let Some((place, length)) = connection {
            walk.path.connect(place, length);
        }
        walk.value *= transmitted(flight.depth);
        walk.pdf *= flight.pdf;
        Onward::Arrived
    }
}
