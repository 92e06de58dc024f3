//! Lights and receivers for tests.

use crate::{Bounds, Facing, Light, OrientationCone, RaySegment, ShadingPoint};
use glam::Vec3;
use lightshed_sampling::{CounterRng, UniformSphere};

/// How lights are strewn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// Everywhere alike, points and diffuse patches, some of them off.
    Uniform,
    /// In groups of very different sizes and powers.
    Clustered,
    /// All at one place, with different powers.
    Equal,
    /// Large boxes that overlap.
    Overlapping,
    /// None of them on.
    Off,
}

pub(crate) const LAYOUTS: [Layout; 5] = [
    Layout::Uniform,
    Layout::Clustered,
    Layout::Equal,
    Layout::Overlapping,
    Layout::Off,
];

fn in_cube(rng: &mut CounterRng) -> Vec3 {
    Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0
}

pub(crate) fn lights_of(layout: Layout, count: usize, seed: u64) -> Vec<Light> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(seed, i as u32, 0);
            let normal = UniformSphere::sample(rng.next_2d());
            let cone = match rng.next_u32() % 4 {
                0 => None,
                1 => Some(OrientationCone::spot(normal, 2.0 * rng.next_f32())),
                _ => Some(OrientationCone::diffuse(normal)),
            };
            let on = if rng.next_u32().is_multiple_of(8) {
                0.0
            } else {
                1.0
            };
            let power = on * (0.05 + rng.next_f32());
            let (center, half, intensity) = match layout {
                Layout::Uniform => (in_cube(&mut rng), in_cube(&mut rng).abs() * 0.01, power),
                Layout::Clustered => {
                    let group = rng.next_u32() % 7;
                    let mut shared = CounterRng::new(seed, group, 1);
                    let size = 4.0_f32.powi(-(group as i32));
                    let center = in_cube(&mut shared) + in_cube(&mut rng) * size;
                    (center, Vec3::splat(0.002 * size), power * size * size)
                }
                Layout::Equal => (Vec3::new(0.1, 0.2, 0.3), Vec3::ZERO, power),
                Layout::Overlapping => (in_cube(&mut rng), in_cube(&mut rng).abs() * 0.7, power),
                Layout::Off => (in_cube(&mut rng), Vec3::ZERO, 0.0),
            };
            Light {
                bounds: Bounds::new(center - half, center + half),
                intensity,
                cone,
            }
        })
        .collect()
}

/// Points near and far, inside boxes and on lights, of every kind of facing.
pub(crate) fn points(lights: &[Light], count: usize, seed: u64) -> Vec<ShadingPoint> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(seed, i as u32, 2);
            let somewhere = &lights[rng.next_u32() as usize % lights.len()].bounds;
            let position = match i % 4 {
                0 => somewhere.center(),
                1 => in_cube(&mut rng) * 20.0,
                2 => somewhere.min,
                _ => in_cube(&mut rng),
            };
            ShadingPoint {
                position,
                normal: UniformSphere::sample(rng.next_2d()),
                facing: [Facing::Front, Facing::Front, Facing::Both, Facing::All][i / 4 % 4],
                reflectance_bound: 1.0,
                gloss: crate::Gloss::default(),
            }
        })
        .collect()
}

/// Stretches of rays, one of them without length.
pub(crate) fn segments(count: usize, seed: u64) -> Vec<RaySegment> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(seed, i as u32, 3);
            let direction = UniformSphere::sample(rng.next_2d());
            let length = if i == 0 { 0.0 } else { 3.0 * rng.next_f32() };
            RaySegment::new(in_cube(&mut rng), direction, length).unwrap()
        })
        .collect()
}
