//! Closed forms.
//!
//! Means of independent samples against what they must be, with fixed seeds. Each test is a z-test
//! that a sound estimator fails with probability 1e-6, a planted fault must fail it.

use super::*;
use crate::path::camera_ray;
use lightshed_scene::glam::Affine3A;
use lightshed_scene::{
    DensityDescription, EmissionDescription, EmitterDescription, Geometry, GridDescription, GridFilter,
    MediumBoundary, MediumDescription, PhaseDescription, SceneDescription, ShapeDescription, SphereGeometry,
    builtin,
};
use lightshed_testkit::{MeanTest, check_faults};

/// A ball of radius 1 of a medium, around the origin, in white light; the camera looks at its
/// middle along −z from a distance.
fn ball(extinction: Rgb, albedo: Rgb) -> SceneDescription {
    let mut scene = SceneDescription {
        shapes: vec![ShapeDescription {
            name: "boundary".to_owned(),
            geometry: Geometry::Sphere(SphereGeometry {
                center: Vec3::ZERO,
                radius: 1.0,
                flip_normals: false,
            }),
            material: 0,
            emission: None,
        }],
        materials: vec![Material::Null],
        emitters: vec![EmitterDescription::Constant { radiance: Rgb::ONE }],
        media: vec![MediumDescription {
            name: "ball".to_owned(),
            density: DensityDescription::Homogeneous,
            extinction,
            albedo,
            albedo_grids: Vec::new(),
            phase: PhaseDescription::HenyeyGreenstein { g: 0.6 },
            emission: None,
        }],
        boundaries: vec![MediumBoundary {
            shape: 0,
            interior: Some(0),
            exterior: None,
        }],
        ..SceneDescription::default()
    };
    scene.settings.roulette_depth = u32::MAX;
    scene
}

/// The density of a grid whose optical depth along z through the middle, over the ball's diameter,
/// is 2: linear in z, 0.5 … 1.5.
fn ramp() -> DensityDescription {
    DensityDescription::Grid(GridDescription {
        resolution: [1, 1, 40],
        values: (0..40).map(|z| 0.5 + (z as f32 + 0.5) / 40.0).collect(),
        filter: GridFilter::Trilinear,
        to_world: Affine3A::from_translation(Vec3::NEG_ONE) * Affine3A::from_scale(Vec3::splat(2.0)),
    })
}

/// Means of the radiance along −z through the middle, started in `medium` at `z`.
fn means(scene: &SceneDescription, from: f32, samples: u32) -> [MeanTest; 3] {
    means_by(scene, from, samples, VolumeTracking::Delta)
}

fn means_by(scene: &SceneDescription, from: f32, samples: u32, tracking: VolumeTracking) -> [MeanTest; 3] {
    let scene = Scene::new(scene).unwrap();
    let tracer = VolumePathTracer::new(&scene, scene.emitters_by_power()).with_tracking(tracking);
    let origin = Vec3::new(0.0, 0.0, from);
    let medium = scene.medium_around(origin);
    let mut means = [MeanTest::new(), MeanTest::new(), MeanTest::new()];
    for sample in 0..samples {
        let mut rng = CounterRng::new(11, 0, sample);
        let value = tracer.radiance(Ray::new(origin, Vec3::NEG_Z), medium, &mut rng);
        assert!(value.is_finite() && value.min_element() >= 0.0, "{value}");
        for (mean, value) in means.iter_mut().zip(value.to_array()) {
            mean.push(f64::from(value));
        }
    }
    means
}

fn judge(mean: &MeanTest, expected: f64, significance: f64) -> Result<(), String> {
    mean.test_against(expected, significance)
        .map(|_| ())
        .map_err(|error| error.to_string())
}

fn agrees(means: &[MeanTest; 3], expected: [f64; 3]) -> Result<(), String> {
    for (mean, expected) in means.iter().zip(expected) {
        judge(mean, expected, 1e-6 / 3.0)?;
    }
    Ok(())
}

const SPECTRAL: Rgb = Rgb::new(0.3, 1.0, 2.5);

