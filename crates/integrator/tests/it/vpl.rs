//! Virtual point lights against the path tracer, and their lighting grid against their sum.
//!
//! Seeds are fixed. Frames of different lights are independent, pixels of a frame are not, so means
//! over the image are tested, frame by frame: at 1e-6 each.

use lightshed_film::{Budget, FrameMethod, PixelEstimator, RenderOptions, RgbImage, render_frames};
use lightshed_integrator::{
    PathTracer, ShadowTargets, VplBrute, VplError, VplGrid, VplGridOptions, VplOptions,
};
use lightshed_lights::GridOptions;
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{
    CameraDescription, Geometry, Material, RenderSettings, Rgb, Scene, SceneDescription, ShapeDescription,
    SphereGeometry, builtin, luminance,
};
use lightshed_testkit::{MeanReport, MeanTest, StatisticsError, check_faults};
use std::sync::atomic::AtomicBool;

fn diffuse(reflectance: [f32; 3]) -> Material {
    Material::Diffuse {
        reflectance: Rgb::from(reflectance).into(),
    }
}

fn shape(geometry: Geometry, material: u32, emission: Option<Rgb>) -> ShapeDescription {
    ShapeDescription {
        name: "shape".to_owned(),
        geometry,
        material,
        emission,
    }
}

/// A floor, three walls around it, a ball and a box above it, and a lamp, all with gaps between, so
/// that no light is near what it shines on.
fn apart() -> Scene {
    let floor = builtin::quad([
        Vec3::new(-1.5, 0.0, 1.5),
        Vec3::new(1.5, 0.0, 1.5),
        Vec3::new(1.5, 0.0, -1.5),
        Vec3::new(-1.5, 0.0, -1.5),
    ]);
    let wall = |turn: f32| {
        let mut wall = builtin::quad([
            Vec3::new(-1.4, 0.4, -1.9),
            Vec3::new(1.4, 0.4, -1.9),
            Vec3::new(1.4, 2.6, -1.9),
            Vec3::new(-1.4, 2.6, -1.9),
        ]);
        let turn = Affine3A::from_rotation_y(turn);
        wall.positions
            .iter_mut()
            .for_each(|p| *p = turn.transform_point3(*p));
        Geometry::Mesh(wall)
    };
    let lamp = builtin::quad([
        Vec3::new(-0.5, 3.6, -0.5),
        Vec3::new(0.5, 3.6, -0.5),
        Vec3::new(0.5, 3.6, 0.5),
        Vec3::new(-0.5, 3.6, 0.5),
    ]);
    let turned = Affine3A::from_translation(Vec3::new(0.8, 1.2, -0.4)) * Affine3A::from_rotation_y(0.5);
    let cube = builtin::cuboid(turned * Affine3A::from_scale(Vec3::splat(0.3)));
    let ball = SphereGeometry {
        center: Vec3::new(-0.7, 1.1, 0.2),
        radius: 0.5,
        flip_normals: false,
    };
    let mut description = SceneDescription {
        shapes: vec![
            shape(Geometry::Mesh(floor), 0, None),
            shape(wall(0.0), 0, None),
            shape(wall(std::f32::consts::FRAC_PI_2), 1, None),
            shape(wall(-std::f32::consts::FRAC_PI_2), 2, None),
            shape(Geometry::Mesh(cube), 1, None),
            shape(Geometry::Sphere(ball), 2, None),
            shape(Geometry::Mesh(lamp), 0, Some(Rgb::new(16.0, 18.0, 20.0))),
        ],
        materials: vec![
            diffuse([0.8, 0.7, 0.6]),
            diffuse([0.9, 0.3, 0.2]),
            diffuse([0.3, 0.8, 0.9]),
        ],
        camera: CameraDescription {
            // From (0, 1.2, 6) along −Z.
            to_world: Affine3A::from_translation(Vec3::new(0.0, 1.2, 6.0))
                * Affine3A::from_rotation_y(std::f32::consts::PI),
            fov_x: 0.6,
            ..builtin::furnace().camera
        },
        ..SceneDescription::default()
    };
    description.settings = RenderSettings {
        width: 10,
        height: 8,
        ..builtin::furnace().settings
    };
    Scene::new(&description).unwrap()
}

