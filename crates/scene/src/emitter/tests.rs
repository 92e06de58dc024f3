//! Emitter samples against closed forms and quadrature, and against the densities that they report.
//!
//! The irradiance `E = ∫ L_i cos θ dω` at a point is estimated by `weight · cos θ`, averaged
//! over a grid of stratified random numbers: no statistics, the tolerance is the grid's.

use crate::builtin::quad;
use crate::{
    EmitterDescription, EnvironmentMap, Geometry, Image, Material, Rgb, Scene, SceneDescription,
    ShapeDescription, SphereGeometry, TriangleMesh,
};
use glam::{Affine3A, DVec3, Quat, Vec3};
use lightshed_sampling::CounterRng;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

pub(super) fn scene(shapes: Vec<(Geometry, f32)>, emitters: Vec<EmitterDescription>) -> Scene {
    let shapes = shapes
        .into_iter()
        .map(|(geometry, radiance)| ShapeDescription {
            name: "emitter".to_owned(),
            geometry,
            material: 0,
            emission: Some(Rgb::splat(radiance)),
        })
        .collect();
    let materials = vec![Material::Diffuse {
        reflectance: Rgb::ZERO.into(),
    }];
    Scene::new(&SceneDescription {
        shapes,
        materials,
        emitters,
        ..SceneDescription::default()
    })
    .unwrap()
}

pub(super) fn triangle(corners: [Vec3; 3]) -> Geometry {
    Geometry::Mesh(TriangleMesh {
        positions: corners.to_vec(),
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    })
}

pub(super) fn sphere(center: Vec3, radius: f32, flip_normals: bool) -> Geometry {
    Geometry::Sphere(SphereGeometry {
        center,
        radius,
        flip_normals,
    })
}

/// The integral over the sphere of directions, by the midpoint rule over θ and φ.
pub(super) fn integral(f: impl Fn(Vec3) -> f64) -> f64 {
    let (rows, columns) = (720, 1440);
    let mut sum = 0.0;
    for row in 0..rows {
        let theta = PI * (f64::from(row) + 0.5) / f64::from(rows);
        let solid_angle = theta.sin() * (PI / f64::from(rows)) * (TAU / f64::from(columns));
        for column in 0..columns {
            let phi = TAU * (f64::from(column) + 0.5) / f64::from(columns);
            let d = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            sum += f(d.as_vec3()) * solid_angle;
        }
    }
    sum
}

/// Irradiance (of red) on a surface at `from` with normal `normal`, from `strata` × 64 × 64
/// samples.
fn irradiance(scene: &Scene, from: Vec3, normal: Vec3, strata: u64) -> f64 {
    let mut sum = 0.0;
    for select in 0..strata {
        let u_select = (u128::from(2 * select + 1) * (1 << 63) / u128::from(strata)) as u64;
        for cell in 0..64 * 64 {
            let u = [
                ((cell % 64) as f32 + 0.5) / 64.0,
                ((cell / 64) as f32 + 0.5) / 64.0,
            ];
            if let Some(sample) = scene.emitters_by_power().sample(from, u_select, u) {
                sum += f64::from(sample.weight.x * sample.direction.dot(normal).max(0.0));
            }
        }
    }
    sum / (strata * 64 * 64) as f64
}

fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found / expected - 1.0).abs() < tolerance,
        "{found} for {expected}"
    );
}

/// Lambert's formula: the irradiance from a polygon of unit radiance above the horizon.
fn lambert(corners: &[Vec3], from: Vec3, normal: Vec3) -> f64 {
    let unit: Vec<DVec3> = corners
        .iter()
        .map(|&c| (c.as_dvec3() - from.as_dvec3()).normalize())
        .collect();
    let edges = (0..unit.len()).map(|i| {
        let (a, b) = (unit[i], unit[(i + 1) % unit.len()]);
        a.dot(b).clamp(-1.0, 1.0).acos() * a.cross(b).normalize().dot(normal.as_dvec3())
    });
    0.5 * edges.sum::<f64>().abs()
}

#[test]
fn triangles_give_lamberts_irradiance() {
    let corners = [
        Vec3::new(-1.0, -0.5, 2.0),
        Vec3::new(0.2, 1.0, 1.5),
        Vec3::new(1.0, -0.3, 2.2),
    ];
    let (from, normal) = (Vec3::new(0.1, 0.2, 0.0), Vec3::new(0.1, -0.2, 1.0).normalize());
    // Seen from the front, whichever way the corners run.
    let wound = |scene: &Scene| irradiance(scene, from, normal, 1);
    let [a, b, c] = corners;
    let both = [[a, b, c], [a, c, b]].map(|corners| wound(&scene(vec![(triangle(corners), 3.0)], vec![])));
    let lit = both[0].max(both[1]);
    assert_close(lit, 3.0 * lambert(&corners, from, normal), 2e-3);
    assert_eq!(both[0].min(both[1]), 0.0, "light from behind");
}

