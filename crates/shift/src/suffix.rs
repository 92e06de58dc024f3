//! Tracing of suffixes behind reconnection vertices, one by one.

use crate::mis::{emitter_weight, scattering_weight};
use crate::numbers::PathNumbers;
use crate::roulette::survival;
use crate::world::{End, Endpoint, RayKind, Suffix, SuffixLight, SuffixLimits, World};
use lightshed_sampling::Density;
use lightshed_sampling::glam::Vec3;

/// Traces one suffix with a world's other functions. [`TreeTracer`](crate::TreeTracer) uses it if
/// [`WorldLighting::trace_suffixes`](crate::WorldLighting::trace_suffixes) is not overridden; it is
/// the reference for your own version.
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
        let end = End::of(vertex.as_ref());
        let met = end.radiance(world, direction);
        if met != Vec3::ZERO {
            let emitter_pdf = if is_delta {
                Density::ZERO
            } else {
                end.emitter_pdf(world, &site, direction, met)
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
            let survival = survival(throughput.max_element() * suffix.importance);
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

/// One sample of the light that emitters send to a vertex and that leaves it along `wo`; `None` if
/// there is none.
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
