//! The directions of a path that a reservoir holds.

use crate::domain::PathDomain;
use crate::path_shift::{Left, Offset, Reached, numbers_of, replay, start};
use crate::sample::{ALL_LOBES, AnchorKind, PathSample, Technique};
use crate::world::{Endpoint, RayKind, Sight, World};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Density, SolidAngle};

/// A direction in which a path goes on from one of its vertices.
#[derive(Clone, Copy, Debug)]
pub struct HeldDirection<'v, V> {
    /// The vertex.
    pub vertex: &'v V,
    /// Unit direction to where the path came from.
    pub wo: Vec3,
    /// Unit direction in which it goes on.
    pub wi: Vec3,
    /// Distance to the next vertex; infinite for the environment.
    pub distance: f32,
    /// `F / T`: the path's contribution over its throughput up to the vertex, by channel; 0 where
    /// nothing arrives. Times the contribution weight of its reservoir it estimates the light that
    /// leaves the vertex towards `wo`.
    pub scattered: Vec3,
    /// Density of `wi` over all lobes.
    pub total_pdf: Density<SolidAngle>,
}

/// Passes each direction of `path`, a sample of the domain `of`, to `visit`, in the order of the
/// vertices: those that lobes with a width have sampled, from the first surface vertex to the
/// reconnection vertex. What comes behind that is not stored.
///
/// Directions to sampled emitters are left out: no lobe has sampled them. Vertices that were
/// replayed are traced again, and so is the distance behind a reconnection vertex.
pub fn held_directions<W: World>(
    path: &PathSample,
    of: &PathDomain<'_, W>,
    mut visit: impl FnMut(HeldDirection<'_, W::Vertex>),
) {
    let (shape, world) = (path.shape(), of.world);
    let anchored = shape.anchor != AnchorKind::None;
    // The last vertex that is not copied.
    let last = if anchored {
        shape.reconnection - 1
    } else {
        shape.length - 1
    };
    let replays = !anchored || last > 1;
    let (mut seen, mut numbers) = (None, numbers_of(path, of, replays));
    let Ok((first, wo)) = start(of, &mut numbers, &mut seen) else {
        return;
    };
    let offset = &mut Offset::at(first, wo);
    let scatters = shape.technique == Technique::Scattering;
    // A path without a copied vertex leaves the last one by replay, too.
    let replayed = last + u32::from(!anchored && scatters);
    if let Some(numbers) = &mut numbers {
        for m in 1..replayed {
            let Reached { wo, throughput, .. } = offset.reached();
            let Ok(((ray, wi), left)) = replay(of, offset, m, numbers) else {
                return;
            };
            let next = world.trace(&ray, RayKind::Replay);
            let vertex = offset.reached().vertex;
            let distance = distance(world, vertex, next.as_ref());
            let Left {
                total_pdf, is_delta, ..
            } = left;
            if !is_delta {
                visit(HeldDirection {
                    vertex,
                    wo,
                    wi,
                    distance,
                    scattered: over(path.contribution(), throughput),
                    total_pdf,
                });
            }
            if next.is_none() {
                return;
            }
            offset.arrive(next);
        }
    }
    let reached = offset.reached();
    match (shape.anchor, scatters) {
        (AnchorKind::Vertex, _) => to_vertex(path, of, &reached, visit),
        (AnchorKind::EmitterSurface | AnchorKind::EmitterDirection, true) => {
            let Reached {
                vertex,
                wo,
                throughput,
            } = reached;
            let (wi, distance) = match path.endpoint() {
                Endpoint::Direction(direction) => (direction, f32::INFINITY),
                _ => {
                    let met = world.vertex(&path.place());
                    let sight = Sight::of(world, world.position(vertex), &met);
                    (sight.direction, sight.distance_squared.sqrt())
                }
            };
            visit(HeldDirection {
                vertex,
                wo,
                wi,
                distance,
                scattered: over(path.contribution(), throughput),
                total_pdf: world.evaluate(vertex, wo, wi).pdf,
            });
        }
        _ => (),
    }
}

/// The directions to a reconnection vertex, and from there on.
fn to_vertex<W: World>(
    path: &PathSample,
    of: &PathDomain<'_, W>,
    offset: &Reached<&W::Vertex>,
    mut visit: impl FnMut(HeldDirection<'_, W::Vertex>),
) {
    let (shape, world, vertex) = (path.shape(), of.world, offset.vertex);
    let kept = world.vertex(&path.place());
    let sight = Sight::of(world, world.position(vertex), &kept);
    visit(HeldDirection {
        vertex,
        wo: offset.wo,
        wi: sight.direction,
        distance: sight.distance_squared.sqrt(),
        scattered: over(path.contribution(), offset.throughput),
        total_pdf: world.evaluate(vertex, offset.wo, sight.direction).pdf,
    });
    if shape.lobe_at == ALL_LOBES {
        return;
    }
    let lobe = world.evaluate_lobe(vertex, offset.wo, sight.direction, shape.lobe_before);
    let (wo, wi) = (-sight.direction, path.incident());
    let next = world.trace(&world.ray(&kept, wi), RayKind::Replay);
    visit(HeldDirection {
        vertex: &kept,
        wo,
        wi,
        distance: distance(world, &kept, next.as_ref()),
        scattered: over(path.contribution(), offset.throughput * lobe.weight()),
        total_pdf: world.evaluate(&kept, wo, wi).pdf,
    });
}

/// From one vertex to the next.
fn distance<W: World>(world: &W, from: &W::Vertex, to: Option<&W::Vertex>) -> f32 {
    to.map_or(f32::INFINITY, |to| {
        world.position(from).distance(world.position(to))
    })
}

/// `a / b` by channel; 0 where nothing arrives.
fn over(contribution: Vec3, throughput: Vec3) -> Vec3 {
    let over = |a: f32, b: f32| if b > 0.0 { a / b } else { 0.0 };
    let Vec3 { x, y, z } = throughput;
    Vec3::new(
        over(contribution.x, x),
        over(contribution.y, y),
        over(contribution.z, z),
    )
}
