//! What grid lights are, and what levels conserve.

use super::*;
use glam::DVec3;
use lightshed_sampling::luminance;
use lightshed_testkit::check_faults;

/// What a vertex should be by definition: sums over all lights with trilinear shares.
struct Expected {
    intensity: DVec3,
    center: DVec3,
    spread: DVec3,
    mean_normal: DVec3,
}

fn by_definition(lights: &[PointLight], vertex: DVec3, cell: f64) -> Option<Expected> {
    let (mut weight, mut intensity) = (0.0, DVec3::ZERO);
    let (mut first, mut second, mut normal) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for light in lights {
        let offset = (light.position.as_dvec3() - vertex) / cell;
        let share = (1.0 - offset.abs()).max(DVec3::ZERO);
        let share = share.x * share.y * share.z;
        let w = share * f64::from(luminance(light.intensity));
        weight += w;
        intensity += share * light.intensity.as_dvec3();
        first += w * light.position.as_dvec3();
        normal += w * light.normal.as_dvec3();
    }
    if weight == 0.0 {
        return None;
    }
    let center = first / weight;
    for light in lights {
        let offset = (light.position.as_dvec3() - vertex) / cell;
        let share = (1.0 - offset.abs()).max(DVec3::ZERO);
        let w = share.x * share.y * share.z * f64::from(luminance(light.intensity));
        second += w * (light.position.as_dvec3() - center).powf(2.0);
    }
    let spread = (second / weight).powf(0.5);
    let mean_normal = normal / weight;
    Some(Expected {
        intensity,
        center,
        spread,
        mean_normal,
    })
}

/// Every grid light of every level against sums by definition, made by either construction; and
/// that there is one for every vertex that should have light.
#[test]
fn grid_lights_are_what_the_definition_says() {
    for (lights, construction) in [
        (room(300, 1), Construction::Gather),
        (room(300, 1), Construction::Scatter),
        (cloud(250, 2), Construction::Gather),
    ] {
        let options = GridOptions {
            construction,
            ..options(1.0, Levels::Count(4))
        };
        let grid = LightingGrid::new(&lights, &options).unwrap();
        for level in 1..=4 {
            let cell = f64::from(grid.cell_size(level));
            let side = (1 << (4 - level)) + 1;
            let mut remaining: Vec<&GridLight> = grid.grid_lights(level).iter().collect();
            for place in 0..side * side * side {
                let vertex = [place % side, place / side % side, place / side / side].map(f64::from);
                let vertex = grid.origin + DVec3::from(vertex) * cell;
                let Some(expected) = by_definition(&lights, vertex, cell) else {
                    continue;
                };
                let near = |p: Vec3, q: DVec3| {
                    (p.as_dvec3() - q).abs().max_element() < 1e-5 * (1.0 + q.abs().max_element())
                };
                let found = remaining.iter().position(|light| {
                    near(light.position, expected.center)
                        && near(light.intensity, expected.intensity)
                        && (light.spread.as_dvec3() - expected.spread).abs().max_element() < 1e-5
                        && near(light.mean_normal, expected.mean_normal)
                });
                let found =
                    found.unwrap_or_else(|| panic!("level {level}: no light for the vertex at {vertex}"));
                remaining.swap_remove(found);
            }
            assert!(remaining.iter().all(|light| light.intensity == Vec3::ZERO));
        }
    }
}

/// Intensity of each level is that of the lights within 1e-5, in every channel, over nine levels of
/// 20,000 lights; so is the illumination centre. A level that lost one in a thousand of its lights
/// is noticed.
#[test]
fn levels_conserve_intensity_and_centre() {
    for lights in [room(20_000, 3), cloud(20_000, 4)] {
        let grid = LightingGrid::new(&lights, &options(1.0, Levels::Count(9))).unwrap();
        let total: DVec3 = lights.iter().map(|light| light.intensity.as_dvec3()).sum();
        let weighted = |i: Vec3, p: Vec3| f64::from(luminance(i)) * p.as_dvec3();
        let weight: f64 = lights
            .iter()
            .map(|light| f64::from(luminance(light.intensity)))
            .sum();
        let center: DVec3 = lights
            .iter()
            .map(|l| weighted(l.intensity, l.position))
            .sum::<DVec3>()
            / weight;
        check_faults(&[1000], |lost: Option<usize>| {
            for level in 1..=grid.level_count() {
                let lights = grid.grid_lights(level);
                let kept = || {
                    lights
                        .iter()
                        .skip(lost.map_or(0, |lost| lights.len().div_ceil(lost)))
                };
                let sum: DVec3 = kept().map(|light| light.intensity.as_dvec3()).sum();
                if ((sum - total) / total).abs().max_element() > 1e-5 {
                    return Err(format!("level {level}: {sum} for {total}"));
                }
                let middle = kept().map(|l| weighted(l.intensity, l.position)).sum::<DVec3>() / weight;
                if (middle - center).abs().max_element() > 1e-5 {
                    return Err(format!("level {level}: {middle} for {center}"));
                }
            }
            Ok(())
        })
        .unwrap();
    }
}

