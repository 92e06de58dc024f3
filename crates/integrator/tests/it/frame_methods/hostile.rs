//! Scenes that are hard on numbers: images stay finite, and the same for any number of threads.

use super::scenes::{every_emitter, small_description};
use lightshed_film::{Budget, FrameMethod, RenderOptions, render_frames};
use lightshed_integrator::{
    CameraMotion, PathMapping, PathReuse, RestirDi, RestirDiSettings, RestirGi, RestirPt, RestirPtOptions,
    RestirSuffix, RestirSuffixOptions, SceneWorld, VolumePathReuse,
};
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{
    EmitterDescription, Geometry, Material, Rgb, Scene, SceneDescription, ShapeDescription, SphereGeometry,
    builtin,
};
use std::sync::atomic::AtomicBool;

fn methods<'a>(
    world: &'a SceneWorld<'a>,
    motion: CameraMotion,
) -> Vec<(&'static str, Box<dyn FrameMethod + 'a>)> {
    let scene = world.scene();
    let restir_pt = |options| Box::new(RestirPt::new(world, options, motion).unwrap());
    let offline = RestirPtOptions {
        candidates: 3,
        ..RestirPtOptions::offline(PathMapping::Hybrid)
    };
    let suffixes = RestirSuffixOptions {
        prefixes: 3,
        camera_rays: 2,
        canonical: 2,
        borrowed: 2,
        ..RestirSuffixOptions::real_time(PathMapping::Hybrid)
    };
    vec![
        (
            "restir-pt",
            restir_pt(RestirPtOptions::real_time(PathMapping::Hybrid)),
        ),
        (
            "restir-pt, reconnection",
            restir_pt(RestirPtOptions::real_time(PathMapping::Reconnection)),
        ),
        ("restir-pt-offline", restir_pt(offline)),
        (
            "restir-suffix",
            Box::new(RestirSuffix::new(world, suffixes, motion).unwrap()),
        ),
        (
            "restir-di",
            Box::new(
                RestirDi::new(scene, scene.emitters_by_power(), RestirDiSettings::UNBIASED)
                    .unwrap()
                    .with_motion(motion),
            ),
        ),
        (
            "restir-di-biased",
            Box::new(
                RestirDi::new(scene, scene.emitters_by_power(), RestirDiSettings::BIASED)
                    .unwrap()
                    .with_motion(motion),
            ),
        ),
        (
            "restir-gi",
            Box::new(
                RestirGi::new(scene, scene.emitters_by_power(), RestirDiSettings::UNBIASED)
                    .unwrap()
                    .with_motion(motion),
            ),
        ),
        (
            "path-reuse",
            Box::new(PathReuse::new(scene, scene.emitters_by_power())),
        ),
        (
            "volpath-reuse",
            Box::new(VolumePathReuse::new(scene, scene.emitters_by_power())),
        ),
    ]
}

/// The frames of a method.
fn frames(method: &mut dyn FrameMethod, count: u32) -> Vec<Vec<Rgb>> {
    let [width, height] = method.size();
    let frame = |frame| {
        let mut image = vec![Rgb::NAN; width as usize * height as usize];
        let counts = method.render_frame(frame, 3, &mut image, &AtomicBool::new(false));
        assert_eq!(counts.map(|rays| rays.camera >= image.len() as u64), Some(true));
        image
    };
    (0..count).map(frame).collect()
}

fn sphere(center: Vec3, radius: f32, material: u32, emission: Option<f32>) -> ShapeDescription {
    ShapeDescription {
        name: "sphere".to_owned(),
        geometry: Geometry::Sphere(SphereGeometry {
            center,
            radius,
            flip_normals: false,
        }),
        material,
        emission: emission.map(Rgb::splat),
    }
}