#[derive(Clone, Copy, Debug)]
enum Fault {
    MoreExtinction,
    BoundaryTurnedOver,
    SomeAlbedo,
    Dimmer,
}

fn spoil(scene: &mut SceneDescription, fault: Option<Fault>) {
    match fault {
        Some(Fault::MoreExtinction) => scene.media[0].extinction *= 1.15,
        Some(Fault::BoundaryTurnedOver) => {
            let boundary = &mut scene.boundaries[0];
            std::mem::swap(&mut boundary.interior, &mut boundary.exterior);
        }
        Some(Fault::SomeAlbedo) => scene.media[0].albedo += Rgb::splat(0.1),
        Some(Fault::Dimmer) => {
            scene.emitters = vec![EmitterDescription::Constant {
                radiance: Rgb::splat(0.9),
            }];
        }
        None => {}
    }
}

const FAULTS: [Fault; 4] = [
    Fault::MoreExtinction,
    Fault::BoundaryTurnedOver,
    Fault::SomeAlbedo,
    Fault::Dimmer,
];

/// `L = e^{−k τ}` behind an absorbing medium of depth `τ = 2`, from outside and, half as deep,
/// from within.
#[test]
fn what_absorbs_lets_through_its_transmittance() {
    for density in [DensityDescription::Homogeneous, ramp()] {
        for extinction in [Rgb::splat(0.7), SPECTRAL] {
            check_faults(&FAULTS, |fault| {
                let mut scene = ball(extinction, Rgb::ZERO);
                scene.media[0].density = density.clone();
                spoil(&mut scene, fault);
                let expected = extinction.to_array().map(|k| (-2.0 * f64::from(k)).exp());
                agrees(&means(&scene, 3.0, 60_000), expected)
            })
            .unwrap();
        }
    }
    // From the middle: the lower half of the ramp, ∫ 0.5 … 1.0 = 0.75.
    let mut scene = ball(SPECTRAL, Rgb::ZERO);
    scene.media[0].density = ramp();
    let expected = SPECTRAL.to_array().map(|k| (-0.75 * f64::from(k)).exp());
    agrees(&means(&scene, 0.0, 60_000), expected).unwrap();
}

/// The same by decomposition: flights and, where much is scattered, transmittances.
#[test]
fn decomposition_has_the_same_means() {
    for extinction in [Rgb::splat(0.7), SPECTRAL] {
        for albedo in [0.0, 1.0] {
            check_faults(&[Fault::Dimmer], |fault| {
                let mut scene = ball(extinction, Rgb::splat(albedo));
                scene.media[0].density = ramp();
                spoil(&mut scene, fault);
                let expected = extinction.to_array().map(|k| (-2.0 * f64::from(k)).exp());
                let expected = if albedo == 1.0 { [1.0; 3] } else { expected };
                agrees(
                    &means_by(&scene, 3.0, 40_000, VolumeTracking::Decomposition),
                    expected,
                )
            })
            .unwrap();
        }
    }
}

/// White light stays white where nothing is absorbed, whatever is in the way, in every channel.
#[test]
fn what_absorbs_nothing_is_not_seen() {
    for density in [DensityDescription::Homogeneous, ramp()] {
        for extinction in [Rgb::splat(1.5), SPECTRAL] {
            check_faults(&[Fault::SomeAlbedo, Fault::Dimmer], |fault| {
                let mut scene = ball(extinction, Rgb::ONE);
                scene.media[0].density = density.clone();
                match fault {
                    Some(Fault::SomeAlbedo) => scene.media[0].albedo = Rgb::splat(0.98),
                    fault => spoil(&mut scene, fault),
                }
                agrees(&means(&scene, 3.0, 40_000), [1.0; 3])
            })
            .unwrap();
        }
    }
}

