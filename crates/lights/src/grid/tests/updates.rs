//! Changed lights against a new construction, bit for bit.

use super::*;
use crate::Bounds;
use lightshed_testkit::check_faults;

/// All that queries read.
fn assert_same(a: &LightingGrid, b: &LightingGrid) {
    // No message of thousands of lights.
    assert!(a.lights == b.lights && a.pairs == b.pairs && a.sorted == b.sorted);
    assert_eq!(a.level_count, b.level_count);
    for level in 1..=a.level_count {
        let (x, y) = (&a.levels[level as usize - 1], &b.levels[level as usize - 1]);
        assert!(x.rows.x() == y.rows.x(), "vertices of level {level}");
        assert!(x.moments == y.moments, "sums of level {level}");
        assert!(x.lights == y.lights, "lights of level {level}");
    }
    for point in [Vec3::new(1.0, 1.0, 1.0), Vec3::new(3.9, 0.2, 4.0)] {
        assert_eq!(
            a.irradiance(point, Vec3::Y, 0.1),
            b.irradiance(point, Vec3::Y, 0.1)
        );
    }
}

fn fixed(levels: u32) -> GridOptions {
    GridOptions {
        bounds: Some(Bounds::new(Vec3::ZERO, Vec3::new(4.0, 3.0, 5.0))),
        ..options(1.0, Levels::Count(levels))
    }
}

/// Lights that dim, lights that move about in their cells, lights that go elsewhere, several at
/// once and the same twice: each update gives what a new construction gives. One that forgets a
/// light, or a level, is noticed.
#[test]
fn an_update_is_a_rebuild_bit_for_bit() {
    let steps: [(&str, usize); 7] = [
        ("dim", 1),
        ("dim", 40),
        ("dim", 200),
        ("shake", 30),
        ("move", 1),
        ("move", 40),
        ("move", 400),
    ];
    let faults = ["forgets a light", "forgets a sum"];
    check_faults(&faults, |fault| {
        let mut lights = room(3000, 41);
        let mut grid = LightingGrid::new(&lights, &fixed(6)).unwrap();
        for (step, &(kind, count)) in steps.iter().enumerate() {
            let mut changes = Vec::new();
            for i in 0..count {
                let mut rng = CounterRng::new(42, i as u32, step as u32);
                // A few lights come up twice.
                let index = rng.next_u32() as usize % lights.len();
                let old = lights[index];
                let light = match kind {
                    "dim" => PointLight {
                        intensity: old.intensity * rng.next_f32(),
                        ..old
                    },
                    "shake" => PointLight {
                        position: old.position * (1.0 - 1e-4 * rng.next_f32()),
                        ..old
                    },
                    _ => room_light(rng),
                };
                lights[index] = light;
                changes.push(GridChange {
                    index: index as u32,
                    light,
                });
            }
            if fault == Some("forgets a light") && count > 1 {
                changes.pop();
            }
            let report = grid.update(&changes).unwrap();
            assert!(!report.rebuilt && report.refreshed > 0);
            assert_eq!(report.moved > 0, kind == "move", "{kind} {report:?}");
            if fault == Some("forgets a sum") {
                let place = grid.levels[2].moments.len() / 2;
                grid.levels[2].moments[place] = Default::default();
            }
            assert_same(&grid, &LightingGrid::new(&lights, &fixed(6)).unwrap());
        }
        Ok::<_, ()>(())
    })
    .unwrap();
}

/// One light of many costs the vertices around it, a few dozen a level, whatever the number of
/// lights.
#[test]
fn a_small_update_does_little() {
    let lights = room(50_000, 43);
    let mut grid = LightingGrid::new(&lights, &fixed(8)).unwrap();
    let vertices: usize = (1..=8).map(|level| grid.grid_lights(level).len()).sum();
    let light = PointLight {
        intensity: Vec3::ONE,
        ..lights[77]
    };
    let report = grid.update(&[GridChange { index: 77, light }]).unwrap();
    assert_eq!(report.moved, 0);
    assert!(
        report.refreshed <= 8 * 8 && vertices > 10_000,
        "{report:?} of {vertices}"
    );
}

#[test]
fn a_light_that_leaves_the_box_moves_the_box() {
    let mut lights = room(500, 44);
    let options = options(1.0, Levels::Auto);
    let mut grid = LightingGrid::new(&lights, &options).unwrap();
    lights[3].position.x = 9.0;
    let report = grid
        .update(&[GridChange {
            index: 3,
            light: lights[3],
        }])
        .unwrap();
    assert!(report.rebuilt);
    assert_same(&grid, &LightingGrid::new(&lights, &options).unwrap());
}

#[test]
fn impossible_changes_change_nothing() {
    let lights = room(20, 45);
    let mut grid = LightingGrid::new(&lights, &GridOptions::default()).unwrap();
    let bad = PointLight {
        position: Vec3::NAN,
        ..lights[0]
    };
    let good = GridChange {
        index: 0,
        light: PointLight {
            intensity: Vec3::ZERO,
            ..lights[0]
        },
    };
    let error = grid
        .update(&[good, GridChange { index: 1, light: bad }])
        .unwrap_err();
    assert_eq!(error, GridError::Position(1));
    let error = grid
        .update(&[
            good,
            GridChange {
                index: 20,
                light: lights[0],
            },
        ])
        .unwrap_err();
    assert_eq!(error, GridError::NoSuchLight(20));
    assert_eq!(grid.lights(), lights);
}

/// The same bits from one thread and from several.
#[cfg(feature = "parallel")]
#[test]
fn threads_do_not_change_the_grid() {
    let lights = room(60_000, 46);
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| LightingGrid::new(&lights, &GridOptions::default()).unwrap())
    };
    let alone = build(1);
    for threads in [2, 5] {
        assert_same(&alone, &build(threads));
    }
}
