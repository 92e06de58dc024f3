//! Rays that leave a surface do not meet it again, at scales from 1e-4 to 1e6 and far from the
//! origin.
//!
//! Nothing here is a matter of chance once seeds are fixed: the property must hold for every ray.

use lightshed_sampling::CounterRng;
use lightshed_scene::glam::{Quat, Vec3};
use lightshed_scene::{
    ColorTexture, Geometry, Material, Ray, Rgb, Scene, SceneDescription, ShapeDescription, SphereGeometry,
    SurfacePoint, TriangleMesh, builtin,
};
use lightshed_testkit::check_faults;

const SCALES: [f32; 6] = [1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6];

/// Distances from the origin, in sizes of the object.
const OFFSETS: [f32; 4] = [0.0, 1.0, 10.0, 100.0];

/// Share of the object's size by which rays may start off its surface: more would let light
/// through.
const LARGEST_OFFSET: f32 = 1e-3;

fn scene(geometry: Geometry, emission: Option<Rgb>) -> Scene {
    let black = Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::ZERO),
    };
    Scene::new(&SceneDescription {
        shapes: vec![ShapeDescription {
            name: "object".to_owned(),
            geometry,
            material: 0,
            emission,
        }],
        materials: vec![black],
        ..SceneDescription::default()
    })
    .unwrap()
}

/// What can be wrong with the offset.
#[derive(Clone, Copy, Debug)]
enum Fault {
    NoOffset,
    /// Relative to the point's coordinates alone, which vanish on planes through the origin.
    OfCoordinates,
}

const FAULTS: [Fault; 2] = [Fault::NoOffset, Fault::OfCoordinates];

impl Fault {
    fn plant(self, point: &mut SurfacePoint) {
        point.offset = match self {
            Fault::NoOffset => 0.0,
            Fault::OfCoordinates => {
                16.0 * f32::EPSILON * point.geometric_normal.abs().dot(point.position.abs())
            }
        };
    }
}

fn vector(rng: &mut CounterRng) -> Vec3 {
    loop {
        let v = Vec3::from_array([0; 3].map(|_| 2.0 * rng.next_f32() - 1.0));
        if (1e-6..1.0).contains(&v.length_squared()) {
            return v;
        }
    }
}

/// A unit direction on the side of `normal`: half of them spread evenly, half grazing down to a
/// sine of 1e-4.
fn above(normal: Vec3, rng: &mut CounterRng) -> Vec3 {
    let direction = vector(rng).normalize();
    let along = direction.dot(normal);
    let tangent = (direction - normal * along).normalize_or(normal.any_orthonormal_vector());
    let sine = if rng.next_f32() < 0.5 {
        along.abs()
    } else {
        10.0_f32.powf(-4.0 * rng.next_f32())
    };
    (tangent * (1.0 - sine * sine).max(0.0).sqrt() + normal * sine).normalize()
}

/// What was seen on one object.
#[derive(Debug, Default)]
struct Seen {
    points: usize,
    rays: usize,
    met_again: usize,
    largest_offset: f32,
}

/// Sends rays to the convex object around `center` and on from where they arrive, away from it.
fn leave(scene: &Scene, center: Vec3, size: f32, fault: Option<Fault>, rng: &mut CounterRng) -> Seen {
    let mut seen = Seen::default();
    for _ in 0..100 {
        let origin = center + vector(rng).normalize() * 3.0 * size;
        let target = center + vector(rng) * 0.6 * size;
        let ray = Ray::new(origin, target - origin);
        let Some(mut point) = scene.intersect(&ray) else {
            continue;
        };
        seen.points += 1;
        seen.largest_offset = seen.largest_offset.max(point.offset / size);
        if let Some(fault) = fault {
            fault.plant(&mut point);
        }
        // A lone triangle is met from either side; the side that rays leave on is the side they
        // came from.
        let side = point.geometric_normal * -ray.direction.dot(point.geometric_normal).signum();
        for _ in 0..100 {
            seen.rays += 1;
            seen.met_again += usize::from(scene.occluded(&point.spawn(above(side, rng))));
        }
    }
    seen
}

/// Objects of size `scale` at `center`: random triangles, triangles in the planes of the axes
/// (whose coordinates may vanish), meshes, spheres.
fn objects(center: Vec3, scale: f32, rng: &mut CounterRng) -> Vec<Geometry> {
    let mut objects = vec![
        Geometry::Mesh(builtin::icosphere(center, scale, 2)),
        Geometry::Sphere(SphereGeometry {
            center,
            radius: scale,
            flip_normals: false,
        }),
    ];
    for axis in 0..3 {
        for _ in 0..2 {
            let corners = [0; 3].map(|_| {
                let mut corner = vector(rng) * scale;
                corner[axis] = 0.0;
                center + corner
            });
            objects.push(triangle(corners));
        }
    }
    for _ in 0..6 {
        let corners = [0; 3].map(|_| center + vector(rng) * scale);
        objects.push(triangle(corners));
    }
    // A turned box: faces of two triangles in one plane.
    let turned = lightshed_scene::glam::Affine3A::from_scale_rotation_translation(
        Vec3::splat(0.5 * scale),
        Quat::from_rotation_y(0.3) * Quat::from_rotation_x(0.7),
        center,
    );
    objects.push(Geometry::Mesh(builtin::cuboid(turned)));
    objects
}

