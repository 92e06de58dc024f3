//! `lightshed-lights`: lighting grids.

use crate::lights::PART;
use crate::worst::{Kind, Row, Worst, direction, log_uniform, rng};
use lightshed::lights::glam::{DVec3, Vec3};
use lightshed::lights::{GridLight, GridOptions, GridQuery, Levels, LightId, LightingGrid, PointLight};

fn worst(function: &'static str, inputs: &'static str, kind: Kind, fill: impl FnOnce(&mut Worst)) -> Row {
    Worst::row(PART, function, inputs, kind, fill)
}

/// Lights over 6 decades of intensity in a box of this size, some at one place, some off, some with
/// a normal.
fn lights(salt: u32, count: u32, scale: f32) -> Vec<PointLight> {
    let mut rng = rng(salt);
    (0..count)
        .map(|i| {
            let position = if i % 7 == 0 {
                Vec3::splat(0.3 * scale)
            } else {
                direction(&mut rng) * scale
            };
            let power = if i % 11 == 0 {
                0.0
            } else {
                log_uniform(&mut rng, 1e-3, 1e3)
            };
            let intensity = Vec3::new(1.0, 0.5, 0.25) * power;
            if i % 2 == 0 {
                PointLight::isotropic(position, intensity)
            } else {
                PointLight::lambertian(position, direction(&mut rng), intensity)
            }
        })
        .collect()
}

fn grid(lights: &[PointLight], levels: u32) -> LightingGrid {
    let options = GridOptions {
        levels: Levels::Count(levels),
        ..GridOptions::default()
    };
    LightingGrid::new(lights, &options).expect("these lights are valid")
}

const SCALES: [f32; 4] = [1e-10, 1.0, 1e3, 1e10];

