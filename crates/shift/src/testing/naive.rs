//! What shifts and sums are held to: definitions, written out.

use crate::connectability::Connectability;
use crate::domain::{PathDomain, Start};
use crate::numbers::PathNumbers;
use crate::sample::{ALL_LOBES, AnchorKind, PathSample, Technique};
use crate::world::{Endpoint, RayKind, Scattering, World};
use lightshed_sampling::glam::{DVec3, Vec3};
use lightshed_sampling::{CounterRng, Density, SolidAngle};

/// A path of a domain by the definitions of [`PathDomain`] and [`PathShift`](crate::PathShift).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Definition {
    /// `F`, visibility included.
    pub contribution: DVec3,
    /// What a shift divides by: the density of the copied vertex, and that of the direction behind
    /// it.
    pub density: f64,
}

/// What a faulty shift gets wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The density of the vertex behind the reconnection is left out.
    NoDensityBehind,
    /// MIS weights have the density of one lobe, not that of all.
    LobeForTotal,
    /// MIS weights keep the emitter's density of another point: here of none.
    NoEmitterDensity,
    /// Pairs of the offset path are connectable whatever their lobes.
    AnyRoughness,
    /// Pairs of the offset path before the reconnection are not asked.
    NoEarlierPair,
    /// Any distance will do.
    AnyDistance,
    /// Any spread will do.
    AnySpread,
    /// The base path's pixel decides which pairs of the offset path are connectable.
    ThresholdsOfBase,
}

/// A vertex, and the lobe that scatters there: its number and width.
struct Node<V> {
    vertex: V,
    /// To the vertex before.
    wo: Vec3,
    lobe: u8,
    roughness: f32,
}

/// Where the last edge of a path leads, and what comes from there.
struct Light<R> {
    direction: Vec3,
    radiance: DVec3,
    /// Of emitter sampling; `None` for an emitter that scattering never meets.
    pdf: Option<f64>,
    /// Of emitter sampling, in the endpoint's own measure.
    own_density: f64,
    ray: R,
}