/// Gathering from level to level gives the lights that scattering all lights gives: positions
/// within 1e-5 of a cell, intensities within 1e-5, over eight levels of 30,000 lights.
#[test]
fn gathering_is_scattering() {
    let lights = room(30_000, 5);
    let gathered = LightingGrid::new(&lights, &options(1.0, Levels::Count(8))).unwrap();
    let scattering = GridOptions {
        construction: Construction::Scatter,
        ..options(1.0, Levels::Count(8))
    };
    let scattered = LightingGrid::new(&lights, &scattering).unwrap();
    for level in 1..=8 {
        let (a, b) = (gathered.grid_lights(level), scattered.grid_lights(level));
        assert_eq!(a.len(), b.len());
        let cell = gathered.cell_size(level);
        for (a, b) in a.iter().zip(b) {
            let tolerance = 1e-5 * (1.0 + b.intensity.max_element());
            assert!(
                (a.intensity - b.intensity).abs().max_element() < tolerance,
                "{a:?} {b:?}"
            );
            // A vertex with next to no light has a centre of next to no meaning.
            if b.intensity.max_element() > 1e-6 {
                assert!(
                    (a.position - b.position).abs().max_element() < 1e-5 * cell + 1e-6,
                    "{a:?} {b:?}"
                );
            }
        }
    }
}

/// Auto leaves S₁ fewer lights than half of S₀, and one level more would not; every light's
/// cell is in the finest grid.
#[test]
fn the_finest_level_has_fewer_than_half_as_many_lights() {
    for (lights, count) in [
        (room(1000, 6), 1000),
        (cloud(5000, 7), 5000),
        (room(40_000, 8), 40_000),
    ] {
        let grid = LightingGrid::new(&lights, &GridOptions::default()).unwrap();
        assert!(grid.grid_lights(1).len() < count / 2);
        let finer = options(1.0, Levels::Count(grid.level_count() + 1));
        let finer = LightingGrid::new(&lights, &finer).unwrap();
        assert!(finer.grid_lights(1).len() >= count / 2);
    }
}

/// Lights at one point, one light, lights of no intensity, on a line, and so bright that sums
/// overflow: finite and, where there is a truth, true.
#[test]
fn degenerate_lights_give_finite_light() {
    let at = Vec3::new(3.0, -2.0, 7.0);
    let point = at + Vec3::new(0.0, 2.0, 0.0);
    let down = -Vec3::Y;
    let one = PointLight::isotropic(at, Vec3::splat(8.0));
    for count in [1, 5, 3000] {
        let grid = LightingGrid::new(&vec![one; count], &GridOptions::default()).unwrap();
        let irradiance = grid.irradiance(point, down, 0.0);
        assert!(
            (irradiance / (2.0 * count as f32) - 1.0).abs().max_element() < 1e-4,
            "{irradiance}"
        );
        // At the lights themselves.
        assert!(grid.irradiance(at, down, 0.0).is_finite());
    }
    let off = PointLight {
        intensity: Vec3::ZERO,
        ..one
    };
    let grid = LightingGrid::new(&[off; 9], &GridOptions::default()).unwrap();
    assert_eq!(grid.irradiance(point, down, 0.0), Vec3::ZERO);
    let line: Vec<PointLight> = (0..500)
        .map(|i| PointLight::isotropic(Vec3::X * (i as f32 * 0.01), Vec3::splat(f32::MAX)))
        .collect();
    let grid = LightingGrid::new(&line, &GridOptions::default()).unwrap();
    for point in [
        Vec3::X,
        Vec3::Y * 1e-3,
        Vec3::splat(3e38),
        -Vec3::splat(1e-30),
        Vec3::splat(1e17),
    ] {
        assert!(grid.irradiance(point, down, 0.0).is_finite(), "at {point}");
        assert!(grid.irradiance(point, down, 0.1).is_finite(), "at {point}");
    }
    for level in 1..=grid.level_count() {
        assert!(
            grid.grid_lights(level)
                .iter()
                .all(|l| l.position.is_finite() && l.intensity.is_finite())
        );
    }
}

#[test]
fn impossible_input_is_refused() {
    let lights = room(10, 9);
    let refuse =
        |lights: &[PointLight], options: GridOptions| LightingGrid::new(lights, &options).unwrap_err();
    let sound = GridOptions::default();
    assert_eq!(refuse(&[], sound), GridError::Empty);
    assert_eq!(refuse(&lights, options(0.0, Levels::Auto)), GridError::Alpha(0.0));
    assert!(matches!(
        refuse(&lights, options(f32::NAN, Levels::Auto)),
        GridError::Alpha(_)
    ));
    for levels in [0, MAX_LEVELS + 1] {
        assert_eq!(
            refuse(&lights, options(1.0, Levels::Count(levels))),
            GridError::Levels(levels)
        );
    }
    let inverted = crate::Bounds::new(Vec3::ONE, Vec3::ZERO);
    assert_eq!(
        refuse(
            &lights,
            GridOptions {
                bounds: Some(inverted),
                ..sound
            }
        ),
        GridError::Bounds
    );
    let mut bad = lights.clone();
    (bad[7].intensity.y, bad[3].position.x) = (f32::NAN, f32::INFINITY);
    assert_eq!(refuse(&bad, sound), GridError::Position(3));
    let mut grid = LightingGrid::new(&lights, &sound).unwrap();
    assert!(grid.rebuild(&bad).is_err());
    assert_eq!(grid.lights(), lights);
}
