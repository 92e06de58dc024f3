//! Small scenes.

use lightshed_scene::glam::{Affine3A, Mat3, Vec3};
use lightshed_scene::{
    CameraDescription, ColorTexture, ConductorIor, EmitterDescription, EnvironmentMap, FloatTexture,
    Geometry, Image, Material, Microfacet, Rgb, Roughness, Scene, SceneDescription, ShapeDescription,
    SphereGeometry, builtin,
};
use std::sync::Arc;

/// A built-in scene in small.
pub fn small(description: SceneDescription, side: u32) -> Scene {
    Scene::new(&small_description(description, side)).unwrap()
}

/// The same, not yet built.
pub fn small_description(mut description: SceneDescription, side: u32) -> SceneDescription {
    (description.settings.width, description.settings.height) = (side, side);
    description
}

/// A Cornell box in small, from so near that the light is not in view: its edges would be most of
/// the noise.
pub fn cornell_without_light(mut description: SceneDescription, side: u32) -> SceneDescription {
    description.camera.fov_x = 0.4;
    small_description(description, side)
}

fn sphere(center: Vec3, radius: f32, material: u32, emission: Option<f32>) -> ShapeDescription {
    ShapeDescription {
        name: "sphere".to_owned(),
        geometry: Geometry::Sphere(SphereGeometry {
            center,
            radius,
            flip_normals: false,
        }),
        material,
        emission: emission.map(Rgb::splat),
    }
}

/// Every kind of emitter over a floor with a diffuse, a glossy, a mirror and a plastic sphere: an
/// environment with a bright spot, a sphere, two triangles, a point, a spot and a direction.
pub fn every_emitter(side: u32, max_depth: u32) -> Scene {
    let diffuse = |r, g, b| Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::new(r, g, b)),
    };
    let conductor = |alpha: Option<f32>| Material::Conductor {
        ior: ConductorIor {
            eta: Rgb::ZERO,
            k: Rgb::ONE,
        },
        roughness: alpha.map(|alpha| Roughness {
            distribution: Microfacet::Ggx,
            alpha_u: FloatTexture::Constant(alpha),
            alpha_v: FloatTexture::Constant(alpha),
        }),
        specular_reflectance: ColorTexture::Constant(Rgb::splat(0.8)),
    };
    let blend = Material::Blend {
        weight: FloatTexture::Constant(0.4),
        first: Box::new(diffuse(0.2, 0.3, 0.7)),
        second: Box::new(conductor(None)),
    };
    let materials = vec![
        diffuse(0.7, 0.6, 0.5),
        conductor(Some(0.2)),
        conductor(None),
        blend,
        diffuse(0.0, 0.0, 0.0),
    ];
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let floor = builtin::quad([
        corner(-4.0, 4.0),
        corner(4.0, 4.0),
        corner(4.0, -4.0),
        corner(-4.0, -4.0),
    ]);
    let lamp = builtin::quad([
        Vec3::new(1.0, 2.5, -1.0),
        Vec3::new(1.0, 2.5, 0.0),
        Vec3::new(1.8, 2.5, 0.0),
        Vec3::new(1.8, 2.5, -1.0),
    ]);
    let mesh = |name: &str, geometry, material, emission| ShapeDescription {
        name: name.to_owned(),
        geometry: Geometry::Mesh(geometry),
        material,
        emission,
    };
    let mut texels = vec![[0.05, 0.07, 0.1]; 16 * 8];
    texels[2 * 16 + 3] = [6.0, 5.0, 3.0];
    SceneBuilder {
        shapes: vec![
            mesh("floor", floor, 0, None),
            mesh("lamp", lamp, 4, Some(Rgb::new(5.0, 4.0, 3.0))),
            sphere(Vec3::new(-1.6, 0.6, 0.0), 0.6, 0, None),
            sphere(Vec3::new(-0.4, 0.5, 0.6), 0.5, 1, None),
            sphere(Vec3::new(0.7, 0.5, 0.4), 0.5, 2, None),
            sphere(Vec3::new(1.7, 0.5, 0.9), 0.5, 3, None),
            sphere(Vec3::new(-2.2, 2.4, 0.5), 0.25, 4, Some(9.0)),
        ],
        materials,
        emitters: vec![
            EmitterDescription::Point {
                position: Vec3::new(0.0, 1.8, 1.6),
                intensity: Rgb::new(0.4, 0.5, 0.8),
            },
            EmitterDescription::Spot {
                position: Vec3::new(-1.0, 3.0, 2.0),
                direction: Vec3::new(0.3, -1.0, -0.5),
                intensity: Rgb::splat(5.0),
                beam_width: 0.2,
                cutoff_angle: 0.4,
            },
            EmitterDescription::Directional {
                direction: Vec3::new(1.0, -1.0, -0.6),
                irradiance: Rgb::splat(0.3),
            },
            EmitterDescription::Environment(EnvironmentMap {
                image: Arc::new(Image::from_linear(16, 8, texels).unwrap()),
                scale: 1.0,
                to_world: Affine3A::IDENTITY,
            }),
        ],
    }
    .build(side, max_depth)
}

struct SceneBuilder {
    shapes: Vec<ShapeDescription>,
    materials: Vec<Material>,
    emitters: Vec<EmitterDescription>,
}

impl SceneBuilder {
    fn build(self, side: u32, max_depth: u32) -> Scene {
        // The camera looks along its own +z, with +x on the left of the image and +y at its top.
        let (eye, target) = (Vec3::new(0.0, 2.2, 6.0), Vec3::new(0.0, 0.7, 0.0));
        let forward = (target - eye).normalize();
        let left = Vec3::Y.cross(forward).normalize();
        let to_world =
            Affine3A::from_mat3_translation(Mat3::from_cols(left, forward.cross(left), forward), eye);
        let mut description = SceneDescription {
            shapes: self.shapes,
            materials: self.materials,
            emitters: self.emitters,
            camera: CameraDescription {
                to_world,
                fov_x: 0.8,
                ..CameraDescription::default()
            },
            ..SceneDescription::default()
        };
        description.settings.max_depth = Some(max_depth);
        small(description, side)
    }
}
