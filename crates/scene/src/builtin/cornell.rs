//! The Cornell box in Mitsuba's arrangement, diffuse and glossy.

use super::mesh::{cuboid, quad};
use super::room::metal;
use super::view::{seen_from_front, without_roulette};
use crate::{ColorTexture, FloatTexture, Geometry, Material, Rgb, SceneDescription, ShapeDescription};
use glam::{Affine3A, DAffine3, DQuat, DVec3, Vec3};

const WHITE: Rgb = Rgb::new(0.885_809, 0.698_859, 0.666_422);
const GREEN: Rgb = Rgb::new(0.105_421, 0.377_98, 0.076_425);
const RED: Rgb = Rgb::new(0.570_068, 0.043_013_5, 0.044_370_6);
const RADIANCE: Rgb = Rgb::new(18.387, 13.987_3, 6.753_57);

/// The Cornell box of Mitsuba 3's documentation (`mitsuba.cornell_box()`): walls of the cube
/// `[−1, 1]³` without the front, two boxes, one square light a hundredth below the ceiling; all
/// Lambertian, one-sided, face normals.
///
/// The figures are Mitsuba's, the slips included: the tall box reaches down to `y = −1.01`, a
/// hundredth below the floor, and the light is no square but 0.46 × 0.38. Shapes in order: floor,
/// ceiling, back, green, red, smallbox, largebox, light; 36 triangles. 256 × 256 pixels,
/// `max_depth` 8, no roulette before path edge 1000.
pub fn cornell() -> SceneDescription {
    let diffuse = |reflectance| Material::Diffuse {
        reflectance: ColorTexture::Constant(reflectance),
    };
    cornell_with(vec![diffuse(WHITE), diffuse(GREEN), diffuse(RED)], [0; 2])
}

/// The Cornell box with glossy boxes, after Lin 2022, figure 6.5b.
///
/// The work describes materials "mixing Lambertian and GGX microfacet BSDFs" with roughness 0.5 on
/// the walls and 0.15 on the two boxes, and gives neither the mixture nor the colours. Chosen here:
/// equal parts of the Lambertian surface of [`cornell`] and of an uncoloured GGX mirror (`F = 1`)
/// that reflects 0.9 on the boxes and the wall's own colour on the walls, with `α = roughness²`,
/// as common for material roughness: `α` is 0.25 on the walls and 0.0225 on the boxes. Three
/// bounces of indirect light, as in the figure: `max_depth` 5.
pub fn cornell_glossy() -> SceneDescription {
    let mixture = |albedo: Rgb, mirror: Rgb, roughness: f32| Material::Blend {
        weight: FloatTexture::Constant(0.5),
        first: Box::new(Material::Diffuse {
            reflectance: ColorTexture::Constant(albedo),
        }),
        second: Box::new(metal(roughness * roughness, mirror)),
    };
    let mut materials: Vec<Material> = [WHITE, GREEN, RED].map(|c| mixture(c, c, 0.5)).to_vec();
    materials.push(mixture(WHITE, Rgb::splat(0.9), 0.15));
    let mut scene = cornell_with(materials, [3; 2]);
    scene.settings.max_depth = Some(5);
    scene
}