/// The mean luminance of each of `frames` frames.
fn frame_values(method: &mut impl FrameMethod, frames: u32, seed: u64) -> Vec<f64> {
    let [width, height] = method.size();
    let mut image = vec![Rgb::ZERO; (width * height) as usize];
    let value = |frame| {
        method
            .render_frame(frame, seed, &mut image, &AtomicBool::new(false))
            .unwrap();
        let sum: f64 = image.iter().map(|&value| f64::from(luminance(value))).sum();
        sum / image.len() as f64
    };
    (0..frames).map(value).collect()
}

fn frame_means(method: &mut impl FrameMethod, frames: u32, seed: u64) -> MeanTest {
    let mut means = MeanTest::new();
    means.extend(frame_values(method, frames, seed));
    means
}

/// The same of the path tracer.
fn path_means(scene: &Scene, max_depth: u32, samples: u32) -> MeanTest {
    let tracer = PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(max_depth), 1000);
    let (width, height) = (scene.settings().width, scene.settings().height);
    let mut means = MeanTest::new();
    for index in 0..samples {
        let pixels = (0..width * height).map(|i| tracer.sample(i % width, i / width, index, 99));
        let sum: f64 = pixels.map(|value| f64::from(luminance(value))).sum();
        means.push(sum / f64::from(width * height));
    }
    means
}

/// Where nothing is clamped and all is diffuse, `b` bounces of light give what paths of `b + 2`
/// edges give; a bounce less is noticed, and so is the bias of clamping.
#[test]
fn lights_one_by_one_give_what_paths_give() {
    let scene = apart();
    let paths = path_means(&scene, 4, 2500);
    check_faults(&["a bounce less", "clamped"], |fault| {
        let bounces = if fault == Some("a bounce less") { 1 } else { 2 };
        let min_distance = if fault == Some("clamped") { 1.5 } else { 0.0 };
        let options = VplOptions { paths: 48, bounces };
        let mut brute = VplBrute::new(&scene, scene.emitters_by_power(), options, min_distance).unwrap();
        frame_means(&mut brute, 700, 3).test_equal(&paths, 1e-6)
    })
    .unwrap();
}

/// Whether two methods have the same mean, frame by frame with the same random numbers for the
/// camera and the direct light.
fn same_mean(
    a: &mut impl FrameMethod,
    b: &mut impl FrameMethod,
    frames: u32,
) -> Result<MeanReport, StatisticsError> {
    let (a, b) = (frame_values(a, frames, 5), frame_values(b, frames, 5));
    let mut difference = MeanTest::new();
    difference.extend(a.iter().zip(&b).map(|(a, b)| a - b));
    difference.test_against(0.0, 1e-6)
}

/// A few lights at each point stand for all of them, and a few shadow rays for many. Lights whose
/// distance is clamped, and light without shadows, are noticed.
#[test]
fn choices_stand_for_all() {
    let scene = cornell(12, 12);
    let lights = VplOptions {
        paths: 60,
        bounces: 3,
    };
    let clamp = 0.02 * scene.extent();
    check_faults(&["clamped"], |fault| {
        let brute = |clamp| {
            VplBrute::new(&scene, scene.emitters_by_power(), lights, clamp)
                .unwrap()
                .with_fixed_lights()
        };
        let farther = if fault.is_some() { 10.0 * clamp } else { clamp };
        same_mean(
            &mut brute(clamp),
            &mut brute(farther).with_lights_per_point(9),
            150,
        )
    })
    .unwrap();
    check_faults(&["no shadows"], |fault| {
        let grid = |shadow_samples| {
            let options = VplGridOptions {
                lights,
                grid: GridOptions {
                    alpha: 2.0,
                    ..GridOptions::default()
                },
                first_level: 0,
                fixed_lights: true,
                filter_iterations: 0,
                shadow_samples,
                ..VplGridOptions::new(clamp)
            };
            VplGrid::new(&scene, scene.emitters_by_power(), options).unwrap()
        };
        same_mean(&mut grid(16), &mut grid(if fault.is_some() { 0 } else { 1 }), 150)
    })
    .unwrap();
}

