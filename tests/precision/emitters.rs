//! `lightshed-scene`: emitters, skies, and points of surfaces.

use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng};
use lightshed::sampling::CounterRng;
use lightshed::scene::glam::{Affine3A, Quat, Vec3};
use lightshed::scene::{
    EmitterDescription, EnvironmentMap, Geometry, Image, Ray, Scene, SceneDescription, Sphere, SurfacePoint,
    builtin, intersect_triangle,
};
use std::f64::consts::PI;
use std::sync::Arc;

const PART: &str = "lightshed-scene";

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

/// A box with a lamp, of this size and away from the origin by as many sizes.
fn cornell(scale: f32, away: f32) -> Scene {
    let mut description = builtin::cornell();
    for shape in &mut description.shapes {
        if let Geometry::Mesh(mesh) = &mut shape.geometry {
            for position in &mut mesh.positions {
                *position = (*position + away) * scale;
            }
        }
    }
    description.emitters.clear();
    Scene::new(&description).expect("the scene is sound")
}

/// A sky of 8 × 6 texels over 6 decades, some black.
fn sky() -> Scene {
    let mut rng = rng(450);
    let texels = (0..48)
        .map(|i| {
            if i % 5 == 0 {
                [0.0; 3]
            } else {
                [log_uniform(&mut rng, 1e-3, 1e3); 3]
            }
        })
        .collect();
    let map = EnvironmentMap {
        image: Arc::new(Image::from_linear(8, 6, texels).expect("texels are finite")),
        scale: 2.0,
        to_world: Affine3A::from_quat(Quat::IDENTITY),
    };
    let description = SceneDescription {
        emitters: vec![EmitterDescription::Environment(map)],
        ..builtin::cornell()
    };
    Scene::new(&description).expect("the scene is sound")
}

/// Points of the scene's surfaces, found by rays from the middle.
fn points(scene: &Scene, salt: u32, count: u32) -> Vec<SurfacePoint> {
    let mut rng = rng(salt);
    let [low, high] = scene.bounds();
    let middle = 0.5 * low + 0.5 * high;
    (0..count)
        .filter_map(|_| scene.intersect(&Ray::new(middle, direction(&mut rng))))
        .collect()
}

const BOXES: [(f32, f32); 5] = [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 100.0), (1e3, -30.0)];

