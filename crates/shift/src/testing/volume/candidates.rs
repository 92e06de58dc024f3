//! Paths of a pixel by naive sampling.

use super::fog::{End, Fog, LAMP_SIDE, MIRROR, Pixel, Vertex};
use crate::volume::{EdgeEnd, FollowPaths, SensorPlace, Step, Transmittance, VolumePath, VolumeWorld};
use lightshed_sampling::glam::{Vec2, Vec3};
use lightshed_sampling::{CounterRng, UniformSphere};
use std::f64::consts::PI;

/// A path of `pixel`, held by it, and its density in the measure of coordinates; `None` in place of
/// one that no light takes.
pub(crate) fn candidate(fog: &Fog, pixel: &Pixel, rng: &mut CounterRng) -> Option<(VolumePath<End>, f64)> {
    let seen = SensorPlace {
        film: Vec2::from(rng.next_2d()),
        lens: rng.next_2d(),
    };
    let mut path = VolumePath::seen(seen);
    let mut pdf = 1.0;
    // Between the camera and the far side of the fog are less than 8.5 units of length.
    let end = end(rng, &mut pdf, |u| (1.5 + 7.0 * u, 1.0 / 7.0));
    let (mut vertex, _) = fog.first(pixel, seen, end, &mut Transmittance::Target)?;
    path.push(Step {
        direction: Vec3::ZERO,
        end,
    });
    let scatterings = 1 + (3.0 * rng.next_f32()) as u32;
    pdf /= 3.0;
    let mut scattered = 1;
    let emits = chance(rng, &mut pdf, 0.2);
    while scattered < scatterings + u32::from(emits) {
        let (direction, lobe) = direction(&vertex, rng, &mut pdf);
        let end = self::end(rng, &mut pdf, |u| {
            let distance = -(1.0 - u).ln();
            (distance, (-f64::from(distance)).exp())
        });
        let before = fog.position(&vertex);
        if let Some(lobe) = lobe {
            path.scatter_by(lobe);
        }
        (vertex, _) = fog.next(&vertex, direction, end, &mut Transmittance::Target)?;
        path.push(Step { direction, end });
        let length = fog.position(&vertex).distance(before);
        let is_connectable = lobe.is_none() && matches!(end, EdgeEnd::Medium(_));
        if is_connectable
            && path.connected_vertex().is_none()
            && length >= fog.reach.least_length(path.end(0))
        {
            path.connect(fog.position(&vertex), length);
        }
        scattered += 1;
    }
    if !emits {
        let is_floor = matches!(vertex, Vertex::Floor { .. });
        path = if chance(rng, &mut pdf, 0.5) {
            pdf /= LAMP_SIDE * LAMP_SIDE;
            path.with_endpoint(End::Lamp(rng.next_2d()), Vec3::splat(1.0))
        } else {
            let (direction, lobe) = direction(&vertex, rng, &mut pdf);
            if let Some(lobe) = lobe.filter(|_| is_floor) {
                path.scatter_by(lobe);
            }
            path.with_endpoint(End::Sky(direction), fog.environment(direction).as_vec3())
        };
    }
    let held = fog.settled(pixel, &path, false);
    (held.target > 0.0).then_some((held, pdf))
}

/// Whether what has probability `p` happens.
fn chance(rng: &mut CounterRng, pdf: &mut f64, p: f32) -> bool {
    let happens = rng.next_f32() < p;
    *pdf *= f64::from(if happens { p } else { 1.0 - p });
    happens
}

/// In the fog, at a distance with its density, or on the floor.
fn end(rng: &mut CounterRng, pdf: &mut f64, distance: impl Fn(f32) -> (f32, f64)) -> EdgeEnd {
    if chance(rng, pdf, 0.75) {
        let (distance, density) = distance(rng.next_f32());
        *pdf *= density;
        EdgeEnd::Medium(distance)
    } else {
        EdgeEnd::Surface
    }
}

/// Any direction, or that of the mirror.
fn direction(vertex: &Vertex, rng: &mut CounterRng, pdf: &mut f64) -> (Vec3, Option<u8>) {
    if let Vertex::Floor { incoming, .. } = vertex
        && chance(rng, pdf, 0.3)
    {
        return (incoming.with_y(-incoming.y), Some(MIRROR));
    }
    *pdf /= 4.0 * PI;
    (UniformSphere::sample(rng.next_2d()), None)
}
