//! A thousand small lights over a plane.

use super::mesh::{cuboid, quad, tetrahedron};
use super::sequence::Sequence;
use super::view::{seen_along, without_roulette};
use crate::{ColorTexture, Geometry, Material, Rgb, SceneDescription, ShapeDescription, TriangleMesh};
use glam::{Affine3A, Vec3, Vec3A};

/// Lights of [`many_lights`].
const LIGHTS: usize = 1000;

/// A grey plane of 20 × 20 with 40 thin walls standing on it, under 1,000 emissive tetrahedra
/// (4,000 emissive triangles) whose radiance is spread log-uniformly over 2…200.
///
/// Walls are 0.1 thick, 0.6–1.6 long and 0.3–1 high at random places and angles. Lights have a
/// circumradius of 0.04–0.06 and lie at heights of 0.2–2.5, clear of the plane; some touch a
/// wall. They are black besides. The random figures come from a fixed sequence: the scene is the
/// same everywhere, but for the last bit of a platform's sine and power. 256 × 256 pixels, direct
/// light only (`max_depth` 2).
pub fn many_lights() -> SceneDescription {
    let mut draw = Sequence(0x6c69_6768_7473_6864);
    let mut shapes = Vec::with_capacity(LIGHTS + 41);
    let mut add = |name: String, mesh: TriangleMesh, material, emission| {
        shapes.push(ShapeDescription {
            name,
            geometry: Geometry::Mesh(mesh),
            material,
            emission,
        });
    };
    let floor = [
        Vec3::new(-10.0, 0.0, 10.0),
        Vec3::new(10.0, 0.0, 10.0),
        Vec3::new(10.0, 0.0, -10.0),
        Vec3::new(-10.0, 0.0, -10.0),
    ];
    add("floor".to_owned(), quad(floor), 0, None);
    for i in 0..40 {
        let angle = draw.between(0.0, std::f32::consts::TAU);
        let half_height = 0.5 * draw.between(0.3, 1.0);
        let half_extent = Vec3::new(0.5 * draw.between(0.6, 1.6), half_height, 0.05);
        let center = Vec3::new(draw.between(-9.0, 9.0), half_height, draw.between(-9.0, 9.0));
        let to_world = Affine3A::from_translation(center)
            * Affine3A::from_rotation_y(angle)
            * Affine3A::from_scale(half_extent);
        add(format!("wall {i}"), cuboid(to_world), 0, None);
    }
    for i in 0..LIGHTS {
        let center = Vec3::new(
            draw.between(-9.5, 9.5),
            draw.between(0.2, 2.5),
            draw.between(-9.5, 9.5),
        );
        let mesh = tetrahedron(center, draw.between(0.04, 0.06));
        let radiance = 2.0 * 100.0_f32.powf(draw.between(0.0, 1.0));
        add(format!("light {i}"), mesh, 1, Some(Rgb::splat(radiance)));
    }
    let grey = |albedo| Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::splat(albedo)),
    };
    SceneDescription {
        shapes,
        materials: vec![grey(0.5), grey(0.0)],
        emitters: Vec::new(),
        // Towards (0, 0, 1).
        camera: seen_along(Vec3::new(0.0, 9.0, 15.0), Vec3A::new(0.0, -9.0, -14.0), 60.0),
        settings: without_roulette(2),
        ..SceneDescription::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::signed_volume;

    #[test]
    fn lights_and_walls_are_as_described() {
        let scene = many_lights();
        let lights: Vec<_> = scene
            .shapes
            .iter()
            .filter_map(|s| s.emission.map(|e| (s, e.x)))
            .collect();
        assert_eq!((lights.len(), scene.shapes.len()), (1000, 1041));
        assert!(
            lights
                .iter()
                .all(|&(_, radiance)| (2.0..=200.0).contains(&radiance))
        );
        // Log-uniform: the middle of the scale, 20, halves the lights. 500 ± 16 (one standard
        // deviation).
        let dim = lights.iter().filter(|&&(_, radiance)| radiance < 20.0).count();
        assert!((420..580).contains(&dim), "{dim}");
        for shape in &scene.shapes[1..] {
            let Geometry::Mesh(mesh) = &shape.geometry else {
                panic!("{} is no mesh", shape.name)
            };
            assert!(signed_volume(mesh) > 0.0, "{}", shape.name);
            assert!(
                mesh.positions
                    .iter()
                    .all(|p| p.y >= 0.0 && p.x.abs() < 10.0 && p.z.abs() < 10.0)
            );
        }
    }

    #[test]
    fn the_scene_never_changes() {
        let scene = many_lights();
        let Geometry::Mesh(last) = &scene.shapes[1040].geometry else {
            panic!("a mesh")
        };
        let first_word = Sequence(0).between(0.0, 1.0);
        // The first output of SplitMix64 from 0 is e220a8397b1dcdaf.
        assert_eq!(first_word, (0xe2_20a8_u32 as f32) / 16_777_216.0);
        assert_eq!(last.positions.len(), 4);
        assert_eq!(many_lights().shapes[1040].emission, scene.shapes[1040].emission);
    }
}