/// The path in `domain` that has the coordinates of `x`, or `None` if there is none.
pub(crate) fn define<W: World>(
    x: &PathSample,
    domain: &PathDomain<'_, W>,
    fault: Option<Fault>,
) -> Option<Definition> {
    let (world, shape) = (domain.world, x.shape());
    let anchored = shape.anchor != AnchorKind::None;
    // Vertices that the domain's path has for itself.
    let own = if anchored {
        shape.reconnection
    } else {
        shape.length
    } - 1;
    if shape.length > domain.max_length || (own > 1 || !anchored) && !domain.connectability.replays() {
        return None;
    }
    let mut numbers = PathNumbers::new(x.seed);
    let (mut vertex, mut wo) = match &domain.start {
        Start::Vertex { first, wo } => (first.clone(), *wo),
        Start::Sensor(sensor) => {
            let (ray, direction) = world.sensor_ray(sensor, numbers.sensor())?;
            (world.trace(&ray, RayKind::Sensor)?, -direction)
        }
    };
    // Replay: by the base path's numbers.
    let mut nodes = Vec::new();
    let mut throughput = DVec3::ONE;
    for index in 1..own {
        let scatter = numbers.scatter(index);
        let sampled = world.sample_lobe(&vertex, wo, scatter.lobe, scatter.direction)?;
        throughput *= ratio(sampled.scattering);
        let next = world.trace(&world.ray(&vertex, sampled.wi), RayKind::Replay)?;
        nodes.push(Node {
            roughness: world.lobe_roughness(&vertex, sampled.lobe),
            lobe: sampled.lobe,
            vertex,
            wo,
        });
        (vertex, wo) = (next, -sampled.wi);
    }
    let wide = |vertex: &W::Vertex| {
        let widths = (0..world.lobe_count(vertex)).map(|lobe| world.lobe_roughness(vertex, lobe));
        widths.fold(0.0, f32::max)
    };
    let width = |vertex: &W::Vertex, lobe: u8| match lobe {
        ALL_LOBES => wide(vertex),
        lobe => world.lobe_roughness(vertex, lobe),
    };
    let position = |node: &Node<W::Vertex>| world.position(&node.vertex);
    // The last own vertex, by the lobe that leads on from there.
    let last = |lobe: u8| Node {
        vertex: vertex.clone(),
        wo,
        lobe,
        roughness: width(&vertex, lobe),
    };
    // Where a path without a last vertex ends.
    let mut open = Vec3::ZERO;
    let power = |this: f64, other: f64| this * this / (this * this + other * other);
    let emitter_pdf = |pdf: f64| {
        if fault == Some(Fault::NoEmitterDensity) {
            0.0
        } else {
            pdf
        }
    };
    let result = match (shape.anchor, shape.technique) {
        (AnchorKind::Vertex, technique) => {
            let kept = world.vertex(&x.place());
            nodes.push(last(shape.lobe_before));
            let (before, here) = (world.position(&vertex), world.position(&kept));
            let d = here - before;
            let direction = d.normalize();
            nodes.push(Node {
                roughness: width(&kept, shape.lobe_at),
                lobe: shape.lobe_at,
                wo: -direction,
                vertex: kept.clone(),
            });
            let towards = world.evaluate_lobe(&vertex, wo, direction, shape.lobe_before);
            let cos_theta = f64::from(world.geometric_normal(&kept).dot(direction).abs());
            let area = f64::from(towards.pdf.value()) * cos_theta / d.as_dvec3().length_squared();
            throughput *= ratio(towards);
            let (incident, arriving) = (x.incident(), Vec3::from_array(x.radiance).as_dvec3());
            let all = world.evaluate(&kept, -direction, incident);
            let one = world.evaluate_lobe(&kept, -direction, incident, shape.lobe_at);
            let density_of = |scattering: Scattering| f64::from(scattering.pdf.value());
            let stored = emitter_pdf(f64::from(x.emitter_pdf));
            let (scattered, behind, omega) = if technique == Technique::Emitter && shape.lobe_at == ALL_LOBES
            {
                // The emitter was sampled from the kept vertex.
                let rival = match fault {
                    Some(Fault::LobeForTotal) => {
                        density_of(world.evaluate_lobe(&kept, -direction, incident, 0))
                    }
                    _ => density_of(all),
                };
                let omega = if x.emitter_pdf > 0.0 {
                    power(stored, rival)
                } else {
                    1.0
                };
                (all.value.as_dvec3(), 1.0, omega)
            } else if shape.length == shape.reconnection + 1 {
                // The kept vertex' lobe met it.
                let total = if fault == Some(Fault::LobeForTotal) {
                    one
                } else {
                    all
                };
                let met = world.trace(&world.ray(&kept, incident), RayKind::Path);
                let radiance = radiance(world, met.as_ref(), incident);
                assert_close(radiance, arriving);
                let pdf = emitter_pdf(met_pdf(world, &kept, met.as_ref(), incident));
                (ratio(one), density_of(one), power(density_of(total), pdf))
            } else {
                (ratio(one), density_of(one), 1.0)
            };
            let density_behind = if fault == Some(Fault::NoDensityBehind) {
                1.0
            } else {
                behind
            };
            let free = !world.occluded(&world.segment(&vertex, &kept), RayKind::Reconnection);
            let contribution = throughput * scattered * arriving * omega;
            (contribution, area, density_behind, free)
        }
        (anchor, Technique::Emitter) => {
            let endpoint = if anchored {
                x.endpoint()
            } else {
                let (u_select, u) = numbers.emitter(own);
                world.sample_emitter(&vertex, u_select, u)?
            };
            nodes.push(last(ALL_LOBES));
            push_end(world, &mut nodes, &endpoint);
            let light = light_of(world, &vertex, &endpoint)?;
            open = light.direction;
            let all = world.evaluate(&vertex, wo, light.direction);
            let rival = match fault {
                Some(Fault::LobeForTotal) => world.evaluate_lobe(&vertex, wo, light.direction, 0),
                _ => all,
            };
            let (estimate, omega) = match light.pdf {
                Some(pdf) => {
                    let rival = f64::from(rival.pdf.value());
                    (light.radiance / pdf, power(emitter_pdf(pdf), rival))
                }
                None => (light.radiance / light.own_density, 1.0),
            };
            let free = !world.occluded(&light.ray, RayKind::Emitter);
            let density = if anchor == AnchorKind::None {
                1.0
            } else {
                light.own_density
            };
            (
                throughput * all.value.as_dvec3() * estimate * omega,
                density,
                1.0,
                free,
            )
        }
        (AnchorKind::None, Technique::Scattering) => {
            let scatter = numbers.scatter(own);
            let sampled = world.sample_lobe(&vertex, wo, scatter.lobe, scatter.direction)?;
            let met = world.trace(&world.ray(&vertex, sampled.wi), RayKind::Replay);
            nodes.push(last(sampled.lobe));
            open = sampled.wi;
            let endpoint = match &met {
                Some(met) => Endpoint::Surface(world.place(met)),
                None => Endpoint::Direction(sampled.wi),
            };
            push_end(world, &mut nodes, &endpoint);
            let total = match fault {
                Some(Fault::LobeForTotal) => sampled.scattering.pdf,
                _ => sampled.total_pdf,
            };
            let pdf = emitter_pdf(met_pdf(world, &vertex, met.as_ref(), sampled.wi));
            let omega = if sampled.is_delta {
                1.0
            } else {
                power(f64::from(total.value()), pdf)
            };
            let radiance = radiance(world, met.as_ref(), sampled.wi);
            (
                throughput * ratio(sampled.scattering) * radiance * omega,
                1.0,
                1.0,
                true,
            )
        }
        (_, Technique::Scattering) => {
            let endpoint = x.endpoint();
            nodes.push(last(shape.lobe_before));
            push_end(world, &mut nodes, &endpoint);
            let light = light_of(world, &vertex, &endpoint)?;
            open = light.direction;
            let one = world.evaluate_lobe(&vertex, wo, light.direction, shape.lobe_before);
            let all = world.evaluate(&vertex, wo, light.direction);
            let total = if fault == Some(Fault::LobeForTotal) {
                one
            } else {
                all
            };
            let omega = power(f64::from(total.pdf.value()), emitter_pdf(light.pdf?));
            let density = f64::from(one.pdf.value()) * light.own_density / light.pdf?;
            let free = !world.occluded(&light.ray, RayKind::Reconnection);
            (
                throughput * ratio(one) * light.radiance * omega,
                density,
                1.0,
                free,
            )
        }
    };
    // The first connectable pair must be the one at which the path reconnects.
    let mut rules = domain.connectability;
    if fault == Some(Fault::AnyDistance) && rules.replays() {
        rules = Connectability::hybrid(rules.min_roughness().min(1.0), 0.0).unwrap_or(rules);
    }
    let mut first = None;
    for (second, pair) in (2..).zip(nodes.windows(2)) {
        let [a, b] = pair else { unreachable!() };
        if fault == Some(Fault::NoEarlierPair) && anchored && second < shape.reconnection {
            continue;
        }
        let rough = |node: &Node<W::Vertex>| {
            fault == Some(Fault::AnyRoughness) || node.roughness >= rules.min_roughness()
        };
        if first.is_none()
            && rules.reaches(second)
            && rough(a)
            && rough(b)
            && far(&rules, position(a), position(b))
            && (fault == Some(Fault::AnySpread) || spreads(world, &rules, a, b))
        {
            first = Some(second);
        }
    }
    // An end at infinity or at a point light has no vertex: it is far, and emitters are rough.
    let is_open = nodes.len() as u32 == shape.length - 1 && shape.anchor != AnchorKind::Vertex;
    if is_open
        && first.is_none()
        && let Some(node) = nodes.last()
        && rules.reaches(shape.length)
        && (fault == Some(Fault::AnyRoughness) || node.roughness >= rules.min_roughness())
        && rules
            .footprint()
            .is_none_or(|footprint| density(world, node, open) * f64::from(footprint.solid_angle()) <= 1.0)
    {
        first = Some(shape.length);
    }
    let (contribution, density, density_behind, free) = result;
    let lights = free && contribution.max_element() > 0.0;
    (first == anchored.then_some(shape.reconnection) && lights).then_some(Definition {
        contribution,
        density: density * density_behind,
    })
}

