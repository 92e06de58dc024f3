//! Markov chain mixtures against path tracing.

use super::ensemble::Ensemble;
use super::scenes::{cornell_without_light, every_emitter, small_description};
use lightshed_film::{Budget, FrameMethod, RenderOptions, render_frames};
use lightshed_integrator::{
    CameraMotion, LightChoosing, LightSelection, Mixture, MixtureError, MixtureOptions, MixtureSets,
    PathTracer,
};
use lightshed_resampling::Exchange;
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::import::load;
use lightshed_scene::{EmittersByPower, Geometry, Rgb, Scene, SceneDescription, builtin};
use lightshed_testkit::check_faults;
use std::sync::atomic::AtomicBool;

fn options(sets: MixtureSets, size: u32) -> MixtureOptions {
    let mut options = MixtureOptions::default();
    (options.sets, options.size) = (sets, size);
    // Small images have small windows.
    options.chains.window = 400.0;
    options
}

fn method(scene: &Scene, options: MixtureOptions) -> Mixture<'_, EmittersByPower<'_>> {
    Mixture::new(scene, scene.emitters_by_power(), options).unwrap()
}

fn truth(scene: &Scene, images: u32) -> Ensemble {
    let settings = scene.settings();
    let tracer = PathTracer::new(scene, scene.emitters_by_power());
    Ensemble::of_estimator(&tracer, [settings.width, settings.height], 16, images)
}

fn scene(mut description: SceneDescription, side: u32, max_depth: u32) -> Scene {
    description = small_description(description, side);
    description.settings.max_depth = Some(max_depth);
    Scene::new(&description).unwrap()
}

/// Temporal and spatial sets, with and without emitter samples, in scenes with every kind of
/// emitter and lobe, many lights, glass in between, and light that is scattered twice. Chains that
/// do not trade places are found.
#[test]
fn frames_agree_with_path_tracing() {
    let glossy = cornell_without_light(builtin::cornell_glossy(), 16);
    for (name, scene, sets, size, samples_emitters, chains) in [
        (
            "every emitter",
            every_emitter(16, 2),
            MixtureSets::Spatial,
            16,
            false,
            60,
        ),
        (
            "every emitter",
            every_emitter(16, 3),
            MixtureSets::Temporal,
            4,
            true,
            40,
        ),
        (
            "cornell-glossy",
            scene(glossy, 16, 2),
            MixtureSets::Temporal,
            4,
            false,
            60,
        ),
        (
            "many-lights",
            scene(builtin::many_lights(), 16, 2),
            MixtureSets::Spatial,
            32,
            true,
            60,
        ),
    ] {
        let truth = truth(&scene, 60);
        let mut options = options(sets, size);
        options.samples_emitters = samples_emitters;
        let faults: &[Exchange] = match name {
            "cornell-glossy" => &[Exchange::Kept],
            _ => &[],
        };
        check_faults(faults, |fault| {
            let make = || method(&scene, options_with(options, fault));
            let agreement = Ensemble::of_chains(make, 1..5, chains, 1).compare(&truth);
            println!("{name}, {sets:?}, {fault:?}: {agreement:?}");
            agreement.verdict()
        })
        .unwrap();
    }
}

/// Several states of a pixel, each a place of its tile. Chains that do not trade places are found.
#[test]
fn several_states_agree_with_path_tracing() {
    let glossy = cornell_without_light(builtin::cornell_glossy(), 16);
    let lit = every_emitter(16, 3);
    let glossy = scene(glossy, 16, 2);
    for (name, scene, sets, size, states, chains) in [
        ("every emitter", &lit, MixtureSets::Spatial, 16, 4, 60),
        ("every emitter", &lit, MixtureSets::Spatial, 8, 8, 40),
        ("cornell-glossy", &glossy, MixtureSets::Temporal, 4, 2, 60),
    ] {
        let truth = truth(scene, 60);
        let mut options = options(sets, size);
        (options.states, options.samples_emitters) = (states, states == 8);
        let faults: &[Exchange] = match name {
            "cornell-glossy" => &[Exchange::Kept],
            _ => &[],
        };
        check_faults(faults, |fault| {
            let make = || method(scene, options_with(options, fault));
            let agreement = Ensemble::of_chains(make, 1..5, chains, 1).compare(&truth);
            println!("{name}, {sets:?}, {states} states, {fault:?}: {agreement:?}");
            agreement.verdict()
        })
        .unwrap();
        let mut one = method(scene, options);
        let mut image = vec![Rgb::ZERO; 16 * 16];
        one.render_frame(0, 1, &mut image, &AtomicBool::new(false))
            .unwrap();
        assert_eq!(one.states().len(), 16 * 16 * states as usize);
    }
}

