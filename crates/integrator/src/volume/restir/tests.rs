//! The parts of volumetric ReSTIR: coarse densities, camera rays as proposals, the shift.

#[path = "../../../tests/it/mirrors.rs"]
mod mirrors;

use super::*;
use crate::volume::restir::coarse::CoarseMedium;
use crate::volume::restir::pixel::First;
use lightshed_resampling::{Domain, ShiftMapping, round_trip};
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{DensityField, Interval};
use lightshed_scene::{EmitterEndpoint, MediumDensity, PhaseDescription, Ray, builtin};
use lightshed_shift::EdgeEnd;
use lightshed_testkit::{MeanTest, check_faults};

fn small(name: &str, [width, height]: [u32; 2]) -> Scene {
    let mut description = builtin::by_name(name).unwrap();
    (description.settings.width, description.settings.height) = (width, height);
    Scene::new(&description).unwrap()
}

fn beside_mirrors() -> Scene {
    let mut description = mirrors::smoke_and_mirrors();
    (description.settings.width, description.settings.height) = (24, 24);
    Scene::new(&description).unwrap()
}

fn method(scene: &Scene, scatterings: u32) -> RestirVolume<'_> {
    RestirVolume::new(scene, RestirVolumeOptions::new(scatterings), CameraMotion::STILL).unwrap()
}

/// Looks through the middle of a pixel.
fn look(method: &RestirVolume<'_>, x: f32, y: f32) -> VolumePixel {
    let scene = method.volumes(0).scene;
    let mut pixel = VolumePixel::default();
    (pixel.corner, pixel.film) = (Vec2::new(x, y), Vec2::splat(0.5));
    let ray = scene.camera().ray(pixel.corner + pixel.film, pixel.lens);
    pixel.look(method.volumes(0), ray, scene.camera_medium(scene.camera()), 1);
    pixel
}

fn sequence(rng: &mut CounterRng) -> Sequence {
    Sequence::new(core::array::from_fn(|_| rng.next_u64()), 0)
}

/// Of 64 points between 5 and 11 lie in each eighth of each axis, whatever the shift; as many
/// independent ones would leave that in most cases.
#[test]
fn walks_start_evenly() {
    check_faults(&[()], |fault: Option<()>| {
        let mut rng = CounterRng::new(8, 0, 0);
        for start in 0..20 {
            let shift = core::array::from_fn(|_| rng.next_u64());
            let mut points = Sequence::new(shift, start * 64);
            let mut counts = [[0; 8]; 3];
            for _ in 0..64 {
                let point = match fault {
                    None => points.next(),
                    Some(()) => core::array::from_fn(|_| rng.next_u64()),
                };
                for (counts, place) in counts.iter_mut().zip(point) {
                    counts[(place >> 61) as usize] += 1;
                }
            }
            if counts.iter().flatten().any(|count| !(5..=11).contains(count)) {
                return Err(format!("{counts:?}"));
            }
        }
        Ok(())
    })
    .unwrap();
}

/// Wherever there is a density there is a coarse one, at every level, along rays in all directions.
#[test]
fn coarse_densities_are_positive_where_densities_are() {
    let scene = small("cloud", [8, 8]);
    let medium = &scene.media()[0];
    let MediumDensity::Grid(field) = medium.density() else {
        panic!("a grid");
    };
    let coarse = CoarseMedium::new(medium, 4);
    let mut rng = CounterRng::new(3, 0, 0);
    let mut uniform = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
    let mut found = [0; 2];
    for _ in 0..400 {
        let origin = (uniform() - Vec3::splat(0.5)) * Vec3::new(2.0, 1.4, 2.0);
        let ray = Ray::new(origin, (uniform() - Vec3::splat(0.5)).normalize());
        let interval = Interval { t0: 0.0, t1: 0.9 };
        for level in 0..=4 {
            let mut bins = Vec::new();
            let range = coarse.along(medium, &ray, interval, level, &mut bins);
            for step in 0..64 {
                let t = 0.9 * (step as f32 + 0.5) / 64.0;
                let place = field.to_field().transform_point3(ray.origin + ray.direction * t);
                let bounds = field.grid().bounds();
                let inside = place.cmpge(bounds.min()).all() && place.cmple(bounds.max()).all();
                if !(inside && field.grid().density(place) > 0.0) {
                    continue;
                }
                let Interval { t0, t1 } = range.expect("some density along the ray");
                assert!((t0..=t1).contains(&t), "level {level} at {t}");
                let bin = (((t - t0) / (t1 - t0) * bins.len() as f32) as usize).min(bins.len() - 1);
                let before = bin.checked_sub(1).map_or(0.0, |bin| bins[bin]);
                assert!(bins[bin] > before, "level {level} at {t}");
            }
        }
        for level in 1..=4 {
            coarse.stretches(medium, &ray, interval, [4 - level, level], |stretch| {
                for step in 0..8 {
                    let t = stretch.t0 + (stretch.t1 - stretch.t0) * (f64::from(step) + 0.5) / 8.0;
                    let place = field
                        .to_field()
                        .transform_point3(ray.origin + ray.direction * t as f32);
                    let density = field.grid().density(place);
                    found[usize::from(density > 0.0)] += 1;
                    assert!(density == 0.0 || stretch.density > 0.0, "level {level} at {t}");
                }
                true
            });
        }
    }
    assert!(found.iter().all(|&count| count > 10_000), "{found:?}");
}