/// The vertex of an emitter, which counts as rough.
fn push_end<W: World>(world: &W, nodes: &mut Vec<Node<W::Vertex>>, endpoint: &Endpoint) {
    if let Endpoint::Surface(place) = endpoint {
        nodes.push(Node {
            vertex: world.vertex(place),
            wo: Vec3::ZERO,
            lobe: 0,
            roughness: f32::INFINITY,
        });
    }
}

/// Density of a direction from a vertex, by its lobe or all of them.
fn density<W: World>(world: &W, from: &Node<W::Vertex>, direction: Vec3) -> f64 {
    let scattering = match from.lobe {
        ALL_LOBES => world.evaluate(&from.vertex, from.wo, direction),
        lobe => world.evaluate_lobe(&from.vertex, from.wo, direction, lobe),
    };
    f64::from(scattering.pdf.value())
}

/// Whether the lobes of a pair are as wide as the footprint asks, if there is one.
fn spreads<W: World>(world: &W, rules: &Connectability, a: &Node<W::Vertex>, b: &Node<W::Vertex>) -> bool {
    rules.footprint().is_none_or(|footprint| {
        let area = f64::from(footprint.area());
        let d = world.position(&b.vertex) - world.position(&a.vertex);
        let direction = d.normalize();
        let cos_theta = f64::from(world.geometric_normal(&b.vertex).dot(direction).abs());
        let squared = d.as_dvec3().length_squared();
        let back = 4.0 * std::f64::consts::PI * f64::from(b.roughness).powi(2) * squared;
        area * density(world, a, direction) * cos_theta / squared <= 1.0 && back >= area
    })
}

