//! Smoke beside a mirror and a glass sphere.

use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    EmitterDescription, Geometry, Material, Rgb, SceneDescription, ShapeDescription, SphereGeometry, builtin,
};

/// The built-in smoke, seen from near: the large box mirrors, a glass sphere is half within the
/// smoke, and the room is open to a sky. The light is larger and weaker, so that what is seen by
/// way of glass is no noise.
pub fn smoke_and_mirrors() -> SceneDescription {
    let mut scene = builtin::smoke_in_cornell();
    scene.camera.fov_x = 0.45;
    scene.emitters.push(EmitterDescription::Constant {
        radiance: Rgb::new(0.6, 0.8, 1.0),
    });
    let mirror = scene.materials.len() as u32;
    scene.materials.push(Material::Mirror {
        reflectance: Rgb::new(0.9, 0.8, 0.7).into(),
    });
    scene.materials.push(Material::Dielectric {
        eta: 1.5,
        roughness: None,
        specular_reflectance: Rgb::ONE.into(),
        specular_transmittance: Rgb::ONE.into(),
    });
    for shape in &mut scene.shapes {
        match (shape.name.as_str(), &mut shape.geometry) {
            ("largebox", _) => shape.material = mirror,
            ("light", Geometry::Mesh(mesh)) => {
                for position in &mut mesh.positions {
                    *position *= Vec3::new(3.5, 1.0, 3.5);
                }
                shape.emission = Some(Rgb::new(2.0, 1.6, 1.0));
            }
            _ => (),
        }
    }
    scene.shapes.push(ShapeDescription {
        name: "glass".to_owned(),
        geometry: Geometry::Sphere(SphereGeometry {
            center: Vec3::new(0.35, -0.1, 0.6),
            radius: 0.22,
            flip_normals: false,
        }),
        material: mirror + 1,
        emission: None,
    });
    scene
}