/// Collisions have the density that they say: `1 − e^{−τ(z)}`, of the depth that the pixel
/// tells for their distance, is uniform up to the chance of no collision, and the density is its
/// derivative. Z-tests at 1e-6 of mean and chance.
#[test]
fn flights_along_camera_rays_have_their_density() {
    let scene = small("smoke-in-cornell", [32, 32]);
    let method = method(&scene, 1);
    check_faults(&[1.04], |fault: Option<f64>| -> Result<(), String> {
        for (x, y) in [(15.0, 8.0), (20.0, 12.0), (12.0, 5.0)] {
            let pixel = look(&method, x, y);
            // The smoke is grey.
            let reached = |distance: f32| {
                -pixel
                    .depth_at(distance)
                    .map_or(f64::NAN, |(_, depth)| (-depth.x).exp_m1())
            };
            let whole = -(-pixel.depth_of_surface().x).exp_m1();
            let (mut place, mut collides, mut rng) =
                (MeanTest::new(), MeanTest::new(), CounterRng::new(5, 0, 0));
            let (mut sharp, mut agreeing) = (0, 0);
            for _ in 0..20_000 {
                let flight = pixel.fly(f64_from_u64(rng.next_u64()));
                collides.push(f64::from(u8::from(matches!(flight, First::Medium { .. }))));
                match flight {
                    First::Medium { distance, pdf } => {
                        place.push(reached(distance));
                        // NaN where the medium ends.
                        let step = 2e-3;
                        let slope =
                            (reached(distance + step) - reached(distance - step)) / f64::from(2.0 * step);
                        sharp += 1;
                        agreeing += u32::from((pdf * fault.unwrap_or(1.0) / slope - 1.0).abs() < 0.02);
                    }
                    First::Surface { pdf } => assert!((pdf - (1.0 - whole)).abs() < 1e-5, "{pdf}"),
                    First::Nowhere => panic!("the room is closed"),
                }
            }
            let judged = |mean: &MeanTest, expected: f64| {
                mean.test_against(expected, 1e-6)
                    .map_err(|error| error.to_string())
            };
            judged(&place, 0.5 * whole)?;
            judged(&collides, whole)?;
            // All but those near the ends of stretches.
            if f64::from(agreeing) < 0.7 * f64::from(sharp) {
                return Err(format!("{agreeing} of {sharp} densities are the slope"));
            }
        }
        Ok(())
    })
    .unwrap();
}

/// Candidates shifted into other pixels and back are what they were, and shifted into their own
/// pixel have the target that they carry.
#[test]
fn paths_come_back_from_other_pixels() {
    for name in ["cloud", "smoke-in-cornell", "fire", "mirrors"] {
        let scene = match name {
            "mirrors" => beside_mirrors(),
            _ => small(name, [24, 24]),
        };
        let method = method(&scene, 4);
        let (evaluation, shift) = (method.evaluation(0), method.path_reuse(0));
        let mut defined = 0;
        for index in 0..200u32 {
            let (x, y) = ((index % 20) as f32 + 2.0, (index / 20) as f32 + 6.0);
            let (own, other) = (look(&method, x, y), look(&method, x + 1.3, y - 0.6));
            let mut rng = CounterRng::new(9, index, 0);
            let reservoir = evaluation.resample_walks(&own, 4, 4, 2, sequence(&mut rng), &mut rng);
            let Some(path) = reservoir.sample() else { continue };
            let path = evaluation.settled(&own, path, false);
            let itself = shift.shift(&path, &own, &own).unwrap();
            assert_eq!(itself.target, own.target(&path));
            let same = |a: &VolumePath, b: &VolumePath| a.target.to_bits() == b.target.to_bits();
            defined += u32::from(round_trip(&shift, &path, &own, &other, same, 1e-12).unwrap());
        }
        assert!(defined > 30, "{name}: {defined}");
    }
}

