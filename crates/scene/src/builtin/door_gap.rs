//! A room that receives light through a narrow gap.

use super::room::{Room, diffuse};
use crate::{Rgb, SceneDescription};
use glam::Vec3;

/// A room beside a chamber with a lamp, and a gap between the two, 0.04 wide and 1.2 high (after
/// Dittebrandt 2025, fig. 7.11 left).
///
/// The room is `[−1, 1] × [0, 1.6] × [−1, 1.2]`, with a reddish wall across from the gap and
/// a block on the floor. The chamber behind the gap is lower, higher and shorter, so that no
/// surface continues from one into the other. Its lamp shines at the far wall: the room receives
/// light only from the gap, a small part of the directions of any point. All surfaces are diffuse,
/// on both sides.
pub fn door_gap() -> SceneDescription {
    let (white, red) = (0, 1);
    let mut room = Room::default();
    for (name, least, most, material) in [
        ("floor", [-1.0, -0.1, -1.0], [1.0, 0.0, 1.2], white),
        ("ceiling", [-1.0, 1.6, -1.0], [1.0, 1.7, 1.2], white),
        ("back wall", [-1.0, -0.1, -1.1], [1.1, 1.7, -1.0], white),
        ("front wall", [-1.0, -0.1, 1.2], [1.1, 1.7, 1.3], white),
        ("red wall", [1.0, -0.1, -1.0], [1.1, 1.7, 1.2], red),
        // Around the gap.
        (
            "wall behind the gap",
            [-1.05, -0.4, -1.1],
            [-1.0, 2.0, -0.3],
            white,
        ),
        (
            "wall before the gap",
            [-1.05, -0.4, -0.26],
            [-1.0, 2.0, 1.3],
            white,
        ),
        (
            "wall above the gap",
            [-1.05, 1.2, -0.3],
            [-1.0, 2.0, -0.26],
            white,
        ),
        (
            "wall below the gap",
            [-1.05, -0.4, -0.3],
            [-1.0, 0.0, -0.26],
            white,
        ),
        ("chamber, floor", [-2.0, -0.4, -0.8], [-1.05, -0.3, 0.5], white),
        ("chamber, ceiling", [-2.0, 1.9, -0.8], [-1.05, 2.0, 0.5], white),
        ("chamber, back", [-2.0, -0.4, -0.9], [-1.05, 2.0, -0.8], white),
        ("chamber, front", [-2.0, -0.4, 0.5], [-1.05, 2.0, 0.6], white),
        ("chamber, end", [-2.1, -0.4, -0.9], [-2.0, 2.0, 0.6], white),
        ("block", [-0.3, 0.0, -0.7], [0.2, 0.5, -0.2], white),
    ] {
        room.block(name, least, most, material);
    }
    let radiance = Rgb::new(40.0, 36.0, 28.0);
    room.lamp([-1.2, 0.4, -0.5], [[0.0, 0.0, 0.5], [0.0, 0.7, 0.0]], radiance);
    let materials = vec![diffuse(Rgb::splat(0.75)), diffuse(Rgb::new(0.7, 0.3, 0.25))];
    let (from, towards) = (Vec3::new(0.75, 0.9, 1.1), Vec3::new(-0.5, 0.55, -0.6));
    room.seen(from, towards, 62.0, materials)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Ray, Scene};

    /// The lamp shines away from the room; only the gap leads into the room.
    #[test]
    fn the_lamp_is_not_seen_from_the_room() {
        let scene = Scene::new(&door_gap()).unwrap();
        for i in 0..1000u32 {
            let part = |step: u32, a: f32, b: f32| a + (i.wrapping_mul(step) % 997) as f32 / 997.0 * (b - a);
            let from = Vec3::new(
                part(389, -0.95, 0.95),
                part(611, 0.55, 1.55),
                part(787, -0.95, 1.15),
            );
            let towards = Vec3::new(-1.2, 0.75, -0.25) - from;
            let hit = scene.intersect(&Ray::new(from, towards.normalize())).unwrap();
            let radiance = scene.emitters().radiance(&hit, towards.normalize());
            assert_eq!(radiance, Rgb::ZERO, "{from}");
        }
        // Through the gap into the chamber.
        let through = scene.intersect(&Ray::new(Vec3::new(0.5, 0.8, -0.28), Vec3::NEG_X));
        assert!(through.unwrap().position.x < -1.1);
        let beside = scene.intersect(&Ray::new(Vec3::new(0.5, 0.8, -0.31), Vec3::NEG_X));
        assert!((beside.unwrap().position.x + 1.0).abs() < 1e-5);
    }
}
