//! ReSTIR DI against direct light.

use super::ensemble::Ensemble;
use super::scenes::{cornell_without_light, every_emitter, small};
use crate::misstated::Misstated;
use lightshed_integrator::{
    CameraMotion, DirectLight, DirectLightOptions, LightChoosing, LightSelection, RestirDi, RestirDiError,
    RestirDiSettings,
};
use lightshed_sampling::PointSet;
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{Scene, builtin};
use lightshed_testkit::check_faults;

/// Cheap enough for a test, with every kind of reuse.
pub fn settings() -> RestirDiSettings {
    let mut settings = RestirDiSettings::UNBIASED;
    settings.emitter_candidates = 3;
    settings.radius_pixels = 6.0;
    settings.spatial_rounds = 2;
    settings
}

pub fn truth(scene: &Scene, images: u32) -> Ensemble {
    let size = [scene.settings().width, scene.settings().height];
    Ensemble::of_estimator(
        &DirectLight::new(scene, scene.emitters_by_power(), DirectLightOptions::default()).unwrap(),
        size,
        16,
        images,
    )
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Weights that ask nobody, and targets without occlusion.
    Biased,
    Density,
}

/// Steps of Markov chains and reuse in pairs leave the expectation alone. Every kind of emitter is
/// stepped on.
#[test]
fn decorrelated_frames_agree_with_direct_light() {
    let scene = every_emitter(32, 2);
    let truth = truth(&scene, 100);
    let mut settings = settings();
    (settings.mutations, settings.pairs) = (2, Some(8));
    let make = || RestirDi::new(&scene, scene.emitters_by_power(), settings).unwrap();
    let agreement = Ensemble::of_chains(make, 1..4, 90, 1).compare(&truth);
    println!("{agreement:?}");
    agreement.verdict().unwrap();
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum LatticeFault {
    Density,
    /// Without the random shift: the same emitters in every frame.
    NotShifted,
}

/// Candidates on a lattice, with numbers of the set that the settings name.
#[test]
fn stratified_candidates_agree_with_direct_light() {
    let scene = every_emitter(32, 2);
    let truth = truth(&scene, 100);
    let mut settings = settings();
    settings.stratified = true;
    for points in [PointSet::Independent, PointSet::BlueNoise] {
        settings.points = points;
        check_faults(&[LatticeFault::Density, LatticeFault::NotShifted], |fault| {
            let by_power = scene.emitters_by_power();
            let (factor, step) = match fault {
                None => (1.0, 1),
                Some(LatticeFault::Density) => (1.05, 1),
                Some(LatticeFault::NotShifted) => (1.0, u64::MAX / 3 + 1),
            };
            let sampler = Misstated {
                factor,
                step,
                ..Misstated::nothing(&by_power)
            };
            let make = || RestirDi::new(&scene, &sampler, settings).unwrap();
            let agreement = Ensemble::of_chains(make, 1..4, 90, 1).compare(&truth);
            println!("{points:?}, {fault:?}: {agreement:?}");
            agreement.verdict()
        })
        .unwrap();
    }
}

/// Chains of four frames, those with reuse in time, in scenes with every kind of emitter and lobe.
#[test]
fn frames_agree_with_direct_light() {
    let scenes = [
        ("every emitter", every_emitter(32, 2), 90),
        (
            "cornell-glossy",
            Scene::new(&cornell_without_light(builtin::cornell_glossy(), 24)).unwrap(),
            90,
        ),
    ];
    for (name, scene, chains) in scenes {
        let truth = truth(&scene, 100);
        check_faults(&[Fault::Biased, Fault::Density], |fault| {
            let mut settings = settings();
            settings.biased = fault == Some(Fault::Biased);
            let frames = if fault == Some(Fault::Density) {
                let by_power = scene.emitters_by_power();
                let sampler = Misstated {
                    factor: 1.05,
                    ..Misstated::nothing(&by_power)
                };
                let make = || RestirDi::new(&scene, &sampler, settings).unwrap();
                Ensemble::of_chains(make, 1..4, chains, 1)
            } else {
                let make = || RestirDi::new(&scene, scene.emitters_by_power(), settings).unwrap();
                Ensemble::of_chains(make, 1..4, chains, 1)
            };
            let agreement = frames.compare(&truth);
            println!("{name}, {fault:?}: {agreement:?}");
            agreement.verdict()
        })
        .unwrap();
    }
}

/// Candidates of every light sampler, as of the scene's own table. What finds the fault with one of
/// them is the same for all.
#[test]
fn candidates_of_light_samplers_agree_with_direct_light() {
    let scene = every_emitter(32, 2);
    let truth = truth(&scene, 100);
    for choosing in LightChoosing::ALL {
        let selection = LightSelection::new(&scene, choosing).unwrap();
        let faults: &[Fault] = if choosing == LightChoosing::Uniform {
            &[Fault::Density]
        } else {
            &[]
        };
        check_faults(faults, |fault| {
            let sampler = Misstated {
                factor: if fault.is_some() { 1.1 } else { 1.0 },
                ..Misstated::nothing(&selection)
            };
            let make = || RestirDi::new(&scene, &sampler, settings()).unwrap();
            let agreement = Ensemble::of_chains(make, 1..4, 60, 1).compare(&truth);
            println!("{}, {fault:?}: {agreement:?}", choosing.name());
            agreement.verdict()
        })
        .unwrap();
    }
}

/// The last frame of a moving camera shows what a still camera there shows.
#[test]
fn frames_of_a_moving_camera_agree_with_direct_light() {
    agree_under_motion(settings());
}

/// Holds frames of a moving camera to direct light as a still camera sees it where the motion ends.
pub fn agree_under_motion(settings: RestirDiSettings) {
    let per_frame = Vec3::new(0.12, 0.03, 0.05);
    let mut there = cornell_without_light(builtin::cornell_glossy(), 24);
    let scene = Scene::new(&there).unwrap();
    there.camera.to_world = Affine3A::from_translation(per_frame * 3.0) * there.camera.to_world;
    let there = Scene::new(&there).unwrap();
    let motion = CameraMotion::translation(per_frame).unwrap();
    let make = || {
        RestirDi::new(&scene, scene.emitters_by_power(), settings)
            .unwrap()
            .with_motion(motion)
    };
    let frames = Ensemble::of_chains(make, 3..4, 150, 1);
    let agreement = frames.compare(&truth(&there, 100));
    println!("{agreement:?}");
    agreement.verdict().unwrap();
    // The control: the view has moved.
    frames.compare(&truth(&scene, 20)).verdict().unwrap_err();
}

#[test]
fn settings_out_of_range_are_refused() {
    let scene = small(builtin::cornell(), 8);
    let refused = |change: &dyn Fn(&mut RestirDiSettings)| {
        let mut settings = RestirDiSettings::default();
        change(&mut settings);
        RestirDi::new(&scene, scene.emitters_by_power(), settings)
            .err()
            .unwrap()
    };
    assert_eq!(refused(&|s| s.emitter_candidates = 0), RestirDiError::Candidates);
    assert_eq!(refused(&|s| s.spatial_rounds = 65), RestirDiError::Rounds);
    assert_eq!(
        refused(&|s| s.confidence_cap = f32::NAN),
        RestirDiError::ConfidenceCap
    );
    assert!(matches!(
        refused(&|s| s.neighbours = 0),
        RestirDiError::Pattern(_)
    ));
    let error = refused(&|s| s.radius_pixels = -1.0);
    assert!(error.to_string().contains("radius"), "{error}");
}