pub fn rows() -> Vec<Row> {
    vec![
        worst(
            "BlendingFunctions::weight",
            "boxes of 10⁻¹⁰ to 10¹⁰, 1 to 9 levels, distances over 20 decades: sum over levels; `BlendingFunctions::radius`, `BlendingFunctions::reach`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(210);
                for scale in SCALES {
                    for levels in [1, 2, 5, 9] {
                        let grid = grid(&lights(211, 50, scale), levels);
                        for first in [0, 1] {
                            let blending = grid.blending(first);
                            for _ in 0..2_000 {
                                let distance = scale * log_uniform(&mut rng, 1e-10, 1e10);
                                let all = blending.first_level()..=blending.last_level();
                                let weights = all.clone().map(|level| blending.weight(level, distance));
                                w.add(weights.map(f64::from).sum(), 1.0);
                                for level in all {
                                    let ratio = blending.radius(level) / blending.radius(0);
                                    w.add(f64::from(ratio) / 2f64.powi(level as i32), 1.0);
                                    w.exactly(
                                        distance < blending.reach(level)
                                            || blending.weight(level, distance) == 0.0,
                                    );
                                }
                            }
                        }
                    }
                }
            },
        ),
        worst(
            "GridLight::emission",
            "lights of grids, random directions: against the quadratic form, over the greatest; `PointLight::emission`",
            Kind::Absolute,
            |w| {
                let mut rng = rng(212);
                let lights = lights(213, 300, 1.0);
                let grid = grid(&lights, 5);
                for light in (1..=5).flat_map(|level| grid.grid_lights(level)) {
                    for _ in 0..20 {
                        let omega = direction(&mut rng);
                        w.add(
                            f64::from(light.emission(omega)),
                            emission(light, omega.as_dvec3()),
                        );
                    }
                }
                for light in &lights {
                    let omega = direction(&mut rng);
                    let cos = light.normal.as_dvec3().dot(omega.as_dvec3()).max(0.0);
                    w.add(
                        f64::from(light.emission(omega)),
                        if light.normal == Vec3::ZERO { 1.0 } else { cos },
                    );
                }
            },
        ),
        worst(
            "GridLight::blending_distance_squared",
            "lights of grids, distances over 12 decades",
            Kind::Relative,
            |w| {
                let mut rng = rng(214);
                let grid = grid(&lights(215, 300, 1.0), 5);
                for light in (1..=5).flat_map(|level| grid.grid_lights(level)) {
                    for _ in 0..20 {
                        let way = direction(&mut rng) * log_uniform(&mut rng, 1e-6, 1e6);
                        let (d, s) = (way.as_dvec3(), light.spread.as_dvec3());
                        let (d2, v) = (d.length_squared(), s * s);
                        let correction = v.element_sum() - 4.0 * v.dot(d * d / d2);
                        let truth = d2 + correction.clamp(-0.2 * d2, 0.2 * d2);
                        w.add(f64::from(light.blending_distance_squared(way)), truth);
                    }
                }
            },
        ),
        worst(
            "LightingGrid::grid_lights",
            "300 lights in boxes of 10⁻¹⁰ to 10¹⁰, 1 to 9 levels: intensity of every level; one light: its place over the box",
            Kind::Relative,
            |w| {
                for scale in SCALES {
                    let lights = lights(216, 300, scale);
                    let truth: f64 = lights.iter().map(|light| f64::from(light.intensity.x)).sum();
                    for levels in [1, 2, 5, 9] {
                        let grid = grid(&lights, levels);
                        for level in 1..=levels {
                            let sum: f64 = grid
                                .grid_lights(level)
                                .iter()
                                .map(|l| f64::from(l.intensity.x))
                                .sum();
                            w.add(sum, truth);
                        }
                    }
                    let place = Vec3::new(0.1, -0.7, 0.4) * scale;
                    let one = grid(&[PointLight::isotropic(place, Vec3::ONE)], 3);
                    for level in 1..=3 {
                        // One without light is where its vertex is.
                        for light in one
                            .grid_lights(level)
                            .iter()
                            .filter(|light| light.intensity.x > 0.0)
                        {
                            w.add(1.0 + f64::from((light.position - place).length() / scale), 1.0);
                        }
                    }
                }
            },
        ),
        worst(
            "LightingGrid::irradiance",
            "one light, distances over 12 decades, least distance 0: I cos θ/d²; `LightingGrid::visit`, `LightingGrid::gather`",
            Kind::Relative,
            |w| {
                let mut rng = rng(217);
                for scale in SCALES {
                    let place = direction(&mut rng) * scale;
                    let light = PointLight::isotropic(place, Vec3::new(3.0, 2.0, 1.0));
                    let grid = grid(&[light], 4);
                    for _ in 0..1_000 {
                        let point = place + direction(&mut rng) * scale * log_uniform(&mut rng, 1e-3, 1e3);
                        let d = place.as_dvec3() - point.as_dvec3();
                        let normal = direction(&mut rng);
                        let cos = normal.as_dvec3().dot(d.normalize());
                        let found = grid.irradiance(point, normal, 0.0);
                        if cos > 0.1 {
                            w.add(f64::from(found.x), 3.0 * cos / d.length_squared());
                        } else if cos < 0.0 {
                            w.exactly(found.x <= 1e-6 * (3.0 / d.length_squared()) as f32);
                        }
                        let query = GridQuery::default();
                        let mut sum = 0.0;
                        grid.visit(point, &query, |influence| sum += f64::from(influence.intensity.y));
                        w.add(sum, 2.0);
                        let gathered =
                            grid.gather(point, &query, 4, &mut rng, |influence| influence.intensity);
                        w.add(f64::from(gathered.unshadowed.y), 2.0);
                        w.exactly(gathered.samples().count() == 4);
                    }
                }
            },
        ),
        worst(
            "LightingGrid::shadow_target",
            "lights of grids: out of the box around the lights, over its extent; finite for lights that do not exist",
            Kind::Absolute,
            |w| {
                let mut rng = rng(218);
                for scale in SCALES {
                    let grid = grid(&lights(219, 300, scale), 5);
                    for level in 0..=5 {
                        for _ in 0..500 {
                            let [a, b] = rng.next_2d();
                            let id = LightId {
                                level,
                                index: rng.next_u32() % 400,
                            };
                            let found = grid.shadow_target(id, [a, b, rng.next_f32()]);
                            w.exactly(found.is_finite() && found.abs().max_element() <= 4.0 * scale);
                        }
                    }
                    w.exactly(
                        grid.irradiance(Vec3::splat(0.3 * scale), Vec3::Z, 0.0)
                            .is_finite(),
                    );
                }
            },
        ),
    ]
}

fn emission(light: &GridLight, d: DVec3) -> f64 {
    let [xx, yy, zz, xy, yz, zx] = light.normal_moment.map(f64::from);
    let form = xx * d.x * d.x
        + yy * d.y * d.y
        + zz * d.z * d.z
        + 2.0 * (xy * d.x * d.y + yz * d.y * d.z + zx * d.z * d.x);
    let mean = light.mean_normal.as_dvec3().dot(d);
    f64::from(light.isotropic) + 0.5 * (mean + mean.abs().max(form.max(0.0).sqrt()))
}
