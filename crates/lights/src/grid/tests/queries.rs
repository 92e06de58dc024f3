//! What a look-up finds, and how near it is to the truth.

use super::*;
use lightshed_testkit::check_faults;

fn points(count: u32, seed: u64) -> Vec<Vec3> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(seed, i, 2);
            // Inside the room and around it.
            Vec3::from(std::array::from_fn(|_| 8.0 * rng.next_f32() - 2.0))
        })
        .collect()
}

/// A visit finds every light of every level whose blending function is not zero, and no other.
#[test]
fn a_visit_finds_what_a_walk_over_all_lights_finds() {
    for (lights, alpha, levels) in [
        (room(3000, 11), 0.5, Levels::Auto),
        (room(3000, 11), 2.0, Levels::Auto),
        (cloud(2000, 12), 1.0, Levels::Count(6)),
        (cloud(500, 13), 1.3, Levels::Count(1)),
    ] {
        let grid = LightingGrid::new(&lights, &options(alpha, levels)).unwrap();
        for first_level in [0, 1] {
            let blending = grid.blending(first_level);
            for point in points(40, 14) {
                let mut expected = Vec::new();
                let mut look = |id: LightId, light: &GridLight, emission: &dyn Fn(Vec3) -> f32| {
                    let (to_light, intensity) = (light.position - point, light.intensity);
                    let distance = light.blending_distance_squared(to_light).sqrt();
                    let share = blending.weight(id.level, distance) * emission(-to_light.normalize());
                    if intensity * share != Vec3::ZERO {
                        expected.push((id, intensity * share));
                    }
                };
                for (index, light) in grid.sorted.iter().enumerate() {
                    let id = LightId {
                        level: 0,
                        index: index as u32,
                    };
                    let alone = GridLight {
                        position: light.position,
                        intensity: light.intensity,
                        ..GridLight::default()
                    };
                    look(id, &alone, &|d| light.emission(d));
                }
                for level in 1..=grid.level_count() {
                    for (index, light) in grid.grid_lights(level).iter().enumerate() {
                        let id = LightId {
                            level,
                            index: index as u32,
                        };
                        look(id, light, &|d| light.emission(d));
                    }
                }
                let mut found = Vec::new();
                let query = GridQuery {
                    first_level,
                    ..GridQuery::default()
                };
                grid.visit(point, &query, |influence| {
                    found.push((influence.id, influence.intensity))
                });
                // Lights exactly at the end of a level's reach may round either way.
                let tiny = |intensity: Vec3| intensity.max_element() < 1e-4;
                found.retain(|&(_, intensity)| !tiny(intensity));
                expected.retain(|&(_, intensity)| !tiny(intensity));
                found.sort_by_key(|&(id, _)| (id.level, id.index));
                expected.sort_by_key(|&(id, _)| (id.level, id.index));
                assert_eq!(found.len(), expected.len(), "at {point}");
                for (found, expected) in found.iter().zip(&expected) {
                    assert_eq!(found.0, expected.0);
                    let tolerance = 1e-3 * expected.1.max_element() + 1e-4;
                    assert!(
                        (found.1 - expected.1).abs().max_element() <= tolerance,
                        "at {point}"
                    );
                }
            }
        }
    }
}

/// The mean over all phases of interleaved sampling is the whole.
#[test]
fn interleaved_visits_share_the_lights() {
    let grid = LightingGrid::new(&room(3000, 15), &options(1.0, Levels::Auto)).unwrap();
    let sum = |point: Vec3, query: GridQuery| {
        let mut sum = glam::DVec3::ZERO;
        grid.visit(point, &query, |influence| {
            sum += (influence.intensity / influence.distance_squared).as_dvec3();
        });
        sum
    };
    for point in points(30, 16) {
        let whole = sum(point, GridQuery::default());
        for stride in [3, 4, 16] {
            let shared: glam::DVec3 = (0..stride)
                .map(|phase| {
                    sum(
                        point,
                        GridQuery {
                            stride,
                            phase: phase + 5 * stride,
                            ..GridQuery::default()
                        },
                    )
                })
                .sum();
            assert!(
                (shared / f64::from(stride) / whole - 1.0).abs().max_element() < 1e-4,
                "{shared} {whole}"
            );
        }
    }
}

fn brute_force(lights: &[PointLight], point: Vec3, normal: Vec3) -> f64 {
    lights
        .iter()
        .map(|light| {
            let to_light = light.position - point;
            let distance = to_light.length();
            let direction = to_light / distance;
            let cos_theta = normal.dot(direction).max(0.0);
            f64::from(light.intensity.y * light.emission(-direction) * cos_theta / (distance * distance))
        })
        .sum()
}