fn hostile_scenes() -> Vec<(&'static str, SceneDescription)> {
    let cornell = || {
        let mut description = small_description(builtin::cornell(), 20);
        description.settings.max_depth = Some(5);
        description
    };
    let mut scenes = vec![("cornell", cornell())];

    let mut one_pixel = cornell();
    (one_pixel.settings.width, one_pixel.settings.height) = (1, 1);
    scenes.push(("one pixel", one_pixel));

    let mut black = cornell();
    black.shapes.iter_mut().for_each(|shape| shape.emission = None);
    scenes.push(("black", black));

    let mut tiny = cornell();
    tiny.shapes.last_mut().unwrap().emission = None;
    tiny.shapes
        .push(sphere(Vec3::new(0.0, 0.2, 0.0), 1e-6, 0, Some(1e12)));
    scenes.push(("tiny bright emitter", tiny));

    let mut near = cornell();
    near.emitters.push(EmitterDescription::Point {
        position: Vec3::new(0.0, -1.0 + 1e-7, 0.3),
        intensity: Rgb::splat(1e20),
    });
    scenes.push(("point light on the floor", near));

    // Seen along the floor: every angle is grazing.
    let mut grazing = cornell();
    grazing.camera.to_world = Affine3A::from_translation(Vec3::new(0.0, -1.0 + 1e-4, 1.5))
        * Affine3A::from_rotation_y(std::f32::consts::PI);
    scenes.push(("grazing", grazing));

    let mut scales = cornell();
    scales
        .shapes
        .push(sphere(Vec3::new(0.0, 2e6, 0.0), 1e6, 0, Some(3.0)));
    scales
        .shapes
        .push(sphere(Vec3::new(0.1, -0.999_999, 0.9), 1e-6, 0, None));
    scenes.push(("a million to one", scales));

    let mut behind_glass = cornell();
    let glass = behind_glass.materials.len() as u32;
    behind_glass.materials.push(Material::Dielectric {
        eta: 1.5,
        roughness: None,
        specular_reflectance: Rgb::ONE.into(),
        specular_transmittance: Rgb::ONE.into(),
    });
    behind_glass.shapes.last_mut().unwrap().emission = None;
    let centre = Vec3::new(0.0, 0.3, 0.2);
    behind_glass.shapes.push(sphere(centre, 0.3, glass, None));
    behind_glass.shapes.push(sphere(centre, 0.05, 0, Some(50.0)));
    scenes.push(("an emitter in glass", behind_glass));
    scenes
}

#[test]
fn hostile_scenes_give_finite_images() {
    for (name, description) in hostile_scenes() {
        let scene = Scene::new(&description).unwrap();
        let motion = CameraMotion::translation(Vec3::new(0.05, 0.0, -0.02)).unwrap();
        let world = SceneWorld::new(&scene, scene.emitters_by_power());
        for (method, mut frames_of) in methods(&world, motion) {
            let images = frames(&mut *frames_of, 3);
            let finite = images.iter().flatten().all(|value| value.is_finite());
            assert!(finite, "{name} by {method}");
            let lit = images.iter().flatten().any(|&value| value != Rgb::ZERO);
            assert!(
                lit || !matches!(name, "cornell" | "a million to one"),
                "{name} by {method}"
            );
            assert!(!lit || name != "black", "{name} by {method}");
        }
    }
}

/// The same seed, the same bits, whatever the number of threads; and another seed, another image.
#[test]
fn frames_do_not_depend_on_threads() {
    let scene = every_emitter(33, 4);
    let motion = CameraMotion::translation(Vec3::new(0.02, 0.0, 0.0)).unwrap();
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let render = |index: usize, threads, seed| {
        let (name, mut method) = methods(&world, motion).swap_remove(index);
        let options = RenderOptions {
            seed,
            threads,
            ..RenderOptions::new(33, 33, Budget::Samples(3))
        };
        let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false)).unwrap();
        (name, outcome.film.mean_image(), outcome.rays)
    };
    for index in 0..methods(&world, motion).len() {
        let [one, three, other] =
            [(1, 8), (3, 8), (1, 9)].map(|(threads, seed)| render(index, threads, seed));
        assert!(one == three, "{}", one.0);
        assert!(one.1 != other.1, "{}", one.0);
    }
}

/// No ray is traced that cannot matter.
#[test]
fn rays_are_traced_for_light_only() {
    let scenes = hostile_scenes();
    let (_, black) = scenes.iter().find(|(name, _)| *name == "black").unwrap();
    let scene = Scene::new(black).unwrap();
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    for (name, mut method) in methods(&world, CameraMotion::STILL) {
        let mut image = vec![Rgb::ZERO; 400];
        let counts = method
            .render_frame(0, 1, &mut image, &AtomicBool::new(false))
            .unwrap();
        assert_eq!(
            (counts.emitter, counts.reconnection, counts.replay),
            (0, 0, 0),
            "{name}"
        );
    }
}
