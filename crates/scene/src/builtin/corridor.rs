//! A corridor around several corners.

use super::room::{Room, diffuse};
use crate::{Rgb, SceneDescription};
use glam::Vec3;

/// A corridor that winds between four walls, dark at the camera's end and lit at the other (after
/// Dittebrandt 2025, fig. 7.1 and 7.9).
///
/// A hall `[0, 6] × [0, 1.2] × [0, 2]` with walls across it every 1.2, 0.2 thick, each open for
/// 0.6 at one of its ends, in turn; a lamp at the ceiling of the last part. Light is scattered some
/// five times before it reaches the first. All surfaces are diffuse, on both sides.
pub fn corridor() -> SceneDescription {
    let (white, blue) = (0, 1);
    let mut room = Room::default();
    room.block("hall", [0.0, 0.0, 0.0], [6.0, 1.2, 2.0], white);
    for (number, name) in (1u8..).zip(["first", "second", "third", "fourth"]) {
        let x = 1.2 * f32::from(number);
        let is_odd = number % 2 == 1;
        let [near, far] = if is_odd { [0.0, 1.4] } else { [0.6, 2.0] };
        let material = if is_odd { white } else { blue };
        let name = format!("{name} wall");
        room.block(&name, [x - 0.1, 0.0, near], [x + 0.1, 1.2, far], material);
    }
    room.lamp(
        [5.1, 1.19, 0.6],
        [[0.6, 0.0, 0.0], [0.0, 0.0, 0.8]],
        Rgb::new(60.0, 56.0, 48.0),
    );
    let materials = vec![diffuse(Rgb::splat(0.8)), diffuse(Rgb::new(0.35, 0.5, 0.8))];
    let (from, towards) = (Vec3::new(0.08, 0.65, 0.25), Vec3::new(1.3, 0.5, 1.6));
    room.seen(from, towards, 70.0, materials)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Ray, Scene};

    /// Straight on there is a wall, and through each opening the next one.
    #[test]
    fn the_corridor_winds() {
        let scene = Scene::new(&corridor()).unwrap();
        for (from, wall) in [
            ([0.3, 0.5], 1.1),
            ([0.3, 1.7], 2.3),
            ([1.5, 0.3], 3.5),
            ([3.0, 1.7], 4.7),
        ] {
            let ray = Ray::new(Vec3::new(from[0], 0.6, from[1]), Vec3::X);
            let hit = scene.intersect(&ray).unwrap();
            assert!((hit.position.x - wall).abs() < 1e-4, "{}", hit.position);
        }
        let down = Ray::new(Vec3::new(5.4, 0.1, 1.0), Vec3::Y);
        let lamp = scene.intersect(&down).unwrap();
        assert!(scene.emitters().radiance(&lamp, Vec3::Y).x > 50.0);
    }
}
