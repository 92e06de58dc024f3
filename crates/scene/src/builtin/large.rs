//! Many triangles: for trees.

use super::mesh::cuboid;
use super::view::seen_along;
use crate::{
    CameraDescription, ColorTexture, EmitterDescription, Geometry, Material, RenderSettings, Rgb,
    SceneDescription, ShapeDescription, TriangleMesh,
};
use glam::{Affine3A, Vec3};
use lightshed_sampling::{CounterRng, UniformSphere};

/// Triangles of a box, and of a house with what is on its walls.
const OF_CUBOID: usize = 12;
const OF_HOUSE: usize = 83 * OF_CUBOID;

/// A city of about `thousands` thousand triangles, 1 to 16,000: blocks of houses under a white sky,
/// each with some eighty small boxes on its walls. Triangles are of very different sizes, and thin
/// ones are common.
pub fn city(thousands: u32) -> SceneDescription {
    let houses = (thousands as usize * 1000 / OF_HOUSE).max(1);
    let side = (houses as f64).sqrt().ceil() as usize;
    let mut mesh = TriangleMesh::default();
    mesh.positions.reserve(houses * OF_HOUSE * 2);
    mesh.indices.reserve(houses * OF_HOUSE);
    let unit = cuboid(Affine3A::IDENTITY);
    let mut add = |low: Vec3, high: Vec3| {
        let first = mesh.positions.len() as u32;
        let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
        mesh.positions
            .extend(unit.positions.iter().map(|&p| middle + p * half));
        mesh.indices
            .extend(unit.indices.iter().map(|three| three.map(|i| first + i)));
    };
    for house in 0..houses {
        let mut rng = CounterRng::new(2, house as u32, 0);
        let mut vector = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        let place = Vec3::new((house % side) as f32, 0.0, (house / side) as f32) * 20.0;
        let u = vector();
        let size = Vec3::new(8.0 + 8.0 * u.x, 5.0 + 60.0 * u.y * u.y * u.y, 8.0 + 8.0 * u.z);
        add(place, place + size);
        for _ in 1..OF_HOUSE / OF_CUBOID {
            let (mut at, which) = (vector() * size, vector());
            let axis = if which.x < 0.5 { 0 } else { 2 };
            at[axis] = if which.y < 0.5 { 0.0 } else { size[axis] };
            let half = vector() * 0.4 + 0.02;
            add(place + at - half, place + at + half);
        }
    }
    let extent = side as f32 * 20.0;
    let eye = Vec3::new(-0.15 * extent, 60.0 + 0.1 * extent, -0.15 * extent);
    scene(mesh, "houses", eye, Vec3::new(0.5 * extent, 0.0, 0.5 * extent))
}

/// A ball of hair of about `thousands` thousand triangles, 1 to 16,000: ribbons of a hundred thin
/// triangles that wind around each other, under a white sky. Boxes of neighbours overlap
/// everywhere.
pub fn hairball(thousands: u32) -> SceneDescription {
    const SEGMENTS: u32 = 50;
    let strands = (thousands * 1000 / (2 * SEGMENTS)).max(1);
    let mut mesh = TriangleMesh::default();
    for strand in 0..strands {
        let mut rng = CounterRng::new(1, strand, 0);
        let mut direction_of = || UniformSphere::sample(rng.next_2d());
        let mut at = direction_of() * 0.3;
        let mut direction = (at / 0.3 + direction_of() * 0.5).normalize();
        let half = direction_of() * 0.0005;
        mesh.positions.extend([at - half, at + half]);
        for _ in 0..SEGMENTS {
            direction = (direction + direction_of() * 0.25).normalize();
            at += direction * 0.016;
            let last = mesh.positions.len() as u32 - 2;
            mesh.positions.extend([at - half, at + half]);
            mesh.indices
                .extend([[last, last + 1, last + 2], [last + 1, last + 3, last + 2]]);
        }
    }
    scene(mesh, "hair", Vec3::new(0.0, 0.6, -2.6), Vec3::ZERO)
}

/// A mesh of grey diffuse surfaces under a white sky, seen from `eye`.
fn scene(mesh: TriangleMesh, name: &str, eye: Vec3, target: Vec3) -> SceneDescription {
    let grey = Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::splat(0.6)),
    };
    SceneDescription {
        shapes: vec![ShapeDescription {
            name: name.to_owned(),
            geometry: Geometry::Mesh(mesh),
            material: 0,
            emission: None,
        }],
        materials: vec![Material::TwoSided {
            front: Box::new(grey),
            back: None,
        }],
        emitters: vec![EmitterDescription::Constant { radiance: Rgb::ONE }],
        camera: CameraDescription {
            far_clip: 1e5,
            ..seen_along(eye, (target - eye).into(), 45.0)
        },
        settings: RenderSettings {
            width: 256,
            height: 256,
            samples_per_pixel: 16,
            max_depth: Some(6),
            roulette_depth: 5,
        },
        ..SceneDescription::default()
    }
}
