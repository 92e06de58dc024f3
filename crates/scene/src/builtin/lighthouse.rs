//! A floor that is lit by a bright spot on the wall around it.

use super::mesh::quad;
use super::view::{seen_along, without_roulette};
use crate::{
    ColorTexture, EmitterDescription, Geometry, Material, Rgb, SceneDescription, ShapeDescription,
    TriangleMesh,
};
use glam::Vec3;
use std::f32::consts::TAU;

/// Corners of the floor and the wall around.
const CORNERS: u32 = 96;

/// [`lighthouse_at`] an angle of 0.
pub fn lighthouse() -> SceneDescription {
    lighthouse_at(0.0)
}

/// A floor, a circular wall around it, and a light below the floor that can be turned (after
/// Dittebrandt 2025, fig. 5.10).
///
/// The floor is a disk of radius 1 at height 0, the wall a cylinder of radius 2 from −1 to 1,
/// both grey and with 96 corners. The light is a narrow spot light in the axis, at height −0.5,
/// turned by `angle` radians from +x towards +z; it meets the wall at a height of a quarter, above
/// the floor. So the floor is lit by a spot on the wall alone, which is seen from its middle under
/// five degrees. The camera looks down at the floor and sees nothing else. 256 × 256 pixels,
/// `max_depth` 4.
pub fn lighthouse_at(angle: f32) -> SceneDescription {
    let around = |corner: u32, radius: f32, height: f32| {
        let (sin, cos) = (corner as f32 / CORNERS as f32 * TAU).sin_cos();
        Vec3::new(radius * cos, height, radius * sin)
    };
    let mut floor = TriangleMesh {
        positions: vec![Vec3::ZERO],
        ..TriangleMesh::default()
    };
    for corner in 0..CORNERS {
        floor.positions.push(around(corner, 1.0, 0.0));
        floor.indices.push([0, 1 + (corner + 1) % CORNERS, 1 + corner]);
    }
    let mut shapes = Vec::new();
    let mut add = |name: String, mesh| {
        shapes.push(ShapeDescription {
            name,
            geometry: Geometry::Mesh(mesh),
            material: 0,
            emission: None,
        });
    };
    add("floor".to_owned(), floor);
    for corner in 0..CORNERS {
        let next = corner + 1;
        let side = quad([
            around(corner, 2.0, -1.0),
            around(next, 2.0, -1.0),
            around(next, 2.0, 1.0),
            around(corner, 2.0, 1.0),
        ]);
        add(format!("wall {corner}"), side);
    }
    let grey = Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::splat(0.6)),
    };
    let (sin, cos) = angle.sin_cos();
    let light = EmitterDescription::Spot {
        position: Vec3::new(0.0, -0.5, 0.0),
        direction: Vec3::new(cos, 0.375, sin).normalize(),
        intensity: Rgb::new(700.0, 600.0, 450.0),
        beam_width: 2.0_f32.to_radians(),
        cutoff_angle: 6.0_f32.to_radians(),
    };
    // From (0, 3.4, 0.9) towards the middle of the floor.
    let from = Vec3::new(0.0, 3.4, 0.9);
    SceneDescription {
        shapes,
        materials: vec![Material::TwoSided {
            front: Box::new(grey),
            back: None,
        }],
        emitters: vec![light],
        camera: seen_along(from, (-from).into(), 20.0),
        settings: without_roulette(4),
        ..SceneDescription::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Ray, Scene};

    /// The spot of light is on the wall above the floor, where it is turned to, and nothing of it
    /// below the floor's edge meets the floor.
    #[test]
    fn the_light_turns_along_the_wall() {
        for angle in [0.0, 0.4, 3.0] {
            let scene = Scene::new(&lighthouse_at(angle)).unwrap();
            let direction = Vec3::new(angle.cos(), 0.375, angle.sin()).normalize();
            let spot = scene
                .intersect(&Ray::new(Vec3::new(0.0, -0.5, 0.0), direction))
                .unwrap();
            assert!((spot.position.y - 0.25).abs() < 5e-3, "{}", spot.position);
            // Seen from the floor.
            let from = Vec3::new(-0.4, 1e-3, 0.3);
            let towards = spot.position - from;
            let seen = scene.intersect(&Ray::new(from, towards.normalize())).unwrap();
            assert!(seen.position.distance(spot.position) < 1e-3);
        }
    }
}