fn mean_image(method: &mut impl FrameMethod, frames: u32, seed: u64, threads: usize) -> RgbImage {
    let [width, height] = method.size();
    let options = RenderOptions {
        seed,
        threads,
        ..RenderOptions::new(width, height, Budget::Samples(frames))
    };
    let outcome = render_frames(method, &options, &|_| (), &AtomicBool::new(false)).unwrap();
    assert_eq!(outcome.film.non_finite(), 0);
    outcome.film.mean_image()
}

/// `Σ |a − b| / Σ b` over pixels and channels.
fn relative_difference(a: &RgbImage, b: &RgbImage) -> f64 {
    let pairs = || a.pixels().iter().flatten().zip(b.pixels().iter().flatten());
    let difference: f64 = pairs().map(|(a, b)| f64::from((a - b).abs())).sum();
    difference / pairs().map(|(_, b)| f64::from(*b)).sum::<f64>()
}

fn cornell(width: u32, height: u32) -> Scene {
    let mut description = builtin::cornell();
    (description.settings.width, description.settings.height) = (width, height);
    Scene::new(&description).unwrap()
}

/// The Cornell box from the same lights, the direct part from the same random numbers: at α = 3
/// with all shadows the grid is within 2 % of the sum, at α = 1 from S₁ on farther from it, and
/// so without shadows. Rays into the spread of grid lights are darker. One frame of few shadow rays
/// is nearer with the filter than without.
#[test]
fn the_grid_gives_nearly_what_the_sum_gives() {
    let scene = cornell(24, 24);
    let lights = VplOptions {
        paths: 500,
        bounces: 3,
    };
    let clamp = 0.02 * scene.extent();
    let sum = |frames| {
        let mut brute = VplBrute::new(&scene, scene.emitters_by_power(), lights, clamp)
            .unwrap()
            .with_fixed_lights();
        mean_image(&mut brute, frames, 7, 0)
    };
    let expected = sum(4);
    let options = VplGridOptions {
        lights,
        grid: GridOptions {
            alpha: 3.0,
            ..GridOptions::default()
        },
        first_level: 0,
        shadow_samples: 16,
        filter_iterations: 0,
        fixed_lights: true,
        ..VplGridOptions::new(clamp)
    };
    let image = |options, frames| {
        mean_image(
            &mut VplGrid::new(&scene, scene.emitters_by_power(), options).unwrap(),
            frames,
            7,
            0,
        )
    };
    let difference = |options| relative_difference(&image(options, 4), &expected);
    let fine = difference(options);
    let rough = difference(VplGridOptions {
        grid: GridOptions::default(),
        first_level: 1,
        ..options
    });
    let unshadowed = difference(VplGridOptions {
        shadow_samples: 0,
        ..options
    });
    let mean = |image: &RgbImage| image.mean().iter().sum::<f64>();
    let spread = VplGridOptions {
        shadow_targets: ShadowTargets::Spread,
        ..options
    };
    let [represented, spread] = [options, spread].map(|options| mean(&image(options, 4)) / mean(&expected));
    println!("off by {fine:.4} at alpha 3, {rough:.4} at alpha 1 from S1, {unshadowed:.4} without shadows");
    println!("brightness {represented:.4} towards represented lights, {spread:.4} into the spread");
    assert!(fine < 0.02 && rough > 2.0 * fine && unshadowed > 2.0 * fine);
    assert!((represented - 1.0).abs() < 0.02 && spread < represented - 0.01);

    let once = sum(1);
    let raw = VplGridOptions {
        shadow_samples: 1,
        ..options
    };
    let frame = |options| relative_difference(&image(options, 1), &once);
    let filtered = frame(VplGridOptions {
        filter_iterations: 3,
        ..raw
    });
    let interleaved = frame(VplGridOptions {
        filter_iterations: 3,
        interleaving: 2,
        ..raw
    });
    let raw = frame(raw);
    println!(
        "one frame, one shadow ray: off by {raw:.4}, filtered {filtered:.4}, interleaved too {interleaved:.4}"
    );
    assert!(filtered < 0.8 * raw && interleaved < raw);
}