#[test]
fn spheres_give_the_irradiance_of_their_solid_angle() {
    let from = Vec3::new(0.3, -0.1, 0.4);
    for (distance, radius) in [(2.0f32, 0.5f32), (1.01, 1.0), (100.0, 0.01), (1e4, 5.0)] {
        let axis = Vec3::new(1.0, 2.0, -0.5).normalize();
        let center = from + axis * distance;
        let lit = scene(vec![(sphere(center, radius, false), 2.0)], vec![]);
        // Facing the centre with the whole sphere above the horizon: E = π L sin²θ.
        let sin_theta = f64::from(radius) / f64::from(from.distance(center));
        assert_close(
            irradiance(&lit, from, axis, 1),
            2.0 * PI * sin_theta * sin_theta,
            2e-3,
        );
        let dark = scene(vec![(sphere(center, radius, true), 2.0)], vec![]);
        assert_eq!(
            irradiance(&dark, from, axis, 1),
            0.0,
            "a sphere that shines inwards"
        );
    }
    // From inside a sphere that shines inwards every direction is as bright: E = π L.
    let around = scene(vec![(sphere(Vec3::ZERO, 3.0, true), 1.5)], vec![]);
    assert_close(irradiance(&around, from, Vec3::Y, 1), 1.5 * PI, 1e-2);
}

#[test]
fn points_spots_and_directions_follow_their_laws() {
    let (from, normal) = (Vec3::new(0.0, 0.0, 0.0), Vec3::Z);
    let position = Vec3::new(0.0, 1.0, 2.0);
    let cos_theta = f64::from(position.normalize().z);
    let point = EmitterDescription::Point {
        position,
        intensity: Rgb::splat(10.0),
    };
    assert_close(
        irradiance(&alone(&point), from, normal, 2),
        10.0 * cos_theta / 5.0,
        1e-5,
    );
    let spot = |beam_width: f32, cutoff_angle: f32| EmitterDescription::Spot {
        position,
        direction: Vec3::new(0.0, 0.0, -1.0),
        intensity: Rgb::splat(10.0),
        beam_width,
        cutoff_angle,
    };
    // The point lies atan(1/2) off the axis.
    let angle = 0.5f32.atan();
    for (beam_width, cutoff_angle, share) in [
        (angle * 1.1, angle * 1.2, 1.0),
        (angle * 0.5, angle * 0.9, 0.0),
        (angle * 0.5, angle * 1.5, 0.5),
    ] {
        let lit = alone(&spot(beam_width, cutoff_angle));
        let expected = share * 10.0 * cos_theta / 5.0;
        assert!(
            (irradiance(&lit, from, normal, 2) - expected).abs() < 1e-5,
            "{beam_width} {cutoff_angle}"
        );
    }
    let sun = EmitterDescription::Directional {
        direction: Vec3::new(3.0, 0.0, -4.0),
        irradiance: Rgb::splat(5.0),
    };
    assert_close(irradiance(&alone(&sun), from, normal, 2), 4.0, 1e-5);
}

/// A scene with one emitter. A scene without surfaces needs an environment, so one is there that
/// can be neglected.
fn alone(emitter: &EmitterDescription) -> Scene {
    let surrounds = matches!(emitter, EmitterDescription::Constant { .. });
    let others = if surrounds { vec![] } else { vec![constant(1e-30)] };
    scene(vec![], [vec![emitter.clone()], others].concat())
}

fn constant(radiance: f32) -> EmitterDescription {
    EmitterDescription::Constant {
        radiance: Rgb::splat(radiance),
    }
}

/// All kinds at once: what one emitter gives must not depend on the others, selection probabilities
/// included.
#[test]
fn irradiances_add_up() {
    let (from, normal) = (Vec3::ZERO, Vec3::Z);
    let corners = [
        Vec3::new(-1.0, -1.0, 2.0),
        Vec3::new(-1.0, 1.0, 2.0),
        Vec3::new(1.0, 1.0, 2.0),
        Vec3::new(1.0, -1.0, 2.0),
    ];
    let shapes = vec![
        (Geometry::Mesh(quad(corners)), 3.0),
        (sphere(Vec3::new(0.0, 4.0, 3.0), 1.0, false), 2.0),
    ];
    let emitters = vec![
        EmitterDescription::Point {
            position: Vec3::new(0.0, 0.0, 1.0),
            intensity: Rgb::splat(0.5),
        },
        EmitterDescription::Directional {
            direction: -Vec3::Z,
            irradiance: Rgb::splat(0.25),
        },
        constant(0.75),
    ];
    let of_shape = |shape: &(Geometry, f32)| irradiance(&scene(vec![shape.clone()], vec![]), from, normal, 2);
    let of_emitter = |emitter: &EmitterDescription| irradiance(&alone(emitter), from, normal, 2);
    let separate: f64 = shapes
        .iter()
        .map(of_shape)
        .chain(emitters.iter().map(of_emitter))
        .sum();
    let together = irradiance(&scene(shapes, emitters), from, normal, 3 * 512);
    assert_close(together, separate, 3e-3);
}

