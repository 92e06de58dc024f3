//! Virtual point lights against the path tracer, and their lighting grid against their sum.
//!
//! Seeds are fixed. Frames of different lights are independent, pixels of a frame are not, so means over the image are tested, frame
//! by frame: at 1e-6 each.

use lightshed_integrator::{
    Budget, FrameMethod, PathTracer, PixelEstimator, RenderOptions, RgbImage, ShadowTargets, VplBrute,
    VplError, VplGrid, VplGridOptions, VplOptions, render_frames,
};
use lightshed_lights::GridOptions;
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{
    CameraDescription, Geometry, Material, RenderSettings, Rgb, Scene, SceneDescription, ShapeDescription,
    SphereGeometry, builtin, luminance,
};
use lightshed_testkit::{MeanTest, check_faults};
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

/// A floor, a ball and a box that float above it, and a lamp: no two surfaces touch, so that no light is near what it shines on.
fn apart() -> Scene {
    let floor = builtin::quad([
        Vec3::new(-2.0, 0.0, 2.0),
        Vec3::new(2.0, 0.0, 2.0),
        Vec3::new(2.0, 0.0, -2.0),
        Vec3::new(-2.0, 0.0, -2.0),
    ]);
    let lamp = builtin::quad([
        Vec3::new(-0.5, 3.0, -0.5),
        Vec3::new(0.5, 3.0, -0.5),
        Vec3::new(0.5, 3.0, 0.5),
        Vec3::new(-0.5, 3.0, 0.5),
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
            shape(Geometry::Mesh(cube), 1, None),
            shape(Geometry::Sphere(ball), 2, None),
            shape(Geometry::Mesh(lamp), 0, Some(Rgb::new(8.0, 9.0, 10.0))),
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
            fov_x: 0.7,
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
fn frame_means(method: &mut impl FrameMethod, frames: u32, seed: u64) -> MeanTest {
    let [width, height] = method.size();
    let mut image = vec![Rgb::ZERO; (width * height) as usize];
    let mut means = MeanTest::new();
    for frame in 0..frames {
        method
            .render_frame(frame, seed, &mut image, &AtomicBool::new(false))
            .unwrap();
        let sum: f64 = image.iter().map(|&value| f64::from(luminance(value))).sum();
        means.push(sum / image.len() as f64);
    }
    means
}

/// The same of the path tracer.
fn path_means(scene: &Scene, max_depth: u32, samples: u32) -> MeanTest {
    let tracer = PathTracer::with_depths(scene, Some(max_depth), 1000);
    let (width, height) = (scene.settings().width, scene.settings().height);
    let mut means = MeanTest::new();
    for index in 0..samples {
        let pixels = (0..width * height).map(|i| tracer.sample(i % width, i / width, index, 99));
        let sum: f64 = pixels.map(|value| f64::from(luminance(value))).sum();
        means.push(sum / f64::from(width * height));
    }
    means
}

/// Where nothing is clamped and all is diffuse, `b` bounces of light give what paths of `b + 2` edges give; a bounce less is noticed, and
/// so is the bias of clamping.
#[test]
fn lights_one_by_one_give_what_paths_give() {
    let scene = apart();
    let paths = path_means(&scene, 4, 2500);
    check_faults(&["a bounce less", "clamped"], |fault| {
        let bounces = if fault == Some("a bounce less") { 1 } else { 2 };
        let min_distance = if fault == Some("clamped") { 1.5 } else { 0.0 };
        let options = VplOptions { paths: 48, bounces };
        let mut brute = VplBrute::new(&scene, options, min_distance).unwrap();
        frame_means(&mut brute, 700, 3).test_equal(&paths, 1e-6)
    })
    .unwrap();
}

/// A few lights at each point stand for all of them; so do the shares of interleaved sampling, and shadow rays to few for shadow rays to many.
/// Forgetting the weight of the choice is noticed by the mean.
#[test]
fn choices_of_lights_stand_for_all() {
    let scene = apart();
    let options = VplOptions {
        paths: 200,
        bounces: 2,
    };
    let brute = || VplBrute::new(&scene, options, 0.0).unwrap().with_fixed_lights();
    let all = frame_means(&mut brute(), 60, 5);
    let few = frame_means(&mut brute().with_lights_per_point(9), 400, 5);
    few.test_equal(&all, 1e-6).unwrap();

    let grid = VplGridOptions {
        lights: options,
        grid: GridOptions {
            alpha: 2.0,
            ..GridOptions::default()
        },
        first_level: 0,
        fixed_lights: true,
        filter_iterations: 0,
        ..VplGridOptions::new(0.0)
    };
    let means = |options| frame_means(&mut VplGrid::new(&scene, options).unwrap(), 300, 5);
    let many = means(VplGridOptions {
        shadow_samples: 16,
        ..grid
    });
    means(VplGridOptions {
        shadow_samples: 1,
        ..grid
    })
    .test_equal(&many, 1e-6)
    .unwrap();
    // Without shadows it is another image.
    assert!(
        means(VplGridOptions {
            shadow_samples: 0,
            ..grid
        })
        .test_equal(&many, 1e-6)
        .is_err()
    );
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

/// The Cornell box from the same 2,500 lights by both methods: images are within 4 % of each other at α = 3 with all shadows, farther at a third of
/// that, and farther still without shadows. Rays into the spread of grid lights are too dark.
#[test]
fn the_grid_gives_nearly_what_the_sum_gives() {
    let scene = cornell(24, 24);
    let lights = VplOptions {
        paths: 1000,
        bounces: 3,
    };
    let clamp = 0.02 * scene.extent();
    let mut brute = VplBrute::new(&scene, lights, clamp).unwrap().with_fixed_lights();
    let expected = mean_image(&mut brute, 2, 7, 0);
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
    let image = |options| mean_image(&mut VplGrid::new(&scene, options).unwrap(), 8, 7, 0);
    let difference = |options| relative_difference(&image(options), &expected);
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
    let spread = VplGridOptions {
        shadow_targets: ShadowTargets::Spread,
        ..options
    };
    let mean = |image: &RgbImage| image.mean().iter().sum::<f64>();
    let brightness = mean(&image(spread)) / mean(&expected);
    println!(
        "alpha 3: {fine:.4}, alpha 1 from S1: {rough:.4}, no shadows: {unshadowed:.4}, spread: {brightness:.4}"
    );
    assert!(fine < 0.04 && rough > fine && unshadowed > rough);
    let filtered = VplGridOptions {
        filter_iterations: 3,
        shadow_samples: 4,
        interleaving: 2,
        ..options
    };
    let frame = |options| {
        relative_difference(
            &mean_image(&mut VplGrid::new(&scene, options).unwrap(), 1, 7, 0),
            &expected,
        )
    };
    // One frame is nearer with the filter than without.
    let raw = VplGridOptions {
        filter_iterations: 0,
        interleaving: 1,
        shadow_samples: 1,
        ..options
    };
    let (with, without) = (
        frame(VplGridOptions {
            filter_iterations: 3,
            ..raw
        }),
        frame(raw),
    );
    println!(
        "one frame, one shadow sample: filtered {with:.4}, raw {without:.4}; interleaved {:.4}",
        frame(filtered)
    );
    assert!(with < without && frame(filtered) < 0.15);
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
    let grid = |seed, threads| mean_image(&mut VplGrid::new(&scene, options).unwrap(), 3, seed, threads);
    let brute = |seed, threads| {
        let method = VplBrute::new(&scene, options.lights, 0.03).unwrap();
        mean_image(&mut method.with_lights_per_point(50), 3, seed, threads)
    };
    assert_eq!(grid(1, 1), grid(1, 3));
    assert_eq!(brute(1, 1), brute(1, 3));
    assert!(grid(1, 1) != grid(2, 1) && brute(1, 1) != brute(2, 1));
}

/// A convex body of any material in a white sky: what its lights could shine on is not there, so the camera's part alone must be the path
/// tracer's, mirrors, panes and coats included. A body that scatters nothing is noticed.
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
        let means = frame_means(&mut VplBrute::new(&scene, options, 0.0).unwrap(), 600, 9);
        means.test_equal(&paths, 1e-6).unwrap();
        assert!(means.test_equal(&path_means(&scene, 1, 600), 1e-6).is_err());
    }
}

#[test]
fn impossible_options_are_refused() {
    let scene = cornell(4, 4);
    let sound = VplGridOptions::new(0.1);
    let refuse = |options: VplGridOptions| VplGrid::new(&scene, options).err().unwrap();
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
    assert!(VplBrute::new(&scene, VplOptions::default(), -1.0).is_err());
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
    let mut grid = VplGrid::new(&scene, VplGridOptions::new(0.1)).unwrap();
    assert_eq!(mean_image(&mut grid, 2, 0, 1).mean(), [0.0; 3]);
    assert!(grid.grid().is_none());
}