#[test]
fn threads_do_not_change_the_image() {
    let scene = cornell(20, 12);
    let options = VplGridOptions {
        lights: VplOptions {
            paths: 400,
            bounces: 3,
        },
        interleaving: 2,
        ..VplGridOptions::new(0.03)
    };
    let grid = |seed, threads| {
        mean_image(
            &mut VplGrid::new(&scene, scene.emitters_by_power(), options).unwrap(),
            3,
            seed,
            threads,
        )
    };
    let brute = |seed, threads| {
        let method = VplBrute::new(&scene, scene.emitters_by_power(), options.lights, 0.03).unwrap();
        mean_image(&mut method.with_lights_per_point(50), 3, seed, threads)
    };
    assert_eq!(grid(1, 1), grid(1, 3));
    assert_eq!(brute(1, 1), brute(1, 3));
    assert!(grid(1, 1) != grid(2, 1) && brute(1, 1) != brute(2, 1));
}

/// A convex body of any material in a white sky: what its lights could shine on is not there, so
/// the camera's part alone must be the path tracer's, mirrors, panes and coats included. A body
/// that scatters nothing is noticed.
#[test]
fn the_direct_part_is_that_of_the_path_tracer() {
    let materials = [
        Material::Mirror {
            reflectance: Rgb::splat(0.7).into(),
        },
        Material::Plastic {
            diffuse_reflectance: Rgb::new(0.6, 0.4, 0.2).into(),
            specular_reflectance: Rgb::ONE.into(),
            eta: 1.5,
            nonlinear: false,
            roughness: None,
        },
        diffuse([0.5, 0.6, 0.9]),
    ];
    for material in materials {
        let mut description = builtin::furnace();
        description.materials = vec![material];
        (description.settings.width, description.settings.height) = (12, 12);
        let scene = Scene::new(&description).unwrap();
        let paths = path_means(&scene, 10, 600);
        let options = VplOptions { paths: 4, bounces: 1 };
        let means = frame_means(
            &mut VplBrute::new(&scene, scene.emitters_by_power(), options, 0.0).unwrap(),
            600,
            9,
        );
        means.test_equal(&paths, 1e-6).unwrap();
        assert!(means.test_equal(&path_means(&scene, 1, 600), 1e-6).is_err());
    }
}

#[test]
fn impossible_options_are_refused() {
    let scene = cornell(4, 4);
    let sound = VplGridOptions::new(0.1);
    let refuse = |options: VplGridOptions| {
        VplGrid::new(&scene, scene.emitters_by_power(), options)
            .err()
            .unwrap()
    };
    assert!(matches!(
        refuse(VplGridOptions {
            min_distance: f32::NAN,
            ..sound
        }),
        VplError::MinDistance(_)
    ));
    assert_eq!(
        refuse(VplGridOptions {
            shadow_samples: 17,
            ..sound
        }),
        VplError::ShadowSamples(17)
    );
    assert_eq!(
        refuse(VplGridOptions {
            interleaving: 3,
            ..sound
        }),
        VplError::Interleaving(3)
    );
    assert_eq!(
        refuse(VplGridOptions {
            filter_iterations: 11,
            ..sound
        }),
        VplError::FilterIterations(11)
    );
    let grid = GridOptions {
        alpha: -1.0,
        ..GridOptions::default()
    };
    assert!(matches!(
        refuse(VplGridOptions { grid, ..sound }),
        VplError::Grid(_)
    ));
    let lights = VplOptions { paths: 0, bounces: 1 };
    assert_eq!(refuse(VplGridOptions { lights, ..sound }), VplError::Paths(0));
    assert!(VplBrute::new(&scene, scene.emitters_by_power(), VplOptions::default(), -1.0).is_err());
}

/// Where no light arrives at all there are no lights, and the image is black.
#[test]
fn the_dark_is_dark() {
    let mut description = builtin::cornell();
    for shape in &mut description.shapes {
        shape.emission = None;
    }
    (description.settings.width, description.settings.height) = (4, 4);
    let scene = Scene::new(&description).unwrap();
    let mut grid = VplGrid::new(&scene, scene.emitters_by_power(), VplGridOptions::new(0.1)).unwrap();
    assert_eq!(mean_image(&mut grid, 2, 0, 1).mean(), [0.0; 3]);
    assert!(grid.grid().is_none());
}
