//! Paths by the definition of their coordinates, in `f64`.

use super::fog::{ALBEDO, End, FLOOR, Fog, MIRROR, Pixel, RADIUS};
use crate::volume::{EdgeEnd, VolumePath};
use lightshed_sampling::glam::DVec3;

/// A path in a pixel.
#[derive(Clone, Debug)]
pub(crate) struct Definition {
    /// `F`.
    pub value: DVec3,
    /// Where its vertices are.
    pub positions: Vec<DVec3>,
}

/// The path in `pixel` that has the coordinates of `path`, with extinctions in transmittances
/// scaled by `scale`; `None` if there is none, or no light comes.
pub(crate) fn define(fog: &Fog, pixel: &Pixel, path: &VolumePath<End>, scale: f64) -> Option<Definition> {
    let (origin, direction) = Fog::camera_ray(pixel, path.seen);
    let (mut at, mut incoming) = (origin.as_dvec3(), direction.as_dvec3());
    let mut value = DVec3::ONE;
    let mut positions = Vec::new();
    let mut on_floor = false;
    for place in 0..path.vertices() {
        let is_connected = path.connected_vertex() == Some(place);
        if place > 0 {
            let mut direction = path.direction(place).as_dvec3();
            if is_connected {
                direction = (path.connection.place.as_dvec3() - at).normalize();
            }
            let lobe = path.lobe_to(place);
            let scattered = scatter(fog, at, incoming, on_floor, lobe, &mut direction)?;
            value *= scattered;
            incoming = direction;
        }
        let next = match path.end(place) {
            _ if is_connected => path.connection.place.as_dvec3(),
            EdgeEnd::Medium(distance) => at + incoming * f64::from(distance),
            EdgeEnd::Surface => {
                let t = (FLOOR - at.y) / incoming.y;
                if !(t > 1e-4 && t < 50.0) {
                    return None;
                }
                (at + incoming * t).with_y(FLOOR)
            }
        };
        let is_surface = path.end(place) == EdgeEnd::Surface;
        if !is_surface && (next.length() > RADIUS || next.y <= FLOOR) {
            return None;
        }
        if is_connected && next.distance(at) < f64::from(fog.reach.least_length(path.end(0))) {
            return None;
        }
        value *= fog.transmittance(at, next, scale)?;
        (at, on_floor) = (next, is_surface);
        positions.push(at);
    }
    let lobe = path.lobe_to(path.vertices());
    let light = match (path.endpoint, lobe) {
        (None, _) => {
            let light = if on_floor { DVec3::ZERO } else { fog.emission(at) };
            return (light.max_element() > 0.0).then(|| Definition {
                value: value * light,
                positions,
            });
        }
        (Some(End::Lamp(place)), _) => {
            let (mut direction, light) = Fog::lamp_light(place, at);
            let scattered = scatter(fog, at, incoming, on_floor, None, &mut direction)?;
            scattered * light * fog.transmittance(at, Fog::lamp(place), scale)?
        }
        (Some(End::Sky(direction)), lobe) => {
            let mut direction = direction.as_dvec3();
            let scattered = scatter(fog, at, incoming, on_floor, lobe, &mut direction)?;
            if direction.y < 0.0 && (FLOOR - at.y) / direction.y < 50.0 {
                return None;
            }
            scattered * Fog::sky(direction) * fog.transmittance(at, at + direction * 20.0, scale)?
        }
    };
    value *= light;
    (value.max_element() > 0.0).then_some(Definition { value, positions })
}

/// What a vertex scatters out of `direction`, which a mirror turns to its own.
fn scatter(
    fog: &Fog,
    at: DVec3,
    incoming: DVec3,
    on_floor: bool,
    lobe: Option<u8>,
    direction: &mut DVec3,
) -> Option<DVec3> {
    let scattered = match lobe {
        Some(MIRROR) if on_floor => {
            *direction = incoming.with_y(-incoming.y);
            Fog::MIRROR_SHARE
        }
        Some(_) => return None,
        None if on_floor => Fog::floor_scattered(*direction),
        None => fog.k * (ALBEDO * fog.density(at) * Fog::phase_of(incoming.dot(*direction))),
    };
    (scattered.max_element() > 0.0).then_some(scattered)
}