/// `L = (1 − e^{−kτ}) L_e` of a medium that emits and absorbs, in the dark.
#[test]
fn what_emits_is_as_bright_as_it_is_opaque() {
    for density in [DensityDescription::Homogeneous, ramp()] {
        for extinction in [Rgb::splat(0.7), SPECTRAL] {
            let radiance = Rgb::new(1.0, 2.0, 3.0);
            check_faults(
                &[Fault::MoreExtinction, Fault::BoundaryTurnedOver, Fault::Dimmer],
                |fault| {
                    let mut scene = ball(extinction, Rgb::ZERO);
                    scene.media[0].density = density.clone();
                    let dimmer = if matches!(fault, Some(Fault::Dimmer)) {
                        0.98
                    } else {
                        1.0
                    };
                    spoil(&mut scene, fault);
                    scene.emitters = Vec::new();
                    scene.media[0].emission = Some(EmissionDescription {
                        radiance: radiance * dimmer,
                        grid: None,
                    });
                    let expected = [0, 1, 2]
                        .map(|c| f64::from(radiance[c]) * (1.0 - (-2.0 * f64::from(extinction[c])).exp()));
                    agrees(&means(&scene, 3.0, 60_000), expected)
                },
            )
            .unwrap();
        }
    }
}

/// An image of one pixel by samples of the estimator itself, through the render loop's interface,
/// and what a longest path of no or one edge shows.
#[test]
fn paths_of_one_edge_show_what_is_behind() {
    let mut scene = ball(Rgb::splat(0.5), Rgb::ONE);
    (scene.settings.width, scene.settings.height) = (1, 1);
    scene.camera.to_world = Affine3A::from_translation(Vec3::new(0.0, 0.0, -9.0));
    scene.camera.fov_x = 1e-3;
    let scene = Scene::new(&scene).unwrap();
    let mut mean = MeanTest::new();
    let tracer = VolumePathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
    for sample in 0..40_000 {
        mean.push(f64::from(tracer.sample(0, 0, sample, 4).x));
    }
    judge(&mean, (-1.0f64).exp(), 1e-6).unwrap();
    let dark = VolumePathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(0), u32::MAX);
    assert_eq!(dark.sample(0, 0, 0, 4), Rgb::ZERO);
}

/// Roulette leaves the mean as it is.
#[test]
fn roulette_changes_no_mean() {
    let scene = ball(Rgb::splat(2.0), Rgb::splat(0.9));
    let with = |roulette_depth| {
        let mut scene = scene.clone();
        scene.settings.roulette_depth = roulette_depth;
        means(&scene, 3.0, 120_000)
    };
    let (without, with) = (with(u32::MAX), with(2));
    for (a, b) in without.iter().zip(&with) {
        a.test_equal(b, 1e-6).unwrap();
    }
}

/// Where there is nothing to pass through, samples are those of the path tracer, alone and in
/// batches; and the walk through media, which they replace, has their mean.
#[test]
fn without_media_samples_are_the_path_tracers() {
    let mut description = builtin::cornell_glossy();
    (description.settings.width, description.settings.height) = (8, 8);
    let scene = Scene::new(&description).unwrap();
    let (ours, plain) = (
        VolumePathTracer::new(&scene, scene.emitters_by_power()),
        PathTracer::new(&scene, scene.emitters_by_power()),
    );
    let ids: Vec<SampleId> = (0..128u32)
        .map(|i| SampleId {
            x: i % 8,
            y: i / 8 % 8,
            index: i / 64,
        })
        .collect();
    let mut values = vec![Rgb::NAN; ids.len()];
    ours.sample_many(&ids, 3, &mut values);
    for (id, value) in ids.iter().zip(&values) {
        assert_eq!(*value, plain.sample(id.x, id.y, id.index, 3));
        assert_eq!(*value, ours.sample(id.x, id.y, id.index, 3));
    }
    let (mut walked, mut traced) = (MeanTest::new(), MeanTest::new());
    for sample in 0..60_000 {
        let mut rng = CounterRng::new(5, 0, sample);
        let ray = camera_ray(&scene, 3, 5, &mut rng);
        walked.push(f64::from(ours.radiance(ray, None, &mut rng).x));
        traced.push(f64::from(plain.sample(3, 5, sample, 6).x));
    }
    walked.test_equal(&traced, 1e-6).unwrap();
}

