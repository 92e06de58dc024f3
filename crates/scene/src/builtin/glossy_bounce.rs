//! A wall that is lit by a glossy reflection.

use super::room::{Room, diffuse, metal};
use crate::{Material, Rgb, SceneDescription};
use glam::Vec3;

/// A wall that a glossy floor lights with the reflection of a lamp behind a board (after
/// Dittebrandt 2025, fig. 7.11 right).
///
/// A room `[−1, 1] × [0, 1.5] × [−1, 1.6]` whose floor is a metal (GGX, `α = 0.15`,
/// reflecting 0.9); the rest is diffuse. A board across the room hides the lamp from the camera's
/// part of it, except for a gap above the floor. Light falls through the gap onto the floor and is
/// reflected to the wall, as a band whose edges show how rough the floor is. A method that replaces
/// the floor's reflection by a mean over directions blurs the band over the wall.
pub fn glossy_bounce() -> SceneDescription {
    let (white, mirror) = (0, 1);
    let floor = Material::TwoSided {
        front: Box::new(metal(0.15, Rgb::splat(0.9))),
        back: None,
    };
    let mut room = Room::default();
    room.block("walls", [-1.0, -0.01, -1.0], [1.0, 1.5, 1.6], white);
    room.block("floor", [-0.999, -0.009, -0.999], [0.999, 0.0, 1.599], mirror);
    room.block("board", [-0.999, 0.3, 0.4], [0.999, 1.499, 0.42], white);
    // Shines towards −z.
    room.lamp(
        [0.9, 0.3, 1.4],
        [[-1.8, 0.0, 0.0], [0.0, 0.3, 0.0]],
        Rgb::new(10.0, 9.0, 7.0),
    );
    let (from, towards) = (Vec3::new(0.0, 0.7, 0.35), Vec3::new(0.0, 0.6, -1.0));
    room.seen(from, towards, 72.0, vec![diffuse(Rgb::splat(0.6)), floor])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Ray, Scene};

    /// The lamp is hidden from the wall's middle and from the camera, and its mirror image is not.
    #[test]
    fn the_floor_alone_shows_the_lamp() {
        let scene = Scene::new(&glossy_bounce()).unwrap();
        let lamp = Vec3::new(0.0, 0.45, 1.4);
        for from in [Vec3::new(0.0, 0.7, 0.35), Vec3::new(0.1, 0.8, -0.99)] {
            let blocked = scene
                .intersect(&Ray::new(from, (lamp - from).normalize()))
                .unwrap();
            assert!((blocked.position.z - 0.4).abs() < 0.03, "{}", blocked.position);
        }
        let wall = Vec3::new(0.0, 0.8, -0.99);
        let down = (Vec3::new(0.0, -0.45, 1.4) - wall).normalize();
        let floor = scene.intersect(&Ray::new(wall, down)).unwrap();
        assert!(floor.position.y.abs() < 1e-4 && floor.position.z > 0.0);
        let up = Vec3::new(down.x, -down.y, down.z);
        let met = scene.intersect(&floor.spawn(up)).unwrap();
        assert!(scene.emitters().radiance(&met, up).x > 8.0);
    }
}