/// Irradiance by the hierarchy, summed in `f64`.
fn gathered(grid: &LightingGrid, first_level: u32, point: Vec3, normal: Vec3, double_distance: bool) -> f64 {
    let mut sum = 0.0;
    let blending = grid.blending(first_level);
    let query = GridQuery {
        first_level,
        ..GridQuery::default()
    };
    grid.visit(point, &query, |influence| {
        let mut light = influence.intensity.y;
        if double_distance {
            let distance = influence.distance_squared.sqrt();
            light *= blending.weight(influence.id.level, 2.0 * distance);
        }
        sum += f64::from(light * normal.dot(influence.direction).max(0.0) / influence.distance_squared);
    });
    sum
}

/// Relative error `Σ |E − Ê| / Σ E` against brute force over 100,000 lights, at points inside
/// the room that are no nearer to a light than a seventh of its length: it falls as α grows and is
/// below 3 % at α = 2, from the lights on and from S₁ on. A hierarchy whose blending functions
/// are read at twice the distance, or whose lights forget their normals, is noticed.
#[test]
fn the_error_against_brute_force_falls_with_alpha() {
    let receivers: Vec<(Vec3, Vec3)> = (0..120)
        .map(|i| {
            let mut rng = CounterRng::new(17, i, 3);
            let at = Vec3::from(std::array::from_fn(|_| rng.next_f32()));
            let point = Vec3::splat(0.7) + at * Vec3::new(2.6, 1.6, 3.6);
            (point, UniformSphere::sample(rng.next_2d()))
        })
        // Outside the ball.
        .filter(|(point, _)| point.distance(Vec3::new(1.3, 0.8, 2.0)) > 1.4)
        .collect();
    assert!(receivers.len() > 60);
    let lights = room(100_000, 18);
    let truth: Vec<f64> = receivers
        .iter()
        .map(|&(point, normal)| brute_force(&lights, point, normal))
        .collect();
    let total: f64 = truth.iter().sum();
    check_faults(&["no normals", "blending at twice the distance"], |fault| {
        let mut lights = lights.clone();
        if fault == Some("no normals") {
            lights
                .iter_mut()
                .for_each(|light| *light = PointLight::isotropic(light.position, light.intensity / 4.0));
        }
        let double_distance = fault == Some("blending at twice the distance");
        let error = |alpha: f32, first_level: u32| {
            let grid = LightingGrid::new(&lights, &options(alpha, Levels::Auto)).unwrap();
            let errors = receivers.iter().zip(&truth).map(|(&(point, normal), &truth)| {
                (gathered(&grid, first_level, point, normal, double_distance) - truth).abs()
            });
            errors.sum::<f64>() / total
        };
        let errors = [0.5, 1.0, 2.0, 4.0].map(|alpha| error(alpha, 0));
        let from_first = error(2.0, 1);
        println!(
            "relative error at alpha 0.5, 1, 2, 4: {errors:.4?}, at 2 from S1: {from_first:.4}; {fault:?}"
        );
        if !errors.is_sorted_by(|a, b| a > b) {
            return Err(format!("{errors:?} do not fall"));
        }
        if errors[2].max(from_first) > 0.03 {
            return Err(format!("{} and {from_first} at alpha 2", errors[2]));
        }
        Ok(())
    })
    .unwrap();
}

/// Where all light is isotropic and in a volume, as in an explosion seen from outside: below 3 % at
/// α = 2.
#[test]
fn an_explosion_is_approximated_as_well() {
    let lights = cloud(50_000, 19);
    let receivers: Vec<(Vec3, Vec3)> = (0..40)
        .map(|i| {
            let mut rng = CounterRng::new(20, i, 4);
            let direction = UniformSphere::sample(rng.next_2d());
            (direction * (1.2 + rng.next_f32()), -direction)
        })
        .collect();
    let truth: Vec<f64> = receivers
        .iter()
        .map(|&(point, normal)| brute_force(&lights, point, normal))
        .collect();
    let errors = [1.0, 2.0, 4.0].map(|alpha| {
        let grid = LightingGrid::new(&lights, &options(alpha, Levels::Auto)).unwrap();
        let errors = receivers.iter().zip(&truth).map(|(&(point, normal), &truth)| {
            (f64::from(grid.irradiance(point, normal, 0.0).y) / truth - 1.0).abs()
        });
        errors.sum::<f64>() / receivers.len() as f64
    });
    println!("relative error at alpha 1, 2, 4: {errors:.5?}");
    assert!(
        errors.is_sorted_by(|a, b| a > b) && errors[1] < 0.03,
        "{errors:?}"
    );
}
