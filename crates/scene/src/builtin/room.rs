//! Parts of scenes with walls.

use super::mesh::{cuboid, quad};
use super::view::{seen_along, without_roulette};
use crate::{
    ColorTexture, ConductorIor, FloatTexture, Geometry, Material, Microfacet, RenderSettings, Rgb, Roughness,
    SceneDescription, ShapeDescription, TriangleMesh,
};
use glam::{Affine3A, Vec3};

/// A material that scatters equally on both sides.
pub(super) fn diffuse(reflectance: Rgb) -> Material {
    Material::TwoSided {
        front: Box::new(Material::Diffuse {
            reflectance: ColorTexture::Constant(reflectance),
        }),
        back: None,
    }
}

/// A metal of a rough surface (GGX, `alpha`) that reflects this at every angle.
pub(super) fn metal(alpha: f32, reflectance: Rgb) -> Material {
    let alpha = FloatTexture::Constant(alpha);
    Material::Conductor {
        // |r|² = 1 for a purely imaginary index.
        ior: ConductorIor {
            eta: Rgb::ZERO,
            k: Rgb::ONE,
        },
        roughness: Some(Roughness {
            distribution: Microfacet::Ggx,
            alpha_u: alpha.clone(),
            alpha_v: alpha,
        }),
        specular_reflectance: ColorTexture::Constant(reflectance),
    }
}

/// Shapes as they are collected.
#[derive(Default)]
pub(super) struct Room(Vec<ShapeDescription>);

impl Room {
    pub fn add(&mut self, name: &str, mesh: TriangleMesh, material: u32, emission: Option<Rgb>) {
        self.0.push(ShapeDescription {
            name: name.to_owned(),
            geometry: Geometry::Mesh(mesh),
            material,
            emission,
        });
    }

    /// A block from one corner to the other. Its inside is a room as well as its outside.
    pub fn block(&mut self, name: &str, least: [f32; 3], most: [f32; 3], material: u32) {
        let (least, most) = (Vec3::from(least), Vec3::from(most));
        let half = Affine3A::from_scale(0.5 * (most - least));
        let mesh = cuboid(Affine3A::from_translation(0.5 * (least + most)) * half);
        self.add(name, mesh, material, None);
    }

    /// A lamp: a parallelogram that shines towards `edges[0] × edges[1]`.
    pub fn lamp(&mut self, corner: [f32; 3], edges: [[f32; 3]; 2], radiance: Rgb) {
        let (corner, [a, b]) = (Vec3::from(corner), edges.map(Vec3::from));
        let mesh = quad([corner, corner + a, corner + a + b, corner + b]);
        self.add("lamp", mesh, 0, Some(radiance));
    }

    /// The scene as seen from a place towards another, under a horizontal angle in degrees. 256 ×
    /// 256 pixels, up to 64 edges, roulette from edge 8 on.
    pub fn seen(self, from: Vec3, towards: Vec3, degrees: f32, materials: Vec<Material>) -> SceneDescription {
        SceneDescription {
            shapes: self.0,
            materials,
            camera: seen_along(from, (towards - from).into(), degrees),
            settings: RenderSettings {
                roulette_depth: 8,
                ..without_roulette(64)
            },
            ..SceneDescription::default()
        }
    }
}
