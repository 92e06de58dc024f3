//! Which lights are chosen for shadow rays, and where these go.

use super::*;
use lightshed_sampling::luminance;
use lightshed_testkit::{MeanTest, check_faults, chi_squared_test};
use std::collections::HashMap;

fn contribution(influence: &Influence) -> Vec3 {
    influence.intensity * (influence.direction.y.max(0.0) / influence.distance_squared)
}

/// Choices against probabilities, χ² at 1e-6. Choosing by intensity alone is noticed.
#[test]
fn lights_are_chosen_in_proportion_to_what_they_give() {
    let grid = LightingGrid::new(&room(400, 21), &options(0.7, Levels::Auto)).unwrap();
    let point = Vec3::new(2.0, 0.4, 1.1);
    let query = GridQuery::default();
    check_faults(&["by intensity"], |fault| {
        let mut weights = HashMap::new();
        let mut order = Vec::new();
        grid.visit(point, &query, |influence| {
            let weight = f64::from(luminance(contribution(influence)));
            if weight > 0.0 {
                weights.insert((influence.id.level, influence.id.index), order.len());
                order.push(weight);
            }
        });
        let total: f64 = order.iter().sum();
        let mut observed = vec![0u64; order.len()];
        let draws = 8000;
        for draw in 0..draws {
            let mut rng = CounterRng::new(22, draw, 0);
            let gathered = grid.gather(point, &query, 5, &mut rng, |influence| match fault {
                None => contribution(influence),
                Some(_) if influence.direction.y > 0.0 => influence.intensity,
                Some(_) => Vec3::ZERO,
            });
            assert_eq!(gathered.samples().count(), 5);
            for id in gathered.samples() {
                observed[weights[&(id.level, id.index)]] += 1;
            }
        }
        let expected: Vec<f64> = order
            .iter()
            .map(|weight| weight / total * f64::from(5 * draws))
            .collect();
        chi_squared_test(&observed, &expected, 1e-6)
    })
    .unwrap();
}

/// One pass adds up what a visit adds up, whatever the number of samples; where nothing arrives
/// nothing is chosen.
#[test]
fn the_sum_does_not_depend_on_the_samples() {
    let grid = LightingGrid::new(&room(2000, 23), &GridOptions::default()).unwrap();
    let point = Vec3::new(1.0, 2.0, 3.0);
    let mut rng = CounterRng::new(24, 0, 0);
    let gather =
        |samples, rng: &mut CounterRng| grid.gather(point, &GridQuery::default(), samples, rng, contribution);
    let alone = gather(0, &mut rng);
    assert_eq!(alone.samples().count(), 0);
    for samples in [1, 16, 99] {
        let gathered = gather(samples, &mut rng);
        assert_eq!(gathered.unshadowed, alone.unshadowed);
        assert_eq!(gathered.samples().count(), samples.min(MAX_SHADOW_SAMPLES));
    }
    let none = grid.gather(point, &GridQuery::default(), 4, &mut rng, |_| Vec3::ZERO);
    assert_eq!((none.unshadowed, none.samples().count()), (Vec3::ZERO, 0));
}

/// Places in the box of a grid light have its centre and standard deviations: z-tests at 1e-6 a
/// coordinate. A box as wide as the deviations themselves is noticed.
#[test]
fn shadow_targets_have_the_mean_and_the_spread_of_the_lights() {
    let grid = LightingGrid::new(&cloud(3000, 25), &GridOptions::default()).unwrap();
    let id = LightId { level: 3, index: 11 };
    let light = grid.grid_lights(3)[11];
    let spread = light.spread;
    assert!(spread.min_element() > 0.0);
    check_faults(&["narrow"], |fault| {
        let mut tests = [MeanTest::new(); 6];
        for i in 0..20_000 {
            let mut rng = CounterRng::new(26, i, 0);
            let target = grid.shadow_target(id, [rng.next_f32(), rng.next_f32(), rng.next_f32()]);
            let mut off = (target - light.position) / spread;
            if fault.is_some() {
                off /= 3.0f32.sqrt();
            }
            for axis in 0..3 {
                tests[axis].push(f64::from(off[axis]));
                tests[axis + 3].push(f64::from(off[axis] * off[axis]));
            }
        }
        for axis in 0..3 {
            tests[axis].test_against(0.0, 1e-6)?;
            tests[axis + 3].test_against(1.0, 1e-6)?;
        }
        Ok::<_, lightshed_testkit::StatisticsError>(())
    })
    .unwrap();
}

