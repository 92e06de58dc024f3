//! Closed forms, and densities against quadrature.

use super::burn::{self, UNHINDERED};
use super::crowd::{Eight, End};
use super::flight::{Flight, fly, march, movement, place};
use super::share::UNBALANCED;
use super::*;
use crate::volume::volpath::Channels;
use lightshed_film::{Budget, RenderOptions, render_frames};
use lightshed_lanes::{LANES, LaneChoice};
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{Interval, regular_depth};
use lightshed_scene::{
    EmissionDescription, EmitterDescription, Medium, MediumDensity, PhaseDescription, Ray, SceneDescription,
    builtin,
};
use lightshed_testkit::{MeanTest, check_faults};

fn cloud([width, height]: [u32; 2], extinction: f32, g: f32) -> SceneDescription {
    let mut description = builtin::cloud();
    (description.settings.width, description.settings.height) = (width, height);
    description.media[0].extinction = Rgb::splat(extinction);
    description.media[0].phase = PhaseDescription::HenyeyGreenstein { g };
    description
}

/// In white light, a medium that absorbs as much as it emits is not seen: the radiance is 1
/// everywhere. Z-tests of whole frames, at 1e-6 each.
#[test]
fn white_light_stays_white() {
    check_faults(&["unbalanced"], |fault| {
        UNBALANCED.set(fault.is_some());
        for (albedo, g, roulette) in [(1.0, 0.0, 1000), (0.5, 0.6, 1000), (0.8, -0.3, 1)] {
            let mut description = cloud([13, 9], 8.0, g);
            description.settings.max_depth = None;
            description.settings.roulette_depth = roulette;
            description.emitters = vec![EmitterDescription::Constant { radiance: Rgb::ONE }];
            description.media[0].albedo = Rgb::splat(albedo);
            description.media[0].emission = Some(EmissionDescription {
                radiance: Rgb::ONE,
                grid: None,
            });
            let scene = Scene::new(&description).unwrap();
            let method = VolumePathReuse::new(&scene, scene.emitters_by_power());
            let mut mean = MeanTest::new();
            for seed in 0..150 {
                let mut image = [Rgb::ZERO; 13 * 9];
                // On this thread, for the fault.
                let first = VolumePathReuse::<EmittersByPower<'_>>::first_tile(seed)[1] as usize;
                let (head, rest) = image.split_at_mut(13 * first);
                let mut top = 0;
                for band in std::iter::once(head).chain(rest.chunks_mut(13 * TILE_SIDE as usize)) {
                    method.render_row(top, (0, seed), band, &AtomicBool::new(false));
                    top += (band.len() / 13) as u32;
                }
                assert!(image.iter().all(|value| value.is_finite()));
                let sum: f64 = image.iter().map(|value| f64::from(value.y)).sum();
                mean.push(sum / image.len() as f64);
            }
            println!("albedo {albedo}: {} by {}", mean.mean(), mean.variance());
            mean.test_against(1.0, 1e-6)
                .map_err(|error| format!("albedo {albedo}, g = {g}: {error}"))?;
        }
        Ok::<(), String>(())
    })
    .unwrap();
    UNBALANCED.set(false);
}

/// `T` between two places, exactly.
fn transmittance(medium: &Medium, ray: &Ray) -> f64 {
    let MediumDensity::Grid(field) = medium.density() else {
        panic!("a grid")
    };
    let interval = Interval {
        t0: 0.0,
        t1: ray.t_max,
    };
    let depth = regular_depth(field.grid(), &field.field_ray(ray), interval).depth;
    (-depth * f64::from(medium.extinction().x)).exp()
}

fn density(medium: &Medium, position: Vec3) -> f64 {
    let MediumDensity::Grid(field) = medium.density() else {
        panic!("a grid")
    };
    f64::from(
        medium.extinction().x
            * lightshed_scene::volume::DensityField::density(
                field.grid(),
                field.to_field().transform_point3(position),
            ),
    )
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    /// Null collisions count for nothing.
    Forgotten,
    /// All begin elsewhere in the grid.
    Elsewhere,
}