/// Whether vertices are far enough apart, and single precision resolves the direction between them.
fn far(rules: &Connectability, a: Vec3, b: Vec3) -> bool {
    let distance = a.distance(b);
    distance >= rules.min_distance() && distance >= b.abs().max_element() / 256.0 && distance > 0.0
}

/// `f cos θ / p`.
fn ratio(scattering: Scattering) -> DVec3 {
    match f64::from(scattering.pdf.value()) {
        0.0 => DVec3::ZERO,
        pdf => scattering.value.as_dvec3() / pdf,
    }
}

/// Radiance against a ray that has met a vertex or nothing.
fn radiance<W: World>(world: &W, met: Option<&W::Vertex>, direction: Vec3) -> DVec3 {
    match met {
        Some(vertex) => world.emitted(vertex, -direction).as_dvec3(),
        None => world.environment(direction).as_dvec3(),
    }
}

/// Density of emitter sampling at `from` of what a ray has met; 0 for what emits nothing.
fn met_pdf<W: World>(world: &W, from: &W::Vertex, met: Option<&W::Vertex>, direction: Vec3) -> f64 {
    let site = world.site(from);
    let pdf: Density<SolidAngle> = match met {
        _ if radiance(world, met, direction) == DVec3::ZERO => Density::ZERO,
        Some(vertex) => world.emitter_pdf(&site, vertex),
        None => world.environment_pdf(&site, direction),
    };
    f64::from(pdf.value())
}

/// What an endpoint sends to a vertex, by the geometry.
fn light_of<W: World>(world: &W, from: &W::Vertex, endpoint: &Endpoint) -> Option<Light<W::Ray>> {
    let light = match endpoint {
        Endpoint::Surface(place) => {
            let emitter = world.vertex(place);
            let d = world.position(&emitter) - world.position(from);
            let direction = d.normalize();
            let pdf = met_pdf(world, from, Some(&emitter), direction);
            let cos_theta = f64::from(world.geometric_normal(&emitter).dot(direction).abs());
            Light {
                direction,
                radiance: radiance(world, Some(&emitter), direction),
                pdf: Some(pdf),
                own_density: pdf * cos_theta / d.as_dvec3().length_squared(),
                ray: world.segment(from, &emitter),
            }
        }
        Endpoint::Direction(direction) => {
            let pdf = met_pdf(world, from, None, *direction);
            Light {
                direction: *direction,
                radiance: radiance(world, None, *direction),
                pdf: Some(pdf),
                own_density: pdf,
                ray: world.ray(from, *direction),
            }
        }
        Endpoint::Delta(_) => {
            let connection = world.connect(from, endpoint)?;
            Light {
                direction: connection.direction,
                radiance: connection.radiance.as_dvec3(),
                pdf: None,
                own_density: f64::from(connection.pdf.value()),
                ray: connection.ray,
            }
        }
    };
    (light.radiance.max_element() > 0.0).then_some(light)
}

fn assert_close(a: DVec3, b: DVec3) {
    assert!(
        (a - b).abs().max_element() <= 1e-4 * b.max_element(),
        "{a} is not {b}"
    );
}

/// One sample of the radiance that leaves a vertex by paths of at most `max_length` edges with that
/// to the viewer, but for what it emits: by following lobes, and emitter sampling only for emitters
/// that no lobe meets.
pub(crate) fn radiance_sample<W: World>(
    world: &W,
    mut vertex: W::Vertex,
    mut wo: Vec3,
    max_length: u32,
    rng: &mut CounterRng,
) -> DVec3 {
    let (mut sum, mut throughput) = (DVec3::ZERO, DVec3::ONE);
    for _ in 2..=max_length {
        if let Some(endpoint @ Endpoint::Delta(_)) =
            world.sample_emitter(&vertex, rng.next_u64(), rng.next_2d())
            && let Some(light) = light_of(world, &vertex, &endpoint)
            && !world.occluded(&light.ray, RayKind::Emitter)
        {
            let scattered = world.evaluate(&vertex, wo, light.direction).value.as_dvec3();
            sum += throughput * scattered * light.radiance / light.own_density;
        }
        let Some(sampled) = world.sample_lobe(&vertex, wo, rng.next_f32(), rng.next_2d()) else {
            break;
        };
        throughput *= ratio(sampled.scattering);
        if throughput.max_element() <= 0.0 {
            break;
        }
        let met = world.trace(&world.ray(&vertex, sampled.wi), RayKind::Path);
        sum += throughput * radiance(world, met.as_ref(), sampled.wi);
        let Some(next) = met else { break };
        (vertex, wo) = (next, -sampled.wi);
    }
    sum
}