/// A grid that fills its boundary, a cube just above a floor, in light from a point and from all
/// around. `dust`, a tiny triangle that all light passes, makes boundaries be looked for where else
/// none would be.
fn cube_on_floor(dust: bool) -> SceneDescription {
    let mut scene = ball(Rgb::splat(1.2), Rgb::splat(0.8));
    scene.media[0].density = ramp();
    scene.shapes[0].geometry = Geometry::Mesh(builtin::cuboid(Affine3A::IDENTITY));
    let triangle = |corners: [Vec3; 3], material| ShapeDescription {
        name: "triangle".to_owned(),
        geometry: Geometry::Mesh(lightshed_scene::TriangleMesh {
            positions: corners.to_vec(),
            indices: vec![[0, 1, 2]],
            ..Default::default()
        }),
        material,
        emission: None,
    };
    scene.materials.push(Material::Diffuse {
        reflectance: Rgb::splat(0.6).into(),
    });
    let floor = |x: f32, z: f32| Vec3::new(x, -1.02, z);
    scene.shapes.push(triangle(
        [floor(-9.0, -5.0), floor(0.0, 9.0), floor(9.0, -5.0)],
        1,
    ));
    if dust {
        let at = |x: f32, y: f32| Vec3::new(0.9 + x, 0.9 + y, 0.9);
        scene
            .shapes
            .push(triangle([at(0.0, 0.0), at(1e-3, 0.0), at(0.0, 1e-3)], 0));
    }
    scene.emitters = vec![
        EmitterDescription::Point {
            position: Vec3::new(0.5, 3.0, 1.0),
            intensity: Rgb::splat(9.0),
        },
        EmitterDescription::Constant {
            radiance: Rgb::splat(0.3),
        },
    ];
    scene.settings.max_depth = Some(6);
    scene
}

/// Looking for no surfaces in a grid that has none changes nothing but the time: nor do shadow rays
/// that look for what is opaque alone.
#[test]
fn clear_grids_are_those_with_surfaces_in_them() {
    #[derive(Clone, Copy, Debug)]
    enum Planted {
        NoFloor,
        Denser,
    }
    let expected = means(&cube_on_floor(true), 3.0, 150_000);
    for dust in [false, true] {
        let scene = Scene::new(&cube_on_floor(dust)).unwrap();
        assert_eq!(scene.medium_is_clear(0), !dust);
        let towards_floor = Ray::new(Vec3::ZERO, Vec3::NEG_Y);
        assert_eq!(
            scene.passes_grid_alone(&towards_floor, 0),
            (!dust).then_some(false)
        );
    }
    check_faults(&[Planted::NoFloor, Planted::Denser], |fault| {
        let mut scene = cube_on_floor(false);
        match fault {
            Some(Planted::NoFloor) => drop(scene.shapes.pop()),
            Some(Planted::Denser) => scene.media[0].extinction *= 1.05,
            None => {}
        }
        for (mean, expected) in means(&scene, 3.0, 150_000).iter().zip(&expected) {
            mean.test_equal(expected, 1e-6 / 3.0)
                .map_err(|error| error.to_string())?;
        }
        Ok::<(), String>(())
    })
    .unwrap();
}

/// Together and alone, bit for bit.
#[test]
fn a_path_does_not_depend_on_its_batch() {
    for name in ["cloud", "smoke-in-cornell", "fire"] {
        let mut description = builtin::by_name(name).unwrap();
        (description.settings.width, description.settings.height) = (12, 12);
        let scene = Scene::new(&description).unwrap();
        let tracer = VolumePathTracer::new(&scene, scene.emitters_by_power());
        let ids: Vec<SampleId> = (0..144u32)
            .map(|i| SampleId {
                x: i % 12,
                y: i / 12,
                index: 7 * i,
            })
            .collect();
        for size in [1, 7, ids.len()] {
            let mut together = vec![Rgb::NAN; ids.len()];
            for (ids, values) in ids.chunks(size).zip(together.chunks_mut(size)) {
                tracer.sample_many(ids, 3, values);
            }
            for (id, value) in ids.iter().zip(&together) {
                assert_eq!(*value, tracer.sample(id.x, id.y, id.index, 3), "{name}, {id:?}");
            }
        }
    }
}

