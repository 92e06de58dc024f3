//! A storehouse of many small rooms.

use super::mesh::quad;
use super::view::{seen_from_front, without_roulette};
use crate::{ColorTexture, Geometry, Material, Rgb, SceneDescription, ShapeDescription, TriangleMesh};
use glam::{Vec3, Vec3A};

/// Rooms along x, y and z.
const ROOMS: [u32; 3] = [12, 8, 4];
/// Extent of a room.
const ROOM: Vec3 = Vec3::new(2.0, 3.0, 2.0);
/// Half the side of a lamp, and its distance from the ceiling.
const LAMP: [f32; 2] = [0.2, 0.1];
/// Width and height of a doorway.
const DOOR: [f32; 2] = [0.7, 2.0];

/// 384 lamps in as many rooms: eight storeys of 12 × 4 rooms of 2 × 3 × 2 behind an open front.
///
/// Under each ceiling hangs a lamp of 0.4 × 0.4 that shines downwards, of radiance 4 to 16.
/// Doorways of 0.7 × 2 join rooms side by side; there is no way from the front to the back. So a
/// point sees its own lamp, and through doorways a part of one or two others, while hundreds of
/// hidden ones are in front of it and together would be many times as bright. Walls are grey,
/// scatter on both sides and have no thickness. 256 × 256 pixels, `max_depth` 4.
pub fn warehouse() -> SceneDescription {
    let mut shapes = Vec::new();
    let mut add = |name: String, mesh: TriangleMesh, emission: Option<f32>| {
        shapes.push(ShapeDescription {
            name,
            geometry: Geometry::Mesh(mesh),
            material: 0,
            emission: emission.map(|radiance| Rgb::new(1.0, 0.85, 0.65) * radiance),
        });
    };
    let [nx, ny, nz] = ROOMS;
    let size = Vec3::new(nx as f32, ny as f32, nz as f32) * ROOM;
    // The building stands on y = 0, its front is at z = 0.
    let (left, right) = (-0.5 * size.x, 0.5 * size.x);
    for storey in 0..=ny {
        let y = storey as f32 * ROOM.y;
        let corners = [
            Vec3::new(left, y, 0.0),
            Vec3::new(right, y, 0.0),
            Vec3::new(right, y, -size.z),
            Vec3::new(left, y, -size.z),
        ];
        add(format!("floor {storey}"), quad(corners), None);
    }
    for row in 1..=nz {
        let z = -(row as f32) * ROOM.z;
        let corners = [
            Vec3::new(left, 0.0, z),
            Vec3::new(right, 0.0, z),
            Vec3::new(right, size.y, z),
            Vec3::new(left, size.y, z),
        ];
        add(format!("wall across {row}"), quad(corners), None);
    }
    // In a plane x = constant.
    let along = |x: f32, [y0, y1]: [f32; 2], [z0, z1]: [f32; 2]| {
        quad([
            Vec3::new(x, y0, z0),
            Vec3::new(x, y0, z1),
            Vec3::new(x, y1, z1),
            Vec3::new(x, y1, z0),
        ])
    };
    for x in [left, right] {
        add(
            "outer wall".to_owned(),
            along(x, [0.0, size.y], [0.0, -size.z]),
            None,
        );
    }
    for (storey, row) in (0..ny).flat_map(|storey| (0..nz).map(move |row| (storey, row))) {
        let (y, z) = (storey as f32 * ROOM.y, -(row as f32) * ROOM.z);
        for wall in 1..nx {
            let x = left + wall as f32 * ROOM.x;
            let (far, door) = (z - ROOM.z, z - ROOM.z + DOOR[0]);
            add(
                "beside a door".to_owned(),
                along(x, [y, y + ROOM.y], [z, door]),
                None,
            );
            add(
                "above a door".to_owned(),
                along(x, [y + DOOR[1], y + ROOM.y], [door, far]),
                None,
            );
        }
    }
    for room in 0..nx * ny * nz {
        let place = Vec3::new(
            (room % nx) as f32,
            (room / nx % ny) as f32,
            (room / (nx * ny)) as f32,
        );
        let center = Vec3::new(
            left + (place.x + 0.5) * ROOM.x,
            (place.y + 1.0) * ROOM.y - LAMP[1],
            -(place.z + 0.5) * ROOM.z,
        );
        // Downwards: counter-clockwise as seen from below.
        let lamp = quad([
            center + Vec3::new(-LAMP[0], 0.0, -LAMP[0]),
            center + Vec3::new(LAMP[0], 0.0, -LAMP[0]),
            center + Vec3::new(LAMP[0], 0.0, LAMP[0]),
            center + Vec3::new(-LAMP[0], 0.0, LAMP[0]),
        ]);
        // A fixed sequence between 0 and 3, by a Weyl step.
        let step = room.wrapping_mul(2_654_435_769) >> 30;
        add(format!("lamp {room}"), lamp, Some(4.0 + 4.0 * step as f32));
    }
    let grey = Material::TwoSided {
        front: Box::new(Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::splat(0.6)),
        }),
        back: None,
    };
    SceneDescription {
        shapes,
        materials: vec![grey],
        emitters: Vec::new(),
        camera: seen_from_front(Vec3A::new(0.0, 0.5 * size.y, 34.0), 40.0),
        settings: without_roulette(4),
        ..SceneDescription::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Ray, Scene};

    #[test]
    fn most_lamps_are_hidden_from_any_point() {
        let scene = Scene::new(&warehouse()).unwrap();
        let emitters = scene.emitters();
        assert_eq!(emitters.len(), 768);
        for room in 0..48u32 {
            let part = |step: u32| (room.wrapping_mul(step) % 97) as f32 / 97.0;
            let from = Vec3::new(
                -11.9 + 23.8 * part(41),
                (7.99 * part(67)).floor() * ROOM.y + 2.7 * part(83),
                -0.1 - 1.8 * part(29),
            );
            let seen = (0..768).filter(|&emitter| {
                let extent = emitters.extent(emitter).unwrap();
                let to = 0.5 * (extent.min + extent.max) - Vec3::Y * 1e-3;
                to.y > from.y && !scene.occluded(&Ray::segment(from, to - from, 1.0))
            });
            let seen = seen.count();
            assert!((1..=16).contains(&seen), "{seen} from {from}");
        }
    }
}
