//! What a pixel makes of a path.

use super::path::{ConnectedEdge, VolumePath};
use super::world::{EdgeEnd, Transmittance, VolumeWorld};
use lightshed_sampling::CounterRng;
use lightshed_sampling::glam::{DVec3, Vec3};

/// Evaluates paths in pixels of a world.
pub trait FollowPaths: VolumeWorld {
    /// The path as a pixel holds it: with its target, `|F|` over the channels with the
    /// transmittances of targets, and its connection.
    ///
    /// `is_known`: the values behind the connected edge are those of the path.
    fn settled(
        &self,
        pixel: &Self::Pixel,
        path: &VolumePath<Self::Endpoint>,
        is_known: bool,
    ) -> VolumePath<Self::Endpoint> {
        match follow(self, pixel, path, is_known, &mut Transmittance::Target) {
            Some(Followed { value, connection }) => path.held(connection, path_target(value)),
            None => path.held(path.connection, 0.0),
        }
    }

    /// An unbiased estimate of `F` with estimates of transmittances; it may be negative.
    fn estimate(
        &self,
        pixel: &Self::Pixel,
        path: &VolumePath<Self::Endpoint>,
        rng: &mut CounterRng,
    ) -> DVec3 {
        follow(self, pixel, path, false, &mut Transmittance::Estimate(rng))
            .map_or(DVec3::ZERO, |followed| followed.value)
    }
}

impl<W: VolumeWorld + ?Sized> FollowPaths for W {}

/// `|F|` over the channels, as stored: of all targets this one gives the least mean squared error
/// of the colour. A luminance target would select red and blue light too rarely for its
/// contribution.
pub fn path_target(value: DVec3) -> f32 {
    let target = (value.length() * THIRD_ROOT) as f32;
    if target < f32::INFINITY { target } else { f32::MAX }
}

/// `1/√3`: white light has the target of its channels.
const THIRD_ROOT: f64 = 0.577_350_269_189_625_8;

/// `F` in its factors, with the connection as it is in the pixel.
struct Followed {
    value: DVec3,
    connection: ConnectedEdge,
}

/// `None` where no light comes.
fn follow<W: VolumeWorld + ?Sized>(
    world: &W,
    pixel: &W::Pixel,
    path: &VolumePath<W::Endpoint>,
    is_known: bool,
    transmittance: &mut Transmittance<'_>,
) -> Option<Followed> {
    let connected = path.connected_vertex().unwrap_or(usize::MAX);
    let mut connection = path.connection;
    // In front of the connection's vertex, and behind.
    let (mut front, mut behind) = (DVec3::ONE, DVec3::ONE);
    let (mut vertex, through) = world.first(pixel, path.seen, path.end(0), transmittance)?;
    front *= through;
    for place in 1..path.vertices() {
        let (mut direction, mut end) = (path.direction(place), path.end(place));
        if place == connected {
            let between = connection.place - world.position(&vertex);
            connection.length = between.length();
            if !(connection.length >= world.connection_reach().least_length(path.end(0))) {
                return None;
            }
            direction = between / connection.length;
            end = EdgeEnd::Medium(connection.length);
        }
        let scattered = if let Some(lobe) = path.lobe_to(place) {
            let reflected = world.reflected(&vertex, lobe)?;
            direction = reflected.direction;
            reflected.share
        } else if place == connected.saturating_add(1) {
            connection.onward = direction;
            front *= world.phase(&vertex, direction);
            world.scattering(&vertex)
        } else {
            world.scattered(&vertex, direction)
        };
        if !(scattered.max_element() > 0.0) {
            return None;
        }
        let (next, through) = world.next(&vertex, direction, end, transmittance)?;
        let factor = if place > connected {
            &mut behind
        } else {
            &mut front
        };
        *factor *= scattered * through;
        vertex = next;
        if place == connected {
            world.set_position(&mut vertex, connection.place);
            if is_known {
                let phase = if connection.onward == Vec3::ZERO {
                    1.0
                } else {
                    world.phase(&vertex, connection.onward)
                };
                return Some(Followed {
                    value: front * phase * connection.behind,
                    connection,
                });
            }
        }
    }
    let last = path.vertices() - 1;
    let (light, onward) = light_at_end(world, path, &vertex, transmittance)?;
    let scattered = if onward == Vec3::ZERO {
        DVec3::ONE
    } else if last == connected {
        front *= world.phase(&vertex, onward);
        world.scattering(&vertex)
    } else {
        world.scattered(&vertex, onward)
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

/// Light at the last vertex of a path, and the direction from which it arrives; zero if it is not
/// scattered.
fn light_at_end<W: VolumeWorld + ?Sized>(
    world: &W,
    path: &VolumePath<W::Endpoint>,
    vertex: &W::Vertex,
    transmittance: &mut Transmittance<'_>,
) -> Option<(DVec3, Vec3)> {
    let last = path.vertices() - 1;
    let Some(endpoint) = &path.endpoint else {
        // A surface that emits is a vertex only behind a lobe without width: otherwise it is an
        // endpoint.
        if path.end(last) == EdgeEnd::Surface {
            path.lobe_to(last)?;
        }
        return Some((world.emitted(vertex), Vec3::ZERO));
    };
    if let Some(lobe) = path.lobe_to(path.vertices()) {
        let reflected = world.reflected(vertex, lobe)?;
        let sky = world.environment(reflected.direction);
        let through = world.transmittance_to_environment(vertex, reflected.direction, transmittance)?;
        return Some((reflected.share * sky * through, Vec3::ZERO));
    }
    match world.environment_direction(endpoint) {
        Some(direction) => {
            let through = world.transmittance_to_environment(vertex, direction, transmittance)?;
            Some((path.radiance.as_dvec3() * through, direction))
        }
        None => world
            .lit(vertex, endpoint, transmittance)
            .map(|(direction, arriving)| (arriving, direction)),
    }
}