/// Clear air in a box on a black floor in its bottom's plane, and light from below only: nothing
/// comes up through the floor, neither along camera rays nor to a place that looks for light.
/// Exact.
#[test]
fn no_light_comes_through_a_floor_that_bounds_a_medium() {
    let turn = Affine3A::from_rotation_z(0.3) * Affine3A::from_rotation_x(0.8);
    let mut scene = ball(Rgb::splat(1e-3), Rgb::ONE);
    scene.shapes[0].geometry = Geometry::Mesh(builtin::cuboid(turn));
    let corner = |x: f32, z: f32| turn.transform_point3(Vec3::new(x, -1.0, z));
    let far = 40.0;
    scene.shapes.push(ShapeDescription {
        name: "floor".to_owned(),
        geometry: Geometry::Mesh(builtin::quad([
            corner(-far, far),
            corner(far, far),
            corner(far, -far),
            corner(-far, -far),
        ])),
        material: 1,
        emission: None,
    });
    scene.materials.push(Material::Diffuse {
        reflectance: Rgb::ZERO.into(),
    });
    // Light that comes straight up.
    scene.emitters = vec![EmitterDescription::Directional {
        direction: turn.transform_vector3(Vec3::Y),
        irradiance: Rgb::ONE,
    }];
    let lit = Scene::new(&scene).unwrap();
    scene.emitters = vec![EmitterDescription::Constant { radiance: Rgb::ONE }];
    let white = Scene::new(&scene).unwrap();
    let mut rng = CounterRng::new(5, 0, 0);
    for sample in 0..20_000 {
        let [x, z] = rng.next_2d();
        let place = turn.transform_point3(Vec3::new(1.6 * x - 0.8, 0.0, 1.6 * z - 0.8));
        let steep = turn.transform_vector3(Vec3::new(x - 0.5, -1.0, z - 0.5).normalize());
        let ray = Ray::new(place, steep);
        let seen = VolumePathTracer::new(&white, white.emitters_by_power())
            .with_depths(Some(1), u32::MAX)
            .radiance(ray, Some(0), &mut rng);
        assert_eq!(seen, Rgb::ZERO, "camera ray {sample}");
        let scattered = VolumePathTracer::new(&lit, lit.emitters_by_power()).radiance(
            Ray::new(place, -steep),
            Some(0),
            &mut rng,
        );
        assert_eq!(scattered, Rgb::ZERO, "path {sample}");
    }
}

/// What lets all light pass hides no emitter, however slanting the light: with a box of it in the
/// way each sample is the one without, but where rounding moves a ray over an edge.
#[test]
fn boundaries_hide_nothing() {
    let mut with = builtin::smoke_in_cornell();
    with.media.clear();
    with.boundaries.clear();
    let mut without = with.clone();
    without.shapes.pop();
    check_faults(&[()], |fault| {
        let mut with = with.clone();
        if fault.is_some() {
            // Scatters like the floor.
            with.shapes.last_mut().unwrap().material = 0;
        }
        let [with, without] = [&with, &without].map(|scene| Scene::new(scene).unwrap());
        let [ours, plain] = [&with, &without].map(|scene| {
            VolumePathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(4), u32::MAX)
        });
        let (mut differing, samples) = (0, 20_000);
        for sample in 0..samples {
            let (x, y) = (sample % 100, sample / 100);
            let [a, b] = [&ours, &plain].map(|tracer| {
                let mut rng = CounterRng::new(3, 0, sample);
                let ray = camera_ray(tracer.transport().scene, 2 * x, y, &mut rng);
                tracer.radiance(ray, None, &mut rng)
            });
            differing += u32::from(!a.abs_diff_eq(b, 1e-3 * (1.0 + b.max_element())));
        }
        if differing * 200 < samples {
            Ok(())
        } else {
            Err(format!("{differing} of {samples} samples differ"))
        }
    })
    .unwrap();
}

