//! What follows a reconnection vertex: light that no shift follows any further.

use crate::numbers::PathNumbers;
use crate::sample::Technique;
use crate::walk::{SURVIVAL_CAP, emitter_weight, scattering_weight};
use crate::world::{Endpoint, RayKind, World};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, PathSeed, SolidAngle};

/// The rest of a path from the ray that leaves its reconnection vertex on. Shifts copy the radiance that it brings, and never
/// ask how.
#[derive(Clone, Copy, Debug)]
pub struct Suffix<R, S> {
    /// The ray.
    pub ray: R,
    /// Its unit direction.
    pub direction: Vec3,
    /// The vertex that it leaves, as the choice among emitters knows it.
    pub site: S,
    /// Density of the direction over all lobes of that vertex but delta lobes, of which it is none.
    pub total_pdf: Density<SolidAngle>,
    /// Source of the random numbers.
    pub seed: PathSeed,
    /// What radiance along the ray is worth, for roulette: its colour's largest component.
    pub importance: f32,
}

/// How far suffixes go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SuffixLimits {
    /// Number of the vertices that the rays lead to.
    pub first: u32,
    /// Longest path, in edges.
    pub max_length: u32,
    /// Roulette may end a path at vertices of this number or a higher one.
    pub roulette_from: u32,
}

/// Light that arrives along a suffix's ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SuffixLight {
    /// From what the ray itself leads to.
    Met {
        /// Radiance.
        radiance: Vec3,
        /// Density with which emitter sampling at the reconnection vertex finds the direction.
        emitter_pdf: Density<SolidAngle>,
    },
    /// By way of other vertices.
    Scattered {
        /// Edges of the whole path.
        length: u32,
        /// Whether its end was found by sampling an emitter; else it was met.
        is_sampled_emitter: bool,
        /// One sample of the radiance: over the densities of everything behind the ray, weighted between the two
        /// techniques, and over the probability of having survived roulette.
        radiance: Vec3,
    },
}

impl SuffixLight {
    pub(crate) fn technique(&self) -> Technique {
        match self {
            Self::Scattered {
                is_sampled_emitter: true,
                ..
            } => Technique::Emitter,
            _ => Technique::Scattering,
        }
    }
}

/// Traces one suffix by a world's other functions: what [`World::trace_suffixes`] does where it is not overridden, and what to
/// hold one's own against.
pub fn trace_suffix<W: World + ?Sized>(
    world: &W,
    suffix: &Suffix<W::Ray, W::Site>,
    limits: SuffixLimits,
    visit: &mut impl FnMut(SuffixLight),
) {
    let mut numbers = PathNumbers::new(suffix.seed);
    let (mut ray, mut direction, mut site) = (suffix.ray, suffix.direction, suffix.site);
    let (mut total_pdf, mut is_delta) = (suffix.total_pdf, false);
    let mut throughput = Vec3::ONE;
    for index in limits.first..=limits.max_length {
        let vertex = world.trace(&ray, RayKind::Path);
        let met = match &vertex {
            Some(vertex) => world.emitted(vertex, -direction),
            None => world.environment(direction),
        };
        if met != Vec3::ZERO {
            let emitter_pdf = match &vertex {
                _ if is_delta => Density::ZERO,
                Some(vertex) => world.emitter_pdf(&site, vertex),
                None => world.environment_pdf(&site, direction),
            };
            visit(if index == limits.first {
                SuffixLight::Met {
                    radiance: met,
                    emitter_pdf,
                }
            } else {
                SuffixLight::Scattered {
                    length: index,
                    is_sampled_emitter: false,
                    radiance: throughput * met * scattering_weight(total_pdf, emitter_pdf),
                }
            });
        }
        let Some(vertex) = vertex.filter(|_| index < limits.max_length) else {
            return;
        };
        let wo = -direction;
        let (u_select, u) = numbers.emitter(index);
        if let Some(radiance) = sampled_emitter(world, &vertex, wo, u_select, u) {
            visit(SuffixLight::Scattered {
                length: index + 1,
                is_sampled_emitter: true,
                radiance: throughput * radiance,
            });
        }
        let scatter = numbers.scatter(index);
        let Some(sampled) = world.sample_lobe(&vertex, wo, scatter.lobe, scatter.direction) else {
            return;
        };
        throughput *= sampled.scattering.weight();
        if !(throughput.max_element() > 0.0 && throughput.is_finite()) {
            return;
        }
        if index >= limits.roulette_from {
            let survival = (throughput.max_element() * suffix.importance).min(SURVIVAL_CAP);
            if !(numbers.roulette(index) < survival) {
                return;
            }
            throughput /= survival;
        }
        ray = world.ray(&vertex, sampled.wi);
        (direction, site) = (sampled.wi, world.site(&vertex));
        (total_pdf, is_delta) = (sampled.total_pdf, sampled.is_delta);
    }
}

/// One sample of the light that emitters send to a vertex and that leaves it along `wo`; `None` if there is none.
fn sampled_emitter<W: World + ?Sized>(
    world: &W,
    vertex: &W::Vertex,
    wo: Vec3,
    u_select: u64,
    u: [f32; 2],
) -> Option<Vec3> {
    let endpoint = world.sample_emitter(vertex, u_select, u)?;
    let connection = world.connect(vertex, &endpoint)?;
    let scattering = world.evaluate(vertex, wo, connection.direction);
    if scattering.value == Vec3::ZERO || world.occluded(&connection.ray, RayKind::Emitter) {
        return None;
    }
    let is_delta = matches!(endpoint, Endpoint::Delta(_));
    let incident = connection.radiance / connection.pdf.value();
    Some(scattering.value * incident * emitter_weight(connection.pdf, scattering.pdf, is_delta))
}