/// `|∂(ω′, z′)/∂(ω, z)|` of connected edges, by finite differences in `f64` of where they
/// lead: 1e-3.
#[test]
fn connections_have_their_jacobian() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Inverse,
        Omitted,
        Linear,
    }
    let scene = small("cloud", [24, 24]);
    let mut options = RestirVolumeOptions::new(4);
    options.connection_pixels = 2.0;
    let method = RestirVolume::new(&scene, options, CameraMotion::STILL).unwrap();
    let (evaluation, shift) = (method.evaluation(0), method.path_reuse(0));
    check_faults(
        &[Fault::Inverse, Fault::Omitted, Fault::Linear],
        |fault: Option<Fault>| {
            let mut compared = 0;
            for index in 0..1500 {
                let (own, other) = (look(&method, 9.0, 11.0), look(&method, 10.0, 12.0));
                let mut rng = CounterRng::new(4, index, 0);
                let reservoir = evaluation.resample_walks(&own, 4, 4, 2, sequence(&mut rng), &mut rng);
                let Some(path) = reservoir.sample() else { continue };
                let path = evaluation.settled(&own, path, false);
                let Ok(shifted) = shift.shift(&path, &own, &other) else {
                    continue;
                };
                if path.connected_vertex() != Some(1) || !(shifted.target > 0.0) {
                    continue;
                }
                let first = path.first_distance().unwrap();
                let [from, to] = [&own, &other].map(|pixel| {
                    let ray = scene.camera().ray(pixel.corner + path.seen.film, path.seen.lens);
                    (ray.origin + ray.direction * first).as_dvec3()
                });
                // Steps along two tangents and the length, and what they are of the image's
                // direction and length.
                let place = path.connection.place.as_dvec3();
                let (edge, image) = (place - from, place - to);
                let coordinates = |at: DVec3| {
                    let (normal, length) = (image.normalize(), (at - to).length());
                    let (u, v) = normal.any_orthonormal_pair();
                    let direction = (at - to) / length;
                    DVec3::new(direction.dot(u), direction.dot(v), length)
                };
                let step = 1e-4;
                let (u, v) = edge.normalize().any_orthonormal_pair();
                let moves = [u * edge.length(), v * edge.length(), edge.normalize()];
                let [a, b, c] = moves.map(|by| {
                    (coordinates(place + by * step) - coordinates(place - by * step)) / (2.0 * step)
                });
                let numeric = a.dot(b.cross(c)).abs();
                let jacobian = shifted.jacobian.value();
                let said = match fault {
                    None => jacobian,
                    Some(Fault::Inverse) => jacobian.recip(),
                    Some(Fault::Omitted) => 1.0,
                    Some(Fault::Linear) => jacobian.sqrt(),
                };
                compared += 1;
                if (said / numeric - 1.0).abs() > 1e-3 {
                    return Err(format!("{said} for {numeric}"));
                }
            }
            assert!(compared > 20, "{compared}");
            Ok(())
        },
    )
    .unwrap();
}

/// What a pixel shows of the walks of one frame without reuse, shaded as frames are.
struct Shown {
    /// Scattered light.
    light: f64,
    /// Its path ends where a walk left the scene or an emitter sample did.
    of_environment: bool,
    /// The same by way of a mirror or glass.
    by_lobe: bool,
    /// Its last vertex is on an emitter.
    of_emitter: bool,
    /// What was not scattered.
    unscattered: f64,
}

