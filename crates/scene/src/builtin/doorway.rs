//! A room that receives light through a door.

use super::mesh::{cuboid, quad};
use super::room::{diffuse, metal};
use super::view::{seen_from_front, without_roulette};
use crate::{Geometry, Material, Rgb, SceneDescription, ShapeDescription};
use glam::{Affine3A, Vec3, Vec3A};

/// Two rooms with a doorway between them. The lamp is in the invisible room, on the other side of
/// the wall, and shines away from the wall.
///
/// The front room is the cube `[−1, 1]³` without its front, with one red and one green wall, a
/// diffuse box and a glossy one (GGX, `α = 0.1`). The doorway is 0.4 wide and 1.4 high; the back
/// room is 1.6 deep. No light reaches the front room by fewer than two bounces. Surfaces scatter on
/// both sides. 256 × 256 pixels, `max_depth` 8, no roulette before path edge 1000.
pub fn doorway() -> SceneDescription {
    let metal = Material::TwoSided {
        front: Box::new(metal(0.1, Rgb::splat(0.85))),
        back: None,
    };
    let mut shapes = Vec::new();
    let mut add = |name: &str, mesh, material, emission| {
        shapes.push(ShapeDescription {
            name: name.to_owned(),
            geometry: Geometry::Mesh(mesh),
            material,
            emission,
        });
    };
    // Corners in the plane of two axes, at a place on the third.
    let across = |z: f32, [x0, x1]: [f32; 2], [y0, y1]: [f32; 2]| {
        quad([
            Vec3::new(x0, y0, z),
            Vec3::new(x1, y0, z),
            Vec3::new(x1, y1, z),
            Vec3::new(x0, y1, z),
        ])
    };
    let level = |y: f32, [z0, z1]: [f32; 2]| {
        quad([
            Vec3::new(-1.0, y, z1),
            Vec3::new(1.0, y, z1),
            Vec3::new(1.0, y, z0),
            Vec3::new(-1.0, y, z0),
        ])
    };
    let along = |x: f32, [z0, z1]: [f32; 2]| {
        quad([
            Vec3::new(x, -1.0, z0),
            Vec3::new(x, -1.0, z1),
            Vec3::new(x, 1.0, z1),
            Vec3::new(x, 1.0, z0),
        ])
    };
    let (white, green, red, glossy) = (0, 1, 2, 3);
    let (front, back, full) = ([-1.0, 1.0], [-2.6, -1.0], [-1.0, 1.0]);
    for (name, y) in [("floor", -1.0), ("ceiling", 1.0)] {
        add(name, level(y, [back[0], front[1]]), white, None);
    }
    add("red wall", along(-1.0, front), red, None);
    add("green wall", along(1.0, front), green, None);
    add("back room, left", along(-1.0, back), white, None);
    add("back room, right", along(1.0, back), white, None);
    add("back room, end", across(back[0], full, full), white, None);
    add(
        "beside the door, left",
        across(-1.0, [-1.0, 0.35], full),
        white,
        None,
    );
    add(
        "beside the door, right",
        across(-1.0, [0.75, 1.0], full),
        white,
        None,
    );
    add(
        "above the door",
        across(-1.0, [0.35, 0.75], [0.4, 1.0]),
        white,
        None,
    );
    let block = |center: [f32; 3], degrees: f32, half: [f32; 3]| {
        let turned = Affine3A::from_rotation_y(degrees.to_radians()) * Affine3A::from_scale(half.into());
        cuboid(Affine3A::from_translation(center.into()) * turned)
    };
    add(
        "low box",
        block([0.3, -0.7, 0.35], -17.0, [0.3, 0.3, 0.3]),
        white,
        None,
    );
    add(
        "tall box",
        block([-0.4, -0.4, -0.3], 18.0, [0.28, 0.6, 0.28]),
        glossy,
        None,
    );
    // Facing −z: counter-clockwise as seen from there.
    let lamp = quad([
        Vec3::new(-0.2, -0.2, -1.02),
        Vec3::new(-0.8, -0.2, -1.02),
        Vec3::new(-0.8, 0.5, -1.02),
        Vec3::new(-0.2, 0.5, -1.02),
    ]);
    add("lamp", lamp, white, Some(Rgb::new(60.0, 50.0, 36.0)));

    SceneDescription {
        shapes,
        materials: vec![
            diffuse(Rgb::splat(0.75)),
            diffuse(Rgb::new(0.15, 0.48, 0.1)),
            diffuse(Rgb::new(0.63, 0.06, 0.05)),
            metal,
        ],
        emitters: Vec::new(),
        camera: seen_from_front(Vec3A::Z * 3.9, 39.3),
        settings: without_roulette(8),
        ..SceneDescription::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Ray, Scene};

    /// From anywhere in the front room the lamp is hidden, or turned away.
    #[test]
    fn the_lamp_is_not_seen_from_the_front_room() {
        let scene = Scene::new(&doorway()).unwrap();
        let lamp = Vec3::new(-0.5, 0.15, -1.02);
        for i in 0..1000u32 {
            let part = |step: u32| (i.wrapping_mul(step) % 997) as f32 / 997.0 * 1.96 - 0.98;
            let from = Vec3::new(part(389), part(611), part(787));
            let hit = scene.intersect(&Ray::segment(from, lamp - from, 1.0));
            assert!(hit.is_some_and(|point| point.position.z >= -1.011), "{from}");
        }
        let seen = |from: Vec3, direction| {
            let point = scene.intersect(&Ray::new(from, direction)).unwrap();
            scene.emitters().radiance(&point, direction)
        };
        assert!(seen(Vec3::new(-0.5, 0.1, -2.0), Vec3::Z).x > 50.0);
        // Through the doorway into the back room.
        let through = scene
            .intersect(&Ray::new(Vec3::new(0.55, -0.3, 0.9), -Vec3::Z))
            .unwrap();
        assert!(through.position.z < -2.5);
    }
}
