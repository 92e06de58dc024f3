//! A pool under a small lamp, seen from under the water.

use super::mesh::quad;
use super::view::{seen_along, without_roulette};
use crate::{ColorTexture, Geometry, Material, Rgb, SceneDescription, ShapeDescription, TriangleMesh};
use glam::{Vec3, Vec3A};

/// Squares of the water along a side.
const SQUARES: u32 = 64;
/// Half the side of the water, which reaches into the walls.
const HALF: f32 = 2.05;
/// Waves: wave vector along x and z, height, angular speed.
const WAVES: [[f32; 4]; 5] = [
    [2.1, 0.7, 0.022, 1.4],
    [-1.3, 2.4, 0.018, 1.6],
    [3.9, -2.2, 0.011, 2.1],
    [-4.6, -3.1, 0.008, 2.4],
    [1.2, 6.3, 0.006, 2.6],
];

/// [`pool_at`] the time 0.
pub fn pool() -> SceneDescription {
    pool_at(0.0)
}

/// Caustics on the floor and the walls of a pool of 4 × 4, at `time` seconds of its waves (after
/// Dittebrandt 2025, figs. 6.9 and 6.10).
///
/// The floor lies at −1.2, the water about 0, a smooth dielectric of index 1.33 with waves of up
/// to 0.065: 8,192 triangles with interpolated normals. A lamp of 0.2 × 0.2 hangs 1.5 above the
/// water and is the only light. The camera is under water and looks at the floor and the far wall,
/// which are lit through the surface alone: no emitter sample arrives. 256 × 256 pixels,
/// `max_depth` 3: the camera, the pool, the water, the lamp.
pub fn pool_at(time: f32) -> SceneDescription {
    let mut shapes = Vec::new();
    let mut add = |name: &str, mesh: TriangleMesh, material, emission| {
        shapes.push(ShapeDescription {
            name: name.to_owned(),
            geometry: Geometry::Mesh(mesh),
            material,
            emission,
        });
    };
    let (low, high, side) = (-1.2, 0.3, 2.0);
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x * side, y, z * side);
    let floor = [
        corner(-1.0, low, 1.0),
        corner(1.0, low, 1.0),
        corner(1.0, low, -1.0),
        corner(-1.0, low, -1.0),
    ];
    add("floor", quad(floor), 0, None);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    for wall in 0..4 {
        let ([ax, az], [bx, bz]) = (corners[wall], corners[(wall + 1) % 4]);
        let wall = [
            corner(ax, low, az),
            corner(bx, low, bz),
            corner(bx, high, bz),
            corner(ax, high, az),
        ];
        add("wall", quad(wall), 1, None);
    }
    add("water", water(time), 2, None);
    let lamp = [
        Vec3::new(-0.1, 1.5, -0.1),
        Vec3::new(0.1, 1.5, -0.1),
        Vec3::new(0.1, 1.5, 0.1),
        Vec3::new(-0.1, 1.5, 0.1),
    ];
    add("lamp", quad(lamp), 3, Some(Rgb::new(300.0, 280.0, 240.0)));
    let diffuse = |r, g, b| Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::new(r, g, b)),
    };
    let both = |front| Material::TwoSided {
        front: Box::new(front),
        back: None,
    };
    SceneDescription {
        shapes,
        materials: vec![
            both(diffuse(0.6, 0.7, 0.75)),
            both(diffuse(0.5, 0.65, 0.7)),
            Material::Dielectric {
                eta: 1.33,
                roughness: None,
                specular_reflectance: Rgb::ONE.into(),
                specular_transmittance: Rgb::ONE.into(),
            },
            diffuse(0.0, 0.0, 0.0),
        ],
        emitters: Vec::new(),
        // Towards (0, −0.95, −0.6).
        camera: seen_along(Vec3::new(0.0, -0.45, 1.8), Vec3A::new(0.0, -0.5, -2.4), 65.0),
        settings: without_roulette(3),
        ..SceneDescription::default()
    }
}

/// The surface of the water, its normals upwards.
fn water(time: f32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let count = SQUARES + 1;
    for row in 0..count {
        for column in 0..count {
            let place = |i: u32| HALF * (2.0 * i as f32 / SQUARES as f32 - 1.0);
            let (x, z) = (place(column), place(row));
            let (mut height, mut slope) = (0.0, [0.0; 2]);
            for [along_x, along_z, size, speed] in WAVES {
                let (sin, cos) = (along_x * x + along_z * z + speed * time).sin_cos();
                height += size * sin;
                slope[0] += size * along_x * cos;
                slope[1] += size * along_z * cos;
            }
            mesh.positions.push(Vec3::new(x, height, z));
            mesh.normals
                .push(Vec3::new(-slope[0], 1.0, -slope[1]).normalize());
            if row > 0 && column > 0 {
                let here = row * count + column;
                let (left, above) = (here - 1, here - count);
                mesh.indices
                    .extend([[above - 1, left, here], [above - 1, here, above]]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_water_is_closed_smooth_and_moves() {
        let [now, later] = [0.0, 0.5].map(water);
        assert_eq!((now.indices.len(), now.positions.len()), (8192, 65 * 65));
        assert!(now.positions.iter().all(|p| p.y.abs() < 0.066));
        for &[a, b, c] in &now.indices {
            let [p, q, r] = [a, b, c].map(|i| now.positions[i as usize]);
            let normal = (q - p).cross(r - p).normalize();
            assert!(normal.y > 0.9 && normal.dot(now.normals[a as usize]) > 0.99);
        }
        assert_ne!(now.positions, later.positions);
    }
}