/// Everything but the sampled emitter's own density depends on the map: its orientation, its rows,
/// its wrap.
#[test]
fn environment_images_give_the_irradiance_of_a_quadrature() {
    let (width, height) = (16u32, 9u32);
    let mut rng = CounterRng::new(5, 0, 0);
    let mut texels: Vec<[f32; 3]> = (0..width * height).map(|_| [rng.next_f32(), 0.3, 0.2]).collect();
    // A sun, and black columns across the seam.
    texels[(2 * width + 5) as usize] = [50.0, 40.0, 30.0];
    for row in 0..height {
        for column in [0, 1, width - 1] {
            texels[(row * width + column) as usize] = [0.0; 3];
        }
    }
    let image = Arc::new(Image::from_linear(width, height, texels).unwrap());
    let to_world = Affine3A::from_quat(Quat::from_rotation_x(0.7) * Quat::from_rotation_y(-1.9));
    let map = EnvironmentMap {
        image,
        scale: 1.5,
        to_world,
    };
    let scene = scene(vec![], vec![EmitterDescription::Environment(map)]);
    let environment = scene.emitters().environment().unwrap();
    let normal = Vec3::new(0.3, 0.8, -0.5).normalize();
    let expected = integral(|d| f64::from(environment.radiance(d).x * d.dot(normal).max(0.0)));
    let total_pdf = integral(|d| f64::from(environment.pdf(d).value()));
    assert_close(total_pdf, 1.0, 2e-3);
    assert_close(irradiance(&scene, Vec3::ZERO, normal, 1), expected, 1e-2);
    for _ in 0..10_000 {
        let (direction, radiance, pdf) = environment.sample(rng.next_2d()).unwrap();
        assert!((direction.length() - 1.0).abs() < 1e-5);
        let again = environment.radiance(direction);
        assert!((again - radiance).abs().max_element() <= 2e-3 * (1.0 + radiance.max_element()));
        // A direction at the border of a cell may be read back into its neighbour.
        let same = (environment.pdf(direction).value() / pdf.value() - 1.0).abs() < 1e-3;
        assert!(same || radiance.x < 80.0, "{pdf:?}");
    }
}

/// What [`super::EmittersByPower::pdf`] says of a point that a ray meets is the density that
/// sampling it reports.
#[test]
fn densities_of_samples_are_those_of_hits() {
    let corners = [
        Vec3::new(-1.0, -1.0, 2.0),
        Vec3::new(-1.0, 1.0, 2.0),
        Vec3::new(1.0, 1.0, 2.0),
        Vec3::new(1.0, -1.0, 2.0),
    ];
    let scene = scene(
        vec![
            (Geometry::Mesh(quad(corners)), 3.0),
            (sphere(Vec3::new(3.0, 0.0, 0.0), 1.0, false), 2.0),
            (sphere(Vec3::ZERO, 20.0, true), 0.1),
        ],
        vec![constant(0.1)],
    );
    let mut rng = CounterRng::new(8, 0, 0);
    let mut seen = [0; 5];
    for _ in 0..20_000 {
        let from = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) - 0.5;
        let (u_select, u) = (rng.next_u64(), rng.next_2d());
        let Some(sample) = scene.emitters_by_power().sample(from, u_select, u) else {
            continue;
        };
        if sample.emitter as usize == scene.emitters().area_count() {
            assert_eq!(
                scene.emitters_by_power().pdf_environment(sample.direction),
                sample.pdf
            );
            seen[4] += 1;
            continue;
        }
        let Some(point) = scene.intersect(&crate::Ray::new(from, sample.direction)) else {
            panic!("a sampled direction meets nothing")
        };
        if point.emitter != sample.emitter {
            // Something is in front.
            continue;
        }
        seen[sample.emitter as usize] += 1;
        let pdf = scene.emitters_by_power().pdf(from, &point).value();
        assert!(
            (pdf / sample.pdf.value() - 1.0).abs() < 2e-3,
            "{pdf} for {:?}",
            sample.pdf
        );
        let radiance = scene.emitters().radiance(&point, sample.direction);
        assert!(
            (radiance / sample.pdf.value() / sample.weight - 1.0)
                .abs()
                .max_element()
                < 1e-5
        );
    }
    assert!(seen.iter().all(|&count| count > 100), "{seen:?}");
}