/// One channel of RIS over walks, many times, and of path tracing through the same pixel.
fn walked_and_traced(
    method: &RestirVolume<'_>,
    pixel: &VolumePixel,
    scatterings: u32,
) -> (Vec<Shown>, MeanTest) {
    let scene = method.volumes(0).scene;
    let tracer = crate::VolumePathTracer::new(scene, scene.emitters_by_power())
        .with_depths(Some(scatterings + 1), u32::MAX);
    let mut traced = MeanTest::new();
    for sample in 0..60_000 {
        let mut rng = CounterRng::new(2, 0, sample);
        traced.push(f64::from(tracer.radiance(pixel.ray, pixel.medium, &mut rng).y));
    }
    let evaluation = method.evaluation(0);
    let walked = |sample| {
        let mut rng = CounterRng::new(1, 0, sample);
        let start = sequence(&mut rng);
        let reservoir = evaluation.resample_walks(pixel, 4, scatterings, 2, start, &mut rng);
        let mut shown = Shown {
            light: 0.0,
            of_environment: false,
            by_lobe: false,
            of_emitter: false,
            unscattered: 0.0,
        };
        if let Some((path, weight)) = reservoir.weighted_sample() {
            let on_surface = path.end(path.vertices() - 1) == EdgeEnd::Surface;
            shown.light = evaluation.estimate(pixel, path, &mut rng).y * weight.value();
            shown.of_environment = matches!(path.endpoint, Some(EmitterEndpoint::Environment { .. }));
            shown.by_lobe = path.lobe_to(path.vertices()).is_some();
            shown.of_emitter = path.endpoint.is_none() && on_surface;
        }
        shown.unscattered = f64::from(unscattered(method.volumes(0), pixel, &mut rng).y);
        shown
    };
    ((0..20_000).map(walked).collect(), traced)
}

/// Whether both have the same mean when scattered light counts by `factor`. A z-test at 1e-6.
fn agree(walked: &[Shown], traced: &MeanTest, factor: impl Fn(&Shown) -> f64) -> Result<(), String> {
    let mut mean = MeanTest::new();
    for shown in walked {
        mean.push(shown.light * factor(shown) + shown.unscattered);
    }
    mean.test_equal(traced, 1e-6)
        .map(|_| ())
        .map_err(|error| error.to_string())
}

/// RIS over the walks of one frame against path tracing: for each K.
#[test]
fn walks_estimate_what_path_tracing_does() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Brighter,
        /// Walks that leave and emitter samples count the environment in full, both.
        EscapesTwice,
    }
    for (name, asymmetry, place) in [
        ("cloud", None, [12.0, 12.0]),
        ("cloud", Some(0.8), [9.0, 10.0]),
        ("smoke-in-cornell", None, [12.0, 9.0]),
        ("fire", None, [11.0, 14.0]),
    ] {
        let mut description = builtin::by_name(name).unwrap();
        (description.settings.width, description.settings.height) = (24, 24);
        if let Some(g) = asymmetry {
            description.media[0].phase = PhaseDescription::HenyeyGreenstein { g };
        }
        let scene = Scene::new(&description).unwrap();
        let faults: &[Fault] = if name == "cloud" {
            &[Fault::Brighter, Fault::EscapesTwice]
        } else {
            &[Fault::Brighter]
        };
        for scatterings in [1, 2, 5] {
            let method = method(&scene, scatterings);
            let pixel = look(&method, place[0], place[1]);
            let (walked, traced) = walked_and_traced(&method, &pixel, scatterings);
            check_faults(faults, |fault: Option<Fault>| {
                agree(&walked, &traced, |shown| match fault {
                    Some(Fault::Brighter) => 1.3,
                    Some(Fault::EscapesTwice) if shown.of_environment => 2.0,
                    _ => 1.0,
                })
                .map_err(|error| format!("{name}, K = {scatterings}: {error}"))
            })
            .unwrap();
        }
    }
}

/// The same where a mirror and a glass sphere are in view, alone and through the smoke.
#[test]
fn walks_by_mirrors_and_glass_estimate_what_path_tracing_does() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Emitters that a mirror or glass shows are not looked for, since emitter samples find
        /// them elsewhere.
        ShownLeftOut,
        /// They are taken to share with emitter samples, half each.
        ShownShared,
        /// The environment behind glass counts twice.
        EscapesTwice,
    }
    let scene = beside_mirrors();
    // Which of the faults this pixel shows.
    let pixels: [([f32; 2], &[Fault]); 2] = [
        ([18.0, 10.0], &[Fault::ShownLeftOut, Fault::ShownShared]),
        ([16.0, 12.0], &[Fault::EscapesTwice]),
    ];
    for (place, faults) in pixels {
        let scatterings = 4;
        let method = method(&scene, scatterings);
        let pixel = look(&method, place[0], place[1]);
        let (walked, traced) = walked_and_traced(&method, &pixel, scatterings);
        check_faults(faults, |fault: Option<Fault>| {
            agree(&walked, &traced, |shown| match fault {
                Some(Fault::ShownLeftOut) if shown.of_emitter => 0.0,
                Some(Fault::ShownShared) if shown.of_emitter => 0.5,
                Some(Fault::EscapesTwice) if shown.by_lobe => 2.0,
                _ => 1.0,
            })
            .map_err(|error| format!("{place:?}: {error}"))
        })
        .unwrap();
    }
}