fn triangle(corners: [Vec3; 3]) -> Geometry {
    Geometry::Mesh(TriangleMesh {
        positions: corners.to_vec(),
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    })
}

#[test]
fn rays_leave_convex_objects() {
    check_faults(&FAULTS, |fault| {
        let mut rng = CounterRng::new(1, 0, 0);
        let (mut points, mut worst) = (0, 0.0_f32);
        for scale in SCALES {
            for offset in OFFSETS {
                // Also in the planes of the axes, where coordinates vanish and relative bounds with
                // them.
                for direction in [vector(&mut rng).normalize(), Vec3::Y] {
                    let center = direction * (offset * scale);
                    for geometry in objects(center, scale, &mut rng) {
                        let scene = scene(geometry.clone(), None);
                        let seen = leave(&scene, center, scale, fault, &mut rng);
                        points += seen.points;
                        worst = worst.max(seen.largest_offset);
                        if seen.met_again > 0 || seen.largest_offset > LARGEST_OFFSET {
                            return Err(format!(
                                "{geometry:?} at scale {scale}, offset {offset}: {seen:?}"
                            ));
                        }
                    }
                }
            }
        }
        println!("{points} points, largest offset {worst} of the size");
        assert!(points > 20_000, "only {points} points were met");
        Ok(())
    })
    .unwrap();
}

#[test]
fn emitters_are_seen_from_surfaces_that_face_them() {
    // A receiving triangle and an emitting one above it, facing each other: nothing lies between.
    // Level ones, and turned ones: points of a level triangle lie in its plane to the last bit.
    let turned = Quat::from_rotation_y(0.3) * Quat::from_rotation_x(0.7);
    check_faults(&FAULTS, |fault| {
        let mut rng = CounterRng::new(2, 0, 0);
        let mut samples = 0;
        for scale in SCALES {
            for offset in OFFSETS {
                let random = vector(&mut rng).normalize();
                for (direction, turn) in [
                    (random, Quat::IDENTITY),
                    (Vec3::Y, Quat::IDENTITY),
                    (Vec3::X, Quat::IDENTITY),
                    (random, turned),
                    (Vec3::X, turned),
                ] {
                    let center = direction * (offset * scale);
                    let corner = |x: f32, y: f32, z: f32| center + turn * Vec3::new(x, y, z) * scale;
                    // Counter-clockwise seen from the other one.
                    let receiver = [
                        corner(-1.0, 0.0, -1.0),
                        corner(-1.0, 0.0, 1.0),
                        corner(1.0, 0.0, 0.3),
                    ];
                    let lifted = 0.02 + rng.next_f32();
                    let emitter = [
                        corner(-0.5, lifted, -0.4),
                        corner(0.6, lifted, -0.2),
                        corner(-0.1, lifted, 0.7),
                    ];
                    let black = Material::Diffuse {
                        reflectance: ColorTexture::Constant(Rgb::ZERO),
                    };
                    let shape = |name: &str, corners, emission| ShapeDescription {
                        name: name.to_owned(),
                        geometry: triangle(corners),
                        material: 0,
                        emission,
                    };
                    let scene = Scene::new(&SceneDescription {
                        shapes: vec![
                            shape("receiver", receiver, None),
                            shape("emitter", emitter, Some(Rgb::ONE)),
                        ],
                        materials: vec![black],
                        ..SceneDescription::default()
                    })
                    .unwrap();
                    let visible = look(&scene, center, turn, scale, fault, &mut rng)?;
                    samples += visible;
                }
            }
        }
        assert!(samples > 20_000, "only {samples} samples");
        Ok::<_, String>(())
    })
    .unwrap();
}

/// Samples the emitter from points of the receiver; how many samples there were, all seen.
fn look(
    scene: &Scene,
    center: Vec3,
    turn: Quat,
    scale: f32,
    fault: Option<Fault>,
    rng: &mut CounterRng,
) -> Result<usize, String> {
    let mut samples = 0;
    for index in 0..60 {
        let target = Vec3::new(rng.next_f32() - 0.5, 0.0, rng.next_f32() - 0.5) * scale;
        // A third of them close to the center, where coordinates are much less than those of the
        // corners.
        let target = center + turn * target * if index % 3 == 0 { 1e-3 } else { 1.0 };
        let up = turn * Vec3::Y;
        // From between the two, so that the receiver is what is met.
        let ray = Ray::new(target + up * 0.01 * scale, -up);
        let Some(mut point) = scene.intersect(&ray) else {
            continue;
        };
        if point.emitter != SurfacePoint::NO_EMITTER {
            continue;
        }
        if let Some(fault) = fault {
            fault.plant(&mut point);
        }
        for _ in 0..20 {
            let Some(light) = scene
                .emitters_by_power()
                .sample(point.position, rng.next_u64(), rng.next_2d())
            else {
                continue;
            };
            samples += 1;
            if scene.occluded(&light.shadow_ray(&point)) {
                return Err(format!(
                    "scale {scale}, around {center}: {point:?} does not see {light:?}"
                ));
            }
        }
    }
    Ok(samples)
}