fn options_with(mut options: MixtureOptions, fault: Option<Exchange>) -> MixtureOptions {
    options.exchange = fault.unwrap_or_default();
    options
}

/// The same in large, by both kinds of sets, in the scenes that mixtures are for and in others.
/// Minutes each:
/// `cargo test --release -p lightshed-integrator --test it -- --ignored mixtures --nocapture`.
fn agrees_at_length(name: &str, scene: &Scene) {
    let truth = truth(scene, 300);
    for sets in [(MixtureSets::Temporal, 8), (MixtureSets::Spatial, 32)] {
        agrees_with(name, scene, &truth, sets, false).unwrap();
    }
}

/// Whether frames 4 to 11 of 150 chains agree with the truth.
fn agrees_with(
    name: &str,
    scene: &Scene,
    truth: &Ensemble,
    (sets, size): (MixtureSets, u32),
    samples_emitters: bool,
) -> Result<(), String> {
    let mut options = options(sets, size);
    options.samples_emitters = samples_emitters;
    let agreement = Ensemble::of_chains(|| method(scene, options), 4..12, 150, 1).compare(truth);
    println!("{name}, {sets:?}, emitter samples {samples_emitters}: {agreement:?}");
    agreement.verdict()
}

/// By candles, a test needs samples whose variance it can estimate. Two ten-thousandths of the
/// directions of a BSDF meet a flame, and those that meet one that no lobe covers are nearly all of
/// the variance: even plain paths that leave emitters to the BSDF fail this test, by a score of 30.
/// So flames have eight times their radius and the same power, or emitter samples are merged.
#[test]
#[ignore = "takes minutes"]
fn mixtures_agree_under_candles() {
    let bvh = |scene: &Scene| {
        let selection = LightSelection::new(scene, LightChoosing::Bvh).unwrap();
        let settings = scene.settings();
        let size = [settings.width, settings.height];
        Ensemble::of_estimator(&PathTracer::new(scene, &selection), size, 16, 300)
    };
    let candles = scene(builtin::candles(), 32, 2);
    let expected = bvh(&candles);
    for sets in [(MixtureSets::Temporal, 8), (MixtureSets::Spatial, 32)] {
        agrees_with("candles", &candles, &expected, sets, true).unwrap();
    }
    // The control: rare flames.
    let unfound = LightSelection::new(&candles, LightChoosing::Unfound).unwrap();
    let rare =
        Ensemble::of_estimator(&PathTracer::new(&candles, &unfound), [32; 2], 64, 150).compare(&expected);
    println!("candles, paths without a list: {rare:?}");
    rare.verdict().unwrap_err();

    let mut large = builtin::candles();
    for shape in &mut large.shapes {
        if let (Some(emission), Geometry::Mesh(mesh)) = (&mut shape.emission, &mut shape.geometry) {
            let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
            mesh.positions
                .iter_mut()
                .for_each(|p| *p = middle + 8.0 * (*p - middle));
            *emission /= 64.0;
        }
    }
    let large = scene(large, 32, 2);
    let expected = bvh(&large);
    for sets in [(MixtureSets::Temporal, 8), (MixtureSets::Spatial, 32)] {
        agrees_with("large flames", &large, &expected, sets, false).unwrap();
    }
}