/// Values of samples `0..each` of each of `pixels` pixels, by a ray along −z from z = 3.
fn stratified(scene: &SceneDescription, points: PointSet, pixels: u32, each: u32) -> Vec<Vec<f64>> {
    let scene = Scene::new(scene).unwrap();
    let mut tracer = VolumePathTracer::new(&scene, scene.emitters_by_power()).with_points(points);
    tracer.camera_medium = None;
    let ray = Ray::new(Vec3::new(0.0, 0.0, 3.0), Vec3::NEG_Z);
    let value = |x, index| {
        let (id, mut rng) = (SampleId { x, y: 0, index }, CounterRng::new(5, x, index));
        f64::from(tracer.value(id, 5, ray, None, &mut rng).x)
    };
    let of_pixel = |x| (0..each).map(|index| value(x, index)).collect();
    (0..pixels).map(of_pixel).collect()
}

/// Stratified numbers keep means, where a ray flies through two media along one edge (`e^{−kτ}`,
/// `τ` the sum of both depths), and where light scatters (1 in white light without absorption).
#[test]
fn stratified_numbers_keep_means() {
    for density in [DensityDescription::Homogeneous, ramp()] {
        check_faults(&["flights repeat their numbers"], |fault| {
            let mut scene = ball(Rgb::splat(0.4), Rgb::ZERO);
            scene.media[0].density = density.clone();
            scene.shapes.push(scene.shapes[0].clone());
            if let Geometry::Sphere(sphere) = &mut scene.shapes[1].geometry {
                sphere.center.z = -3.0;
            }
            scene.media.push(MediumDescription {
                density: DensityDescription::Homogeneous,
                ..scene.media[0].clone()
            });
            scene.boundaries.push(MediumBoundary {
                shape: 1,
                interior: Some(1),
                exterior: None,
            });
            numbers::REPEATED.set(fault.is_some());
            let values = stratified(&scene, PointSet::Sobol, 60_000, 1);
            numbers::REPEATED.set(false);
            let mut mean = MeanTest::new();
            values.iter().flatten().for_each(|value| mean.push(*value));
            judge(&mean, (-4.0f64 * 0.4).exp(), 1e-6)
        })
        .unwrap();
        for points in [PointSet::Sobol, PointSet::BlueNoise] {
            let mut scene = ball(Rgb::splat(1.5), Rgb::splat(0.999_999));
            scene.media[0].density = density.clone();
            scene.emitters.push(EmitterDescription::Directional {
                direction: Vec3::NEG_X,
                irradiance: Rgb::ONE,
            });
            let mean_by = |points| {
                let mut mean = MeanTest::new();
                let values = stratified(&scene, points, 40_000, 2);
                values
                    .iter()
                    .for_each(|pair| mean.push((pair[0] + pair[1]) / 2.0));
                mean
            };
            let [own, independent] = [points, PointSet::Independent].map(mean_by);
            own.test_equal(&independent, 1e-6).unwrap();
        }
    }
}

/// The error of the mean of 64 samples of a ray through an absorbing ball is less than a fifth of
/// that of independent ones in a homogeneous medium, and less than three quarters in a grid.
#[test]
fn a_first_flight_is_stratified() {
    for (density, factor) in [(DensityDescription::Homogeneous, 0.2), (ramp(), 0.75)] {
        check_faults(&[PointSet::Independent], |fault| {
            let mut scene = ball(Rgb::splat(0.4), Rgb::ZERO);
            scene.media[0].density = density.clone();
            let transmittance = (-2.0f64 * 0.4).exp();
            let values = stratified(&scene, fault.unwrap_or(PointSet::Sobol), 500, 64);
            let error = |pixel: &Vec<f64>| (pixel.iter().sum::<f64>() / 64.0 - transmittance).powi(2);
            let square = values.iter().map(error).sum::<f64>() / 500.0;
            let ratio = (square / (transmittance * (1.0 - transmittance) / 64.0)).sqrt();
            if ratio < factor {
                Ok(())
            } else {
                Err(format!("{ratio}"))
            }
        })
        .unwrap();
    }
}
