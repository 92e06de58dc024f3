//! The white furnace.

use super::view::seen_from_front;
use crate::{
    ColorTexture, EmitterDescription, Geometry, Material, RenderSettings, Rgb, SceneDescription,
    ShapeDescription, SphereGeometry,
};
use glam::Vec3A;

/// A white Lambertian sphere (albedo 1) in an environment of constant radiance 1: every pixel of a
/// correct renderer is exactly 1, whether it sees the sphere or not.
///
/// At a point of the sphere `∫ (ρ/π) L cosθ dω = ρ L = 1`, the convex sphere never sees
/// itself, and roulette is off (until path edge 1000). So only the sampling of the environment and
/// the sphere is tested: with cosine sampling and no next-event estimation even single samples
/// are 1. Any gain or loss is a wrong density, MIS weight, normalisation or self-intersection.
pub fn furnace() -> SceneDescription {
    SceneDescription {
        shapes: vec![ShapeDescription {
            name: "sphere".to_owned(),
            geometry: Geometry::Sphere(SphereGeometry {
                center: glam::Vec3::ZERO,
                radius: 1.0,
                flip_normals: false,
            }),
            material: 0,
            emission: None,
        }],
        materials: vec![Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::ONE),
        }],
        emitters: vec![EmitterDescription::Constant { radiance: Rgb::ONE }],
        // The sphere fills about two thirds of the width.
        camera: seen_from_front(Vec3A::Z * 4.0, 42.0),
        settings: RenderSettings {
            width: 64,
            height: 64,
            samples_per_pixel: 16,
            max_depth: None,
            roulette_depth: 1000,
        },
        ..SceneDescription::default()
    }
}