/// Lights behind a grid light are drawn by their shares in it, exactly where they shine all around:
/// χ² at 1e-6 for a light of each of three levels. Drawing without the trilinear shares is
/// noticed.
#[test]
fn represented_lights_are_drawn_by_their_shares() {
    let lights = cloud(150, 27);
    let grid = LightingGrid::new(&lights, &options(1.0, Levels::Count(3))).unwrap();
    let point = Vec3::splat(5.0);
    check_faults(&["no shares"], |fault| {
        for level in 1..=3 {
            let brightness = |&index: &u32| grid.grid_lights(level)[index as usize].intensity.x.to_bits();
            let index = (0..grid.grid_lights(level).len() as u32)
                .max_by_key(brightness)
                .unwrap();
            let id = LightId { level, index };
            let vertex = grid.levels[level as usize - 1].vertex_of(id);
            let frame = grid.frame(level);
            let weight = |light: &PointLight| {
                let off = (frame.in_cells(light.position) - glam::DVec3::from(vertex.map(f64::from))).abs();
                let share = (1.0 - off).max(glam::DVec3::ZERO);
                let share = share.x * share.y * share.z;
                let share = if fault.is_some() && share > 0.0 {
                    1.0
                } else {
                    share
                };
                share * f64::from(luminance(light.intensity))
            };
            let weights: Vec<f64> = lights.iter().map(weight).collect();
            let total: f64 = weights.iter().sum();
            let draws = 20_000;
            let mut observed = vec![0u64; lights.len()];
            for draw in 0..draws {
                let mut rng = CounterRng::new(28, draw, level);
                observed[grid.represented_light(id, point, &mut rng) as usize] += 1;
            }
            let expected: Vec<f64> = weights.iter().map(|w| w / total * f64::from(draws)).collect();
            // Lights of no share must never be drawn.
            if let Some(place) = (0..lights.len()).find(|&i| weights[i] == 0.0 && observed[i] > 0) {
                return Err(format!("light {place} has no share in {id:?}"));
            }
            chi_squared_test(&observed, &expected, 1e-6).map_err(|error| error.to_string())?;
        }
        Ok(())
    })
    .unwrap();
}

/// Of walls that face each other, only lights on the one that faces the point are drawn.
#[test]
fn represented_lights_face_the_point() {
    let mut lights = room(4000, 29);
    // Two walls back to back, between two rooms.
    for light in &mut lights {
        light.position.x = 0.0;
        light.normal = if light.intensity.y > 0.5 * light.intensity.x {
            Vec3::X
        } else {
            -Vec3::X
        };
    }
    let grid = LightingGrid::new(&lights, &GridOptions::default()).unwrap();
    let point = Vec3::new(2.0, 1.5, 2.5);
    let mut rng = CounterRng::new(30, 0, 0);
    for level in 0..=grid.level_count() {
        for index in 0..5 {
            let id = LightId { level, index };
            let light = grid.lights()[grid.represented_light(id, point, &mut rng) as usize];
            assert!(level == 0 || light.normal == Vec3::X, "{id:?}: {light:?}");
        }
    }
}

#[test]
fn a_light_that_there_is_not_is_harmless() {
    let grid = LightingGrid::new(&room(50, 31), &GridOptions::default()).unwrap();
    let mut rng = CounterRng::new(32, 0, 0);
    for id in [
        LightId { level: 99, index: 0 },
        LightId {
            level: 0,
            index: 1 << 30,
        },
    ] {
        assert!(grid.shadow_target(id, [0.5; 3]).is_finite());
        assert!((grid.represented_light(id, Vec3::ONE, &mut rng) as usize) < 50);
    }
    assert!(grid.grid_lights(0).is_empty());
}