/// Flights from one place, weighted by their densities from another over those from their own, have
/// the means of flights from the other: of those that pass, its transmittance; of those that
/// collide, `∫ σ_t(x) T(x) dt` along the line of the first. Z-tests at 1e-6 each.
#[test]
fn densities_carry_flights_to_other_places() {
    let scene = Scene::new(&cloud([4, 4], 10.0, 0.0)).unwrap();
    let medium = &scene.media()[0];
    check_faults(&[Fault::Forgotten, Fault::Elsewhere], |fault| {
        for (own, other) in [
            (Vec3::new(-0.4, -0.2, 0.3), Vec3::new(-0.37, -0.21, 0.32)),
            (Vec3::new(0.1, -0.3, 0.6), Vec3::new(0.05, -0.22, 0.61)),
        ] {
            let direction = Vec3::new(0.5, 0.6, -0.3).normalize();
            let ray = Ray::new(own, direction);
            let MediumDensity::Grid(field) = medium.density() else {
                panic!("a grid")
            };
            // One place a lane, own ones and others in turns.
            let lanes: [Vec3; LANES] = std::array::from_fn(|lane| if lane % 2 == 0 { own } else { other });
            let rows = |place: &dyn Fn(Vec3) -> Vec3| {
                [0, 1, 2].map(|axis| lanes.map(|position| place(position)[axis]))
            };
            let densities = |lanes: LaneChoice, distance: Option<f32>, nulls: &[f32]| {
                let end = match distance {
                    Some(distance) => End::Place {
                        position: own + direction * distance,
                        place: place(medium, own + direction * distance),
                        unit: 1.0 / distance,
                    },
                    None => End::Away(movement(medium, direction)),
                };
                lanes.run(Eight {
                    field: Some(field),
                    k: medium.extinction().x,
                    position: rows(&|position| position),
                    place: rows(&|position| match fault {
                        Some(Fault::Elsewhere) => place(medium, position + Vec3::splat(0.01)),
                        _ => place(medium, position),
                    }),
                    end,
                    nulls: match fault {
                        Some(Fault::Forgotten) => &[],
                        _ => nulls,
                    },
                })
            };
            let (mut passed, mut collided) = (MeanTest::new(), MeanTest::new());
            let mut lost = 0;
            for sample in 0..60_000 {
                let mut rng = CounterRng::new(7, 1, sample);
                let Flight { distance, nulls } = fly(medium, &ray, f32::INFINITY, &mut rng);
                let Some(nulls) = nulls else {
                    lost += 1;
                    continue;
                };
                let values = densities(LaneChoice::best(), distance, nulls.places());
                assert_eq!(values, densities(LaneChoice::ARRAY, distance, nulls.places()));
                assert!(values.chunks(2).all(|pair| pair == &values[..2]), "{values:?}");
                // Per volume: as much less as the end is further away.
                let spread = |distance: f32| {
                    let end = own + direction * distance;
                    (end.distance(other) / distance).powi(2)
                };
                let ratio = f64::from(values[1] / values[0] * distance.map_or(1.0, spread));
                passed.push(if distance.is_none() { ratio } else { 0.0 });
                collided.push(if distance.is_some() { ratio } else { 0.0 });
            }
            assert!(lost < 10, "{lost} flights with too many null collisions");
            let expected = transmittance(medium, &Ray::new(other, direction));
            let steps = 4000;
            let step = 3.0 / f64::from(steps);
            let integral: f64 = (0..steps)
                .map(|i| {
                    let x = own + direction * ((f64::from(i) + 0.5) * step) as f32;
                    let between = x - other;
                    let length = between.length();
                    let ray = Ray::segment(other, between / length, length);
                    step * density(medium, x) * transmittance(medium, &ray)
                })
                .sum();
            println!(
                "{} of {expected}, {} of {integral}",
                passed.mean(),
                collided.mean()
            );
            let judge = |mean: MeanTest, expected| {
                let test = mean.test_against(expected, 1e-6);
                test.map(|_| ()).map_err(|error| error.to_string())
            };
            judge(passed, expected)?;
            judge(collided, integral)?;
        }
        Ok::<(), String>(())
    })
    .unwrap();
}