/// Materials 0, 1 and 2 are white, green and red; `boxes` the materials of the small and the large
/// box.
fn cornell_with(materials: Vec<Material>, boxes: [u32; 2]) -> SceneDescription {
    let corner = Vec3::new;
    let mut shapes = Vec::with_capacity(8);
    let mut add = |name: &str, mesh, material, emission| {
        shapes.push(ShapeDescription {
            name: name.to_owned(),
            geometry: Geometry::Mesh(mesh),
            material,
            emission,
        });
    };
    let floor = [
        corner(-1.0, -1.0, 1.0),
        corner(1.0, -1.0, 1.0),
        corner(1.0, -1.0, -1.0),
        corner(-1.0, -1.0, -1.0),
    ];
    let ceiling = [
        corner(-1.0, 1.0, -1.0),
        corner(1.0, 1.0, -1.0),
        corner(1.0, 1.0, 1.0),
        corner(-1.0, 1.0, 1.0),
    ];
    let back = [
        corner(-1.0, -1.0, -1.0),
        corner(1.0, -1.0, -1.0),
        corner(1.0, 1.0, -1.0),
        corner(-1.0, 1.0, -1.0),
    ];
    let green = [
        corner(1.0, -1.0, -1.0),
        corner(1.0, -1.0, 1.0),
        corner(1.0, 1.0, 1.0),
        corner(1.0, 1.0, -1.0),
    ];
    let red = [
        corner(-1.0, -1.0, 1.0),
        corner(-1.0, -1.0, -1.0),
        corner(-1.0, 1.0, -1.0),
        corner(-1.0, 1.0, 1.0),
    ];
    let light = [
        corner(-0.23, 0.99, -0.18),
        corner(0.23, 0.99, -0.18),
        corner(0.23, 0.99, 0.2),
        corner(-0.23, 0.99, 0.2),
    ];
    add("floor", quad(floor), 0, None);
    add("ceiling", quad(ceiling), 0, None);
    add("back", quad(back), 0, None);
    add("green", quad(green), 1, None);
    add("red", quad(red), 2, None);
    let small = turned_box([0.335, -0.7, 0.38], -17.0, [0.3, 0.3, 0.3]);
    let large = turned_box([-0.33, -0.4, -0.28], 18.25, [0.3, 0.61, 0.3]);
    add("smallbox", cuboid(small), boxes[0], None);
    add("largebox", cuboid(large), boxes[1], None);
    add("light", quad(light), 0, Some(RADIANCE));

    SceneDescription {
        shapes,
        materials,
        emitters: Vec::new(),
        camera: seen_from_front(glam::Vec3A::Z * 3.9, 39.3077),
        settings: without_roulette(8),
        ..SceneDescription::default()
    }
}

/// `translate · rotate_y · scale`, worked out in `f64` so that each vertex is off by one rounding
/// only.
fn turned_box(center: [f64; 3], degrees: f64, half_extent: [f64; 3]) -> Affine3A {
    let matrix = DAffine3::from_scale_rotation_translation(
        DVec3::from_array(half_extent),
        DQuat::from_rotation_y(degrees.to_radians()),
        DVec3::from_array(center),
    );
    matrix.as_affine3a()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::signed_volume;
    use crate::import::read_ply;
    use std::path::Path;

    fn mesh(shape: &ShapeDescription) -> &crate::TriangleMesh {
        match &shape.geometry {
            Geometry::Mesh(mesh) => mesh,
            _ => panic!("{} is no mesh", shape.name),
        }
    }

    #[test]
    fn walls_face_inwards_and_boxes_outwards() {
        let scene = cornell();
        assert_eq!(
            scene.shapes.iter().map(|s| mesh(s).indices.len()).sum::<usize>(),
            36
        );
        for shape in &scene.shapes {
            let mesh = mesh(shape);
            if shape.name.ends_with("box") {
                assert!(signed_volume(mesh) > 0.2);
                continue;
            }
            for triangle in &mesh.indices {
                let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
                let normal = (b - a).cross(c - a);
                assert!(
                    normal.dot(-(a + b + c)) > 0.0,
                    "{} looks away from the middle",
                    shape.name
                );
            }
        }
    }

    #[test]
    fn vertices_are_those_of_the_published_meshes() {
        let Ok(folder) = std::env::var("LIGHTSHED_SCENES") else {
            println!("SKIPPED: LIGHTSHED_SCENES is not set");
            return;
        };
        for shape in &cornell().shapes {
            let file = Path::new(&folder)
                .join("cornell/meshes")
                .join(format!("{}.ply", shape.name));
            let (ours, theirs) = (mesh(shape), read_ply(file).unwrap());
            assert_eq!(ours.indices, theirs.indices, "{}", shape.name);
            assert_eq!(ours.positions.len(), theirs.positions.len());
            for (a, b) in ours.positions.iter().zip(&theirs.positions) {
                // Three roundings at magnitude one. The floor of the tall box is 0.01 away from the
                // floor.
                assert!(a.abs_diff_eq(*b, 2e-7), "{}: {a} against {b}", shape.name);
            }
        }
    }

    #[test]
    fn only_the_glossy_variant_has_a_conductor() {
        let glossy = cornell_glossy();
        assert!(
            glossy
                .materials
                .iter()
                .all(|m| matches!(m, Material::Blend { .. }))
        );
        assert_eq!(glossy.shapes[5].material, 3);
        assert!(
            cornell()
                .materials
                .iter()
                .all(|m| matches!(m, Material::Diffuse { .. }))
        );
    }
}
