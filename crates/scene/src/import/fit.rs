//! Views and light for files that have none.

use crate::import::transform::look_at;
use crate::{CameraDescription, EmitterDescription, Geometry, Projection, Rgb, SceneDescription};
use glam::{DVec3, Vec3};

/// Corners of the box around all shapes, or `None` if there is no vertex.
pub(super) fn bounds(scene: &SceneDescription) -> Option<(Vec3, Vec3)> {
    let mut low = Vec3::INFINITY;
    let mut high = Vec3::NEG_INFINITY;
    for shape in &scene.shapes {
        match &shape.geometry {
            Geometry::Mesh(mesh) => {
                for &position in &mesh.positions {
                    low = low.min(position);
                    high = high.max(position);
                }
            }
            Geometry::Sphere(sphere) => {
                low = low.min(sphere.center - sphere.radius);
                high = high.max(sphere.center + sphere.radius);
            }
        }
    }
    low.cmple(high).all().then_some((low, high))
}

/// Sets a camera of 45° that sees the whole box around the scene, from the direction (1, 0.6,
/// 1.4), +Y up.
pub(super) fn camera(scene: &mut SceneDescription) {
    let (low, high) = bounds(scene).unwrap_or((-Vec3::ONE, Vec3::ONE));
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    let center = 0.5 * (low + high);
    let radius = (0.5 * (high - low).length()).max(1e-6);
    // The sphere around the box touches the pyramid of 45° from the distance r / sin(22.5°).
    let aspect = f64::from(scene.settings.width) / f64::from(scene.settings.height).max(1.0);
    let half_fov_x = std::f64::consts::FRAC_PI_8;
    let half_fov_y = (half_fov_x.tan() / aspect).atan();
    let distance = radius / half_fov_x.min(half_fov_y).sin();
    let origin = center + DVec3::new(1.0, 0.6, 1.4).normalize() * distance;
    if let Some(to_world) = look_at(origin, center, DVec3::Y) {
        scene.camera = CameraDescription {
            to_world: to_world.as_affine3a(),
            fov_x: 2.0 * half_fov_x as f32,
            projection: Projection::Pinhole,
            near_clip: (1e-3 * radius) as f32,
            far_clip: (distance + 4.0 * radius) as f32,
        };
    }
}

/// What is said of a camera without perspective.
#[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
pub(super) const ORTHOGRAPHIC: &str = "an orthographic camera is one of perspective from afar: \
     sizes differ by a thousandth over the width of the image in depth";

/// A camera without perspective, of half the image's width `half_width` and planes that clip at
/// the distances `clip`, as one far behind.
#[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
pub(super) fn orthographic(
    to_world: &glam::DAffine3,
    half_width: f64,
    [near, far]: [f64; 2],
) -> CameraDescription {
    let distance = 2_000.0 * half_width;
    let behind = to_world.translation - to_world.matrix3.z_axis * distance;
    CameraDescription {
        to_world: glam::DAffine3::from_mat3_translation(to_world.matrix3, behind).as_affine3a(),
        fov_x: (2.0 * (half_width / distance).atan()) as f32,
        projection: Projection::Pinhole,
        near_clip: (near + distance) as f32,
        far_clip: (far + distance) as f32,
    }
}

/// Adds constant radiance 1 from everywhere if nothing else emits. Says whether it did.
pub(super) fn light(scene: &mut SceneDescription) -> bool {
    let dark = scene.emitters.is_empty() && scene.shapes.iter().all(|shape| shape.emission.is_none());
    if dark {
        scene
            .emitters
            .push(EmitterDescription::Constant { radiance: Rgb::ONE });
    }
    dark
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ShapeDescription, SphereGeometry, builtin};

    /// A ball seen in pictures of every shape: it fills the shorter side and reaches beyond no
    /// side.
    #[test]
    fn the_whole_box_is_in_the_picture() {
        for (width, height) in [(100, 100), (300, 100), (100, 300)] {
            let mut scene = builtin::furnace();
            (scene.settings.width, scene.settings.height) = (width, height);
            let (center, radius) = (Vec3::new(3.0, -2.0, 10.0), 0.25_f32);
            scene.shapes = vec![ShapeDescription {
                geometry: Geometry::Sphere(SphereGeometry {
                    center,
                    radius,
                    flip_normals: false,
                }),
                ..scene.shapes[0].clone()
            }];
            camera(&mut scene);
            let to_camera = scene.camera.to_world.inverse();
            let seen = to_camera.transform_point3(center);
            assert!(
                seen.x.abs() < 1e-5 && seen.y.abs() < 1e-5 && seen.z > 0.0,
                "{seen}"
            );
            // The sphere around the box around the ball, against the narrower half of the view.
            let half_x = 0.5 * scene.camera.fov_x;
            let half_y = (half_x.tan() * height as f32 / width as f32).atan();
            let half_seen = (3.0_f32.sqrt() * radius / seen.z).asin();
            assert!(
                (half_seen / half_x.min(half_y) - 1.0).abs() < 1e-4,
                "{width} × {height}: {half_seen}"
            );
        }
    }
}