/// Of a flight through a coloured medium that emits the same everywhere, in each channel: the light
/// has the mean `(1 − α) L_e (1 − T)`, the weight of those that pass the mean `T`. Z-tests at 1e-6
/// each.
#[test]
fn flights_see_what_burns() {
    let mut description = cloud([4, 4], 10.0, 0.0);
    let (extinction, radiance) = (Rgb::new(4.0, 6.0, 9.0), Rgb::new(3.0, 2.0, 1.0));
    description.media[0].extinction = extinction;
    description.media[0].albedo = Rgb::splat(0.5);
    description.media[0].emission = Some(EmissionDescription { radiance, grid: None });
    let scene = Scene::new(&description).unwrap();
    let medium = &scene.media()[0];
    let direction = Vec3::new(0.5, 0.6, -0.3).normalize();
    let ray = Ray::new(Vec3::new(-0.4, -0.2, 0.3), direction);
    // Of the first channel.
    let depth = -transmittance(medium, &ray).ln() / f64::from(extinction.x);
    check_faults(&[()], |fault| {
        UNHINDERED.set(fault.is_some());
        let (mut light, mut passed) = ([const { MeanTest::new() }; 3], [const { MeanTest::new() }; 3]);
        for sample in 0..60_000 {
            let mut rng = CounterRng::new(5, 2, sample);
            let mut channels = Channels::new(rng.next_u32());
            let flight = burn::fly(medium, &ray, f32::INFINITY, &mut channels, &mut rng);
            for channel in 0..3 {
                light[channel].push(f64::from(flight.emitted[channel]));
                let passes = flight.distance.is_none();
                passed[channel].push(if passes {
                    f64::from(channels.weight()[channel])
                } else {
                    0.0
                });
            }
        }
        for channel in 0..3 {
            let expected = (-depth * f64::from(extinction[channel])).exp();
            let emitted = 0.5 * f64::from(radiance[channel]) * (1.0 - expected);
            for (mean, expected) in [(&light[channel], emitted), (&passed[channel], expected)] {
                println!("{} of {expected}", mean.mean());
                mean.test_against(expected, 1e-6)
                    .map_err(|error| error.to_string())?;
            }
        }
        Ok::<(), String>(())
    })
    .unwrap();
    UNHINDERED.set(false);
}

/// Transmittance towards emitters. A z-test at 1e-6.
#[test]
fn marching_has_the_mean_of_the_transmittance() {
    let scene = Scene::new(&cloud([4, 4], 10.0, 0.0)).unwrap();
    let medium = &scene.media()[0];
    let ray = Ray::new(Vec3::new(0.1, -0.3, 0.6), Vec3::new(0.5, 0.6, -0.3).normalize());
    let expected = transmittance(medium, &ray);
    check_faults(&[()], |fault| {
        let ray = match fault {
            Some(()) => Ray::new(ray.origin + ray.direction * 0.02, ray.direction),
            None => ray,
        };
        let mut mean = MeanTest::new();
        for sample in 0..40_000 {
            mean.push(f64::from(march(medium, &ray, &mut CounterRng::new(3, 0, sample))));
        }
        let test = mean.test_against(expected, 1e-6);
        test.map(|_| ()).map_err(|error| error.to_string())
    })
    .unwrap();
}

/// Tiles at the image's edges are smaller; the image is the same by any number of threads, and each
/// seed has tiles of its own.
#[test]
fn images_do_not_depend_on_threads() {
    let scene = Scene::new(&cloud([21, 14], 20.0, 0.3)).unwrap();
    let image = |threads: usize, seed: u64| {
        let options = RenderOptions {
            seed,
            threads,
            ..RenderOptions::new(21, 14, Budget::Samples(3))
        };
        let mut method = VolumePathReuse::new(&scene, scene.emitters_by_power()).with_points(PointSet::Sobol);
        let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false)).unwrap();
        outcome.film.mean_image()
    };
    for seed in 0..4 {
        assert_eq!(image(1, seed).pixels(), image(3, seed).pixels());
    }
    let first = |seed| VolumePathReuse::<EmittersByPower<'_>>::first_tile(seed);
    let mut tiles: Vec<_> = (0..200).map(first).collect();
    tiles.sort_unstable();
    tiles.dedup();
    assert_eq!(tiles.len(), 16);
}