#[test]
#[ignore = "takes minutes; the test above is its short form"]
fn mixtures_agree_in_the_cornell_box() {
    agrees_at_length("cornell", &scene(builtin::cornell(), 32, 4));
}

#[test]
#[ignore = "takes minutes"]
fn mixtures_agree_under_many_lights() {
    agrees_at_length("many-lights", &scene(builtin::many_lights(), 32, 2));
}

#[test]
#[ignore = "takes minutes"]
fn mixtures_agree_in_the_pool() {
    agrees_at_length("pool", &scene(builtin::pool(), 32, 3));
}

/// A published scene, if `LIGHTSHED_SCENES` names their folder.
#[test]
#[ignore = "takes minutes"]
fn mixtures_agree_behind_a_door_ajar() {
    let Some(folder) = std::env::var_os("LIGHTSHED_SCENES") else {
        return;
    };
    let file = std::path::Path::new(&folder).join("veach_ajar/scene.xml");
    let loaded = load(file, &[]).unwrap_or_else(|error| panic!("{}", error.chain()));
    agrees_at_length("veach_ajar", &scene(loaded.description, 32, 6));
}

/// The last frame of a moving camera shows what a still camera there shows.
#[test]
fn frames_of_a_moving_camera_agree_with_path_tracing() {
    let per_frame = Vec3::new(0.12, 0.03, 0.05);
    let mut there = cornell_without_light(builtin::cornell(), 16);
    there.settings.max_depth = Some(2);
    let scene = Scene::new(&there).unwrap();
    there.camera.to_world = Affine3A::from_translation(per_frame * 3.0) * there.camera.to_world;
    let there = Scene::new(&there).unwrap();
    let motion = CameraMotion::translation(per_frame).unwrap();
    let make = || method(&scene, options(MixtureSets::Temporal, 4)).with_motion(motion);
    let frames = Ensemble::of_chains(make, 3..4, 100, 1);
    let agreement = frames.compare(&truth(&there, 60));
    println!("{agreement:?}");
    agreement.verdict().unwrap();
    // The control: the view has moved.
    frames.compare(&truth(&scene, 20)).verdict().unwrap_err();
}

/// Frames have the same bits for one, two and seven threads, and the same again.
#[test]
fn frames_do_not_depend_on_threads() {
    let scene = scene(builtin::cornell_glossy(), 13, 3);
    for (sets, states) in [
        (MixtureSets::Temporal, 1),
        (MixtureSets::Spatial, 1),
        (MixtureSets::Spatial, 2),
    ] {
        let mut options = options(sets, 8);
        options.states = states;
        let mut method = method(&scene, options);
        let mut rendered = |threads| {
            let mut render = RenderOptions::new(13, 13, Budget::Samples(4));
            (render.threads, render.seed) = (threads, 5);
            let outcome = render_frames(&mut method, &render, &|_| (), &AtomicBool::new(false)).unwrap();
            outcome.film.mean_image()
        };
        let one = rendered(1);
        assert!(one == rendered(2) && one == rendered(7), "{sets:?}");
    }
}

#[test]
fn wrong_options_are_refused() {
    let scene = scene(builtin::cornell(), 8, 2);
    let refused = |change: &dyn Fn(&mut MixtureOptions)| {
        let mut options = MixtureOptions::default();
        change(&mut options);
        Mixture::new(&scene, scene.emitters_by_power(), options)
            .err()
            .unwrap()
    };
    assert_eq!(refused(&|o| o.size = 12), MixtureError::Size(12));
    assert_eq!(refused(&|o| o.steps = 65), MixtureError::Steps(65));
    assert_eq!(refused(&|o| o.states = 3), MixtureError::States(3));
    assert_eq!(refused(&|o| (o.size, o.states) = (4, 8)), MixtureError::States(8));
    let error = refused(&|o| o.chains.defensive_share = 0.0);
    assert!(error.to_string().contains("defensive_share"), "{error}");
    assert!("both".parse::<MixtureSets>().is_err());
}
