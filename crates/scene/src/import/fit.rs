//! Views and light for files that have none.

use super::look;
use crate::import::transform::look_at;
use crate::{
    CameraDescription, EmitterDescription, EnvironmentMap, Geometry, Image, Projection, SceneDescription,
};
use glam::{Affine3A, DVec3, Mat3, Vec3};
use std::sync::Arc;

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
            Geometry::Instances(instances) => {
                for corner in instances.box_corners() {
                    low = low.min(corner);
                    high = high.max(corner);
                }
            }
        }
    }
    low.cmple(high).all().then_some((low, high))
}

/// Directions from which a scene without a camera is looked at, the first unless another shows
/// more than twice the area of its fronts. Of a flat scene they lean towards its flat side.
const VIEWS: [[f64; 3]; 10] = [
    [1.0, 0.6, 1.4],
    [-1.0, 0.6, -1.4],
    [1.0, 0.6, -1.4],
    [-1.0, 0.6, 1.4],
    [0.5, 1.4, 0.9],
    [1.0, -0.6, 1.4],
    [-1.0, -0.6, -1.4],
    [1.0, -0.6, -1.4],
    [-1.0, -0.6, 1.4],
    [0.5, -1.4, 0.9],
];

/// Factors of the components of a direction of view by the areas of a box's sides at right angles
/// to them; alike for a cube.
fn lean(size: DVec3) -> DVec3 {
    let areas = DVec3::new(size.y * size.z, size.z * size.x, size.x * size.y);
    let total = areas.element_sum();
    let shares = if total > 0.0 {
        areas / total
    } else {
        DVec3::splat(1.0 / 3.0)
    };
    shares.map(|share| share.sqrt() + 0.25)
}

/// Sets a camera of 45° that sees the whole box around the scene, +Y up, from the first of the
/// [`VIEWS`] unless fronts of surfaces are to be seen from elsewhere.
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
    let patches = look::patches(scene);
    let lean = lean(high - low);
    let [first, others @ ..] = VIEWS.map(|view| {
        let view = (DVec3::from_array(view) * lean).normalize();
        (view, look::front_area(&patches, view))
    });
    let best = others.into_iter().reduce(|a, b| if b.1 > a.1 { b } else { a });
    let view = best.filter(|(_, area)| *area > 2.0 * first.1).unwrap_or(first).0;
    let origin = center + view * distance;
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

/// Adds the [`studio`] if nothing else emits. Says whether it did.
pub(super) fn light(scene: &mut SceneDescription) -> bool {
    let dark = scene.emitters.is_empty() && scene.shapes.iter().all(|shape| shape.emission.is_none());
    if dark {
        studio(scene);
    }
    dark
}

/// What is said of it.
pub(super) const STUDIO: &str = "grey surroundings, brighter behind the camera, light it";

/// Radiance of the surroundings, but for the side behind the camera.
const SURROUNDINGS: f64 = 0.5;

/// Adds light from all around: radiance `½ + ½ max(0, cos θ)²` about an axis that points from
/// the scene back to the camera, and up and to the left of it. What the camera sees behind the
/// scene is grey, and a white surface that faces the axis sends radiance ¾.
pub(super) fn studio(scene: &mut SceneDescription) {
    const ROWS: u32 = 65;
    let texel = |row: u32| {
        let theta = f64::from(row) / f64::from(ROWS - 1) * std::f64::consts::PI;
        let lobe = theta.cos().max(0.0).powi(2);
        [(SURROUNDINGS + 0.5 * lobe) as f32; 3]
    };
    let map = scene.camera.to_world.matrix3;
    let axes = [map.x_axis, map.y_axis, map.z_axis].map(|axis| axis.as_dvec3().normalize_or_zero());
    let axis = (0.4 * axes[0] + 0.7 * axes[1] - axes[2])
        .normalize_or(DVec3::Y)
        .as_vec3();
    let tangent = axis.any_orthonormal_vector();
    if let Some(image) = Image::from_linear(1, ROWS, (0..ROWS).map(texel).collect()) {
        let turned = Mat3::from_cols(tangent, axis, tangent.cross(axis));
        scene
            .emitters
            .push(EmitterDescription::Environment(EnvironmentMap {
                image: Arc::new(image),
                scale: 1.0,
                to_world: Affine3A::from_mat3(turned),
            }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Rgb, Scene, ShapeDescription, SphereGeometry, builtin};

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

    /// A square seen from where its front is, whichever side that is; and what has fronts
    /// everywhere, from the usual side.
    #[test]
    fn the_camera_looks_at_fronts() {
        let view = |corners: [Vec3; 4]| {
            let mut scene = builtin::furnace();
            scene.materials = vec![Material::Mirror {
                reflectance: Rgb::ONE.into(),
            }];
            scene.shapes = vec![ShapeDescription {
                geometry: Geometry::Mesh(builtin::quad(corners)),
                material: 0,
                ..scene.shapes[0].clone()
            }];
            camera(&mut scene);
            let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else {
                unreachable!("it is a mesh")
            };
            let [a, b, c] = mesh.indices[0].map(|i| mesh.positions[i as usize]);
            let to_camera = Vec3::from(scene.camera.to_world.translation) - a;
            (b - a).cross(c - a).normalize().dot(to_camera.normalize())
        };
        for (u, v) in [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)] {
            for (u, v) in [(u, v), (v, u)] {
                let cos = view([Vec3::ZERO, u, u + v, v]);
                assert!(cos > 0.3, "{u} {v}: {cos}");
            }
        }
        let mut scene = builtin::furnace();
        camera(&mut scene);
        let forward = Vec3::from(scene.camera.to_world.matrix3.z_axis);
        assert!(forward.abs_diff_eq(-Vec3::new(1.0, 0.6, 1.4).normalize(), 1e-5));
    }

    /// A white wall that faces the axis sends `½ + ½ ∫ cos³ θ dω/π = ¾`, one that looks
    /// away ½; and the camera sees ½ behind the scene.
    #[test]
    fn the_studio_is_brightest_behind_the_camera() {
        let mut scene = builtin::furnace();
        (scene.emitters, scene.shapes) = (Vec::new(), vec![scene.shapes[0].clone()]);
        camera(&mut scene);
        assert!(light(&mut scene));
        assert!(!light(&mut scene));
        let built = Scene::new(&scene).unwrap();
        let environment = built.emitters().environment().expect("there is one");
        let map = &scene.camera.to_world.matrix3;
        let axis = Vec3::from(0.4 * map.x_axis + 0.7 * map.y_axis - map.z_axis).normalize();
        let irradiance = |normal: Vec3| {
            let (count, mut sum) = (64_u32, 0.0);
            for i in 0..count * count {
                let [u, v] = [i % count, i / count].map(|k| (f64::from(k) + 0.5) / f64::from(count));
                let (z, phi) = (2.0 * u - 1.0, std::f64::consts::TAU * v);
                let direction = DVec3::new(
                    (1.0 - z * z).sqrt() * phi.cos(),
                    (1.0 - z * z).sqrt() * phi.sin(),
                    z,
                );
                let cos = normal.as_dvec3().dot(direction).max(0.0);
                sum += f64::from(environment.radiance(direction.as_vec3()).x) * cos * 4.0
                    / f64::from(count * count);
            }
            sum
        };
        assert!((irradiance(axis) - 0.75).abs() < 2e-3, "{}", irradiance(axis));
        assert!((irradiance(-axis) - 0.5).abs() < 2e-3, "{}", irradiance(-axis));
        assert_eq!(environment.radiance(Vec3::from(map.z_axis)), Rgb::splat(0.5));
    }
}
