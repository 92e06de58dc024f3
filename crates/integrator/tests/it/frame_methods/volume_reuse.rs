//! Path reuse through media against path tracing through media.

use super::ensemble::Ensemble;
use lightshed_integrator::{LightChoosing, LightSelection, VolumePathReuse, VolumePathTracer};
use lightshed_sampling::PointSet;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    EmitterDescription, Geometry, Material, PhaseDescription, Rgb, Scene, SceneDescription, ShapeDescription,
    SphereGeometry, builtin,
};

/// A built-in scene in small, with the given asymmetry and longest path.
fn small(mut description: SceneDescription, side: u32, g: f32, depth: u32) -> SceneDescription {
    (description.settings.width, description.settings.height) = (side, side);
    description.settings.max_depth = Some(depth);
    description.media[0].phase = PhaseDescription::HenyeyGreenstein { g };
    description
}

/// A cloud from near by.
fn cloud(g: f32, depth: u32) -> SceneDescription {
    let mut scene = small(builtin::cloud(), 16, g, depth);
    scene.camera.fov_x = 0.4;
    scene
}

/// Grey flames, which scatter much.
fn fire(depth: u32) -> SceneDescription {
    let mut scene = small(builtin::fire(), 16, 0.5, depth);
    scene.media[0].extinction = Rgb::splat(5.0);
    scene.media[0].albedo = Rgb::splat(0.8);
    scene
}

/// From near enough that the lamp is not in view.
fn smoke(g: f32, depth: u32) -> SceneDescription {
    let mut scene = small(builtin::smoke_in_cornell(), 16, g, depth);
    scene.camera.fov_x = 0.4;
    scene.media[0].extinction *= 2.0;
    scene
}

/// A cloud with a ball of light in it that lets light pass, and a lamp without size.
fn lamps() -> SceneDescription {
    let mut scene = cloud(0.8, 5);
    let null = scene.materials.len() as u32;
    scene.materials.push(Material::Null);
    scene.shapes.push(ShapeDescription {
        name: "ball".to_owned(),
        geometry: Geometry::Sphere(SphereGeometry {
            center: Vec3::new(0.1, 1.6, 0.2),
            radius: 0.6,
            flip_normals: false,
        }),
        material: null,
        emission: Some(Rgb::splat(12.0)),
    });
    scene.emitters.push(EmitterDescription::Point {
        position: Vec3::new(0.4, -1.2, 0.9),
        intensity: Rgb::splat(1.0),
    });
    scene
}

/// Frames, and frames of stratified numbers. A sound method fails a case with a probability of
/// about 1e-5.
#[test]
fn frames_agree_with_path_tracing_through_media() {
    let mut ending = cloud(0.3, 8);
    ending.settings.roulette_depth = 1;
    ending.media[0].albedo = Rgb::new(0.9, 0.6, 0.7);
    let cases = [
        ("cloud", cloud(0.0, 8), 100),
        ("cloud, forward", cloud(0.8, 4), 100),
        ("cloud, two edges", cloud(0.3, 2), 100),
        ("cloud, roulette", ending, 100),
        ("lamps", lamps(), 100),
        ("smoke", smoke(0.6, 5), 100),
        ("grey fire", fire(4), 100),
        ("fire", small(builtin::fire(), 16, 0.8, 4), 70),
    ];
    for (name, description, count) in cases {
        let scene = Scene::new(&description).unwrap();
        let truth = |depth| {
            let tracer = VolumePathTracer::new(&scene, scene.emitters_by_power())
                .with_depths(Some(depth), scene.settings().roulette_depth);
            Ensemble::of_estimator(&tracer, [16, 16], 16, 40)
        };
        let depth = scene.settings().max_depth.unwrap();
        let plain = || VolumePathReuse::new(&scene, scene.emitters_by_power());
        let stratified = || plain().with_points(PointSet::Sobol);
        let expected = truth(depth);
        for frames in [
            Ensemble::of_chains(plain, 0..4, count, 1),
            Ensemble::of_chains(stratified, 0..8, count, 5000),
        ] {
            let agreement = frames.compare(&expected);
            println!("{name}: {agreement:?}");
            agreement.verdict().unwrap();
            // The control: an edge less.
            if name == "cloud, forward" {
                frames.compare(&truth(depth - 1)).verdict().unwrap_err();
            }
        }
    }
}

/// Emitters chosen for the point that they light: densities depend on it. At the rate of the test
/// above.
#[test]
fn frames_agree_with_emitters_by_a_tree() {
    let scene = Scene::new(&lamps()).unwrap();
    let tree = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
    let tracer = VolumePathTracer::new(&scene, scene.emitters_by_power());
    let frames = Ensemble::of_chains(|| VolumePathReuse::new(&scene, &tree), 0..4, 150, 9);
    let agreement = frames.compare(&Ensemble::of_estimator(&tracer, [16, 16], 16, 40));
    println!("{agreement:?}");
    agreement.verdict().unwrap();
}