pub fn rows() -> Vec<Row> {
    vec![
        worst(
            "EmittersByPower::sample",
            "a lamp in boxes of 10⁻⁶ to 10⁶, up to 100 sizes off the origin: density against `EmittersByPower::pdf` where a ray meets it",
            Kind::Relative,
            |w| {
                let mut rng = rng(451);
                for (scale, away) in BOXES {
                    let scene = cornell(scale, away);
                    let mut met = 0;
                    for from in points(&scene, 452, 2_000) {
                        let u = rng.next_2d();
                        let Some(sample) = scene.emitters_by_power().sample(from.position, rng.next_u64(), u)
                        else {
                            continue;
                        };
                        w.exactly(sample.weight.is_finite() && sample.weight.min_element() >= 0.0);
                        w.exactly(sample.pdf.value() > 0.0 && sample.pdf.value().is_finite());
                        if let Some(hit) = scene.intersect(&from.spawn(sample.direction))
                            && hit.emitter != SurfacePoint::NO_EMITTER
                            && hit.geometric_normal.dot(sample.direction).abs() > 0.1
                        {
                            met += 1;
                            let pdf = scene.emitters_by_power().pdf(from.position, &hit);
                            w.add(f64::from(pdf.value()), f64::from(sample.pdf.value()));
                            let radiance = scene.emitters().radiance(&hit, sample.direction);
                            w.add(
                                f64::from(sample.weight.x) * f64::from(sample.pdf.value()),
                                f64::from(radiance.x),
                            );
                        }
                    }
                    w.exactly(met > 100);
                }
            },
        ),
        worst(
            "Environment::sample",
            "a sky over 6 decades, to 10⁻³ of cells' edges: density and radiance against `Environment::pdf`, `Environment::radiance`",
            Kind::Relative,
            |w| {
                let (scene, mut rng) = (sky(), rng(453));
                let environment = scene.emitters().environment().expect("there is a sky");
                let mut met = 0;
                for _ in 0..50_000 {
                    let Some((d, radiance, pdf)) = environment.sample(rng.next_2d()) else {
                        continue;
                    };
                    w.exactly(radiance.is_finite() && pdf.value() > 0.0 && (d.length() - 1.0).abs() < 1e-5);
                    // Cells are as wide in the angles from an axis, whichever it is.
                    let wide =
                        |turns: f64, count: f64| (turns * count - (turns * count).round()).abs() > 1e-3;
                    let (x, y, z) = (f64::from(d.x), f64::from(d.y), f64::from(d.z));
                    if wide(y.acos() / PI, 5.0) && wide(x.atan2(z) / (2.0 * PI), 16.0) && y.abs() < 0.999 {
                        met += 1;
                        w.add(f64::from(environment.pdf(d).value()), f64::from(pdf.value()));
                        w.add(
                            f64::from(environment.radiance(d).x) + 1.0,
                            f64::from(radiance.x) + 1.0,
                        );
                    }
                }
                w.exactly(met > 10_000);
                for d in Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]) {
                    w.exactly(environment.pdf(d).value().is_finite() && environment.radiance(d).is_finite());
                }
            },
        ),
        worst(
            "Environment::pdf",
            "the same sky: its integral over 960 × 960 directions",
            Kind::Absolute,
            |w| {
                let scene = sky();
                let environment = scene.emitters().environment().expect("there is a sky");
                // Of the midpoint rule in the angles that cells are rectangles in, which their
                // edges divide.
                const STEPS: u32 = 960;
                let sum: f64 = (0..STEPS)
                    .map(|i| {
                        let theta = (f64::from(i) + 0.5) / f64::from(STEPS) * PI;
                        let ring: f64 = (0..STEPS)
                            .map(|j| {
                                let phi = (f64::from(j) + 0.5) / f64::from(STEPS) * 2.0 * PI;
                                let d = [theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos()];
                                f64::from(environment.pdf(Vec3::from(d.map(|x| x as f32))).value())
                            })
                            .sum();
                        ring * theta.sin()
                    })
                    .sum();
                w.add(sum * 2.0 * PI * PI / f64::from(STEPS).powi(2), 1.0);
            },
        ),
        worst(
            "SurfacePoint::spawn",
            "the same boxes, directions to 10⁻⁶ of grazing: never the surface that it left; `Scene::intersect`, `Scene::surface`, `SurfacePoint::origin_towards`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(454);
                for (scale, away) in BOXES {
                    let scene = cornell(scale, away);
                    for from in points(&scene, 455, 2_000) {
                        let side = if rng.next_f32() < 0.5 { 1.0 } else { -1.0 };
                        let up = log_uniform(&mut rng, 1e-6, 1.0) * side;
                        let along = from.geometric_normal.any_orthonormal_vector();
                        let d = (along + from.geometric_normal * up).normalize();
                        let ray = from.spawn(d);
                        w.exactly(ray.origin.is_finite() && ray.origin == from.origin_towards(d));
                        w.exactly(
                            scene
                                .intersect(&ray)
                                .is_none_or(|hit| hit.primitive != from.primitive),
                        );
                    }
                }
            },
        ),
        worst(
            "intersect_triangle",
            "triangles without area, equal vertices, rays within the plane, numbers of 10⁻³⁸ to 10³⁸: no hit, or a finite one within the triangle",
            Kind::Absolute,
            |w| {
                let mut rng = rng(456);
                for i in 0..100_000 {
                    let scale = log_uniform(&mut rng, 1e-38, 1e38);
                    let [a, b] = [0; 2].map(|_| direction(&mut rng) * scale);
                    let c = match i % 4 {
                        0 => a,
                        1 => 0.5 * a + 0.5 * b,
                        2 => a + direction(&mut rng) * scale * 1e-7,
                        _ => direction(&mut rng) * scale,
                    };
                    let towards = [a, b, c, Vec3::ZERO, 0.25 * a + 0.75 * c][i % 5];
                    let origin = if i % 3 == 0 {
                        0.5 * b + 0.5 * c
                    } else {
                        direction(&mut rng) * scale
                    };
                    let ray = Ray::new(origin, towards - origin);
                    if let Some(hit) = intersect_triangle(&ray, &[a, b, c], 0, f32::INFINITY) {
                        w.exactly(hit.t.is_finite() && hit.t > 0.0);
                        w.exactly(hit.barycentric.iter().all(|x| (0.0..=1.0).contains(x)));
                        // With two vertices in one nothing is hit.
                        w.exactly(i % 4 != 0);
                    }
                }
            },
        ),
        worst(
            "Sphere::intersect",
            "rays from within, from the surface, beside, without direction, numbers of 10⁻³⁸ to 10³⁸: no hit, or a finite one",
            Kind::Absolute,
            |w| {
                let mut rng = rng(457);
                for i in 0..100_000 {
                    let number = |rng: &mut CounterRng| direction(rng) * log_uniform(rng, 1e-38, 1e38);
                    let ball = Sphere {
                        center: number(&mut rng),
                        radius: log_uniform(&mut rng, 1e-38, 1e38),
                    };
                    let origin = match i % 4 {
                        0 => ball.center,
                        1 => ball.center + direction(&mut rng) * ball.radius,
                        _ => number(&mut rng),
                    };
                    let towards = if i % 5 == 0 { Vec3::ZERO } else { number(&mut rng) };
                    if let Some(t) = ball.intersect(origin, towards, f32::INFINITY) {
                        w.exactly(t.is_finite() && t > 0.0);
                    }
                }
            },
        ),
    ]
}
