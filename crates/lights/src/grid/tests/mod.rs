//! The hierarchy against its definition, against brute force, and against itself.

mod construction;
mod queries;
mod shadows;
mod updates;

use super::*;
use glam::Vec3;
use lightshed_sampling::{CounterRng, UniformSphere};

/// Virtual point lights as a path tracer leaves them: on the walls of a room of 4×3×5, facing
/// inwards, and on a ball in it, facing outwards, with colours and intensities that vary by a
/// factor of sixteen.
pub(super) fn room(count: u32, seed: u64) -> Vec<PointLight> {
    (0..count)
        .map(|i| room_light(CounterRng::new(seed, i, 0)))
        .collect()
}

pub(super) fn room_light(mut rng: CounterRng) -> PointLight {
    let size = Vec3::new(4.0, 3.0, 5.0);
    let [u, v] = rng.next_2d();
    let intensity = Vec3::new(1.0, rng.next_f32(), rng.next_f32()) * 16.0f32.powf(rng.next_f32());
    let face = rng.next_u32() % 7;
    if face == 6 {
        let normal = UniformSphere::sample([u, v]);
        return PointLight::lambertian(Vec3::new(1.3, 0.8, 2.0) + 0.7 * normal, normal, intensity);
    }
    let axis = face as usize / 2;
    let far = face % 2 == 1;
    let mut position = Vec3::ZERO;
    position[axis] = if far { size[axis] } else { 0.0 };
    position[(axis + 1) % 3] = u * size[(axis + 1) % 3];
    position[(axis + 2) % 3] = v * size[(axis + 2) % 3];
    let mut normal = Vec3::ZERO;
    normal[axis] = if far { -1.0 } else { 1.0 };
    PointLight::lambertian(position, normal, intensity)
}

/// Lights that shine all around, in a ball of radius one: an explosion.
pub(super) fn cloud(count: u32, seed: u64) -> Vec<PointLight> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(seed, i, 1);
            let direction = UniformSphere::sample(rng.next_2d());
            let position = direction * rng.next_f32().cbrt();
            PointLight::isotropic(position, Vec3::new(1.0, 0.6, 0.2) * rng.next_f32())
        })
        .collect()
}

pub(super) fn options(alpha: f32, levels: Levels) -> GridOptions {
    GridOptions {
        alpha,
        levels,
        ..GridOptions::default()
    }
}
