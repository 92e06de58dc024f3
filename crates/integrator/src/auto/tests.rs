//! What is chosen, and that it depends on nothing but the scene and what is asked.

use super::choice::roundest;
use super::{Auto, AutoTask, Choice, MethodRequest, Trial};
use lightshed_scene::glam::Vec3A;
use lightshed_scene::{
    ColorTexture, Geometry, Material, Rgb, Scene, SceneDescription, ShapeDescription, SphereGeometry, builtin,
};
use std::sync::atomic::AtomicBool;

fn scene(name: &str) -> Scene {
    let mut description = builtin::by_name(name).unwrap();
    (description.settings.width, description.settings.height) = (48, 32);
    Scene::new(&description).unwrap()
}

fn auto(text: &str) -> Auto {
    match text.parse() {
        Ok(MethodRequest::Auto(auto)) => auto,
        other => panic!("{text}: {other:?}"),
    }
}

fn choose(text: &str, name: &str, samples: u32, threads: usize) -> Choice {
    let task = AutoTask {
        threads,
        ..AutoTask::new([48, 32], samples)
    };
    let mut scene = scene(name);
    let before = format!("{:?}{:?}", scene.camera(), scene.settings());
    let choice = auto(text)
        .choose(&mut scene, &task, &AtomicBool::new(false))
        .unwrap();
    assert_eq!(
        before,
        format!("{:?}{:?}", scene.camera(), scene.settings()),
        "the scene stays as it was"
    );
    choice
}

/// Enough for a pilot of some paths in each of a thousand pixels.
const ENOUGH: u32 = 700;

/// Every figure of the trials is the same for any number of threads; a pilot is worth its name.
#[test]
fn the_choice_does_not_depend_on_threads() {
    let one = choose("auto", "corridor", ENOUGH, 1);
    let three = choose("auto", "corridor", ENOUGH, 3);
    assert_eq!(one.trials.len(), 2, "{:?}", one.trials);
    // Where nothing is smooth, nothing is left for resampling.
    assert!(
        one.left_out
            .iter()
            .any(|left| left.why.contains("nothing is smooth"))
    );
    assert_eq!(one.trials, three.trials);
    assert_eq!((&one.method, &one.why), (&three.method, &three.why));
    // Light around corners is what sharing is for.
    assert_eq!(one.method.name(), "path-reuse", "{:?}", one.trials);
    // As much work as the paths: fewer frames.
    let chosen = one
        .trials
        .iter()
        .find(|trial| trial.method == one.method)
        .unwrap();
    let cost = chosen.cost / one.trials[0].cost;
    assert!((1.01..2.0).contains(&cost), "{cost}");
    assert_eq!(one.frames(ENOUGH), roundest(f64::from(ENOUGH) / cost));
    assert_eq!(one.frames(1), 1);
    let pilot = one.pilot.unwrap();
    assert!(pilot.in_blocks && pilot.size == [32, 32], "{pilot:?}");
}

#[test]
fn little_work_has_no_pilot() {
    for (name, expected) in [
        ("cornell", "path"),
        ("many-lights", "path:bvh"),
        ("cloud", "volpath"),
    ] {
        let choice = choose("auto", name, 16, 1);
        assert!(choice.pilot.is_none() && choice.trials.is_empty(), "{name}");
        assert_eq!(choice.method.to_string(), expected, "{name}");
    }
}

/// Where first collisions of neighbouring pixels are near each other, light behind them is shared.
#[test]
fn a_cloud_is_shared() {
    let mut scene = Scene::new(&builtin::cloud()).unwrap();
    let task = AutoTask::new([192, 128], 64);
    let choice = auto("auto")
        .choose(&mut scene, &task, &AtomicBool::new(false))
        .unwrap();
    assert_eq!(choice.method.name(), "volpath-reuse", "{:?}", choice.trials);
    let cost = choice.trials[1].cost / choice.trials[0].cost;
    assert!((1.1..1.6).contains(&cost), "{cost}");
}

#[test]
fn options_that_are_given_hold() {
    let of = |text: &str| choose(text, "many-lights", ENOUGH, 0);
    let given = of("auto:lights=tree");
    assert_eq!(given.method.to_string(), "path:tree");
    let by_tree = |trial: &Trial| trial.method.to_string().contains("tree");
    assert!(given.trials.len() == 2 && given.trials.iter().all(by_tree));
    // Direct light of a thousand lamps: a tree has a fraction of the error.
    let free = of("auto:visible=paths");
    assert_eq!(free.trials.len(), 3);
    assert!(
        free.trials
            .iter()
            .all(|trial| trial.method.to_string().contains(":paths"))
    );
    assert!(free.left_out.iter().any(|left| left.method == "path-reuse"));
    // Without what does not take it.
    let guided = of("auto:guide-training=2:guide=vmf");
    assert!(
        guided
            .left_out
            .iter()
            .any(|left| left.method.contains("light-samples"))
    );
    // One family takes it.
    let shifted = choose("auto:shift=reconnection", "cornell", 4, 1);
    assert_eq!(shifted.method.to_string(), "restir-pt-offline:reconnection");
    // What is biased is had by asking for it alone.
    assert!(
        choose("auto:cache=fixed", "cornell", 4, 1)
            .method
            .capabilities()
            .biased
    );
    for text in ["auto:smis=spatial", "auto:lights=nearest", "auto:lights"] {
        assert!(text.parse::<MethodRequest>().is_err(), "{text}");
    }
}

/// Where frames that share paths tell the error of plain ones, these render one sample; not if
/// sharing finds no light, and not if time is what counts.
/// Planted fault: one sample left where sharing found no light.
#[test]
fn plain_paths_are_told_by_shared_ones() {
    let plain = |turned: bool, by_clock: bool| {
        let mut description = builtin::by_name("corridor").unwrap();
        (description.settings.width, description.settings.height) = (48, 32);
        if turned {
            description.camera.to_world.translation += Vec3A::splat(1e4);
        }
        let task = AutoTask {
            by_clock,
            ..AutoTask::new([48, 32], ENOUGH)
        };
        let mut scene = Scene::new(&description).unwrap();
        let choice = auto("auto").choose(&mut scene, &task, &AtomicBool::new(false));
        choice.unwrap().trials.remove(0)
    };
    let told = plain(false, false);
    assert_eq!(told.frames, 1, "{told:?}");
    assert!(told.is_lit && told.error > 0.0);
    let dark = plain(true, false);
    assert!(!dark.is_lit && dark.frames > 1, "{dark:?}");
    assert!(plain(false, true).frames > 1);
}

/// Paths with several emitter samples have no images of their own where shared paths tell their
/// error, and are left out where other light holds too much of it. Where time is what counts they
/// have images.
#[test]
fn several_emitter_samples_are_told() {
    const TEXT: &str = "path:bvh:light-samples=4";
    let choice = |by_clock: bool| {
        let task = AutoTask {
            by_clock,
            ..AutoTask::new([48, 32], ENOUGH)
        };
        let mut scene = scene("warehouse");
        let choice = auto("auto").choose(&mut scene, &task, &AtomicBool::new(false));
        choice.unwrap()
    };
    let has_trial = |choice: &Choice| {
        let mut trials = choice.trials.iter();
        trials.any(|trial| trial.method.to_string() == TEXT)
    };
    let told = choice(false);
    assert!(!has_trial(&told));
    let left_out = told.left_out.iter().find(|left| left.method == TEXT);
    let why = left_out.map(|left| left.why.as_str());
    assert_eq!(why, Some("other light holds too much of the error"));
    assert!(has_trial(&choice(true)));
}

/// Between walls that are nearly black, several emitter samples that others tell are not left out:
/// their trial has an error and a cost of its own.
/// Planted faults: the error of one sample kept; its cost kept; its prior kept.
#[test]
fn told_emitter_samples_are_judged_like_others() {
    let mut description = builtin::by_name("candles").unwrap();
    (description.settings.width, description.settings.height) = (48, 32);
    description.settings.max_depth = Some(5);
    for material in &mut description.materials {
        if let Material::Diffuse { reflectance } = material {
            *reflectance = ColorTexture::Constant(Rgb::splat(0.02));
        }
    }
    let mut scene = Scene::new(&description).unwrap();
    let task = AutoTask::new([48, 32], ENOUGH);
    let choice = auto("auto")
        .choose(&mut scene, &task, &AtomicBool::new(false))
        .unwrap();
    let trial = |text: &str| {
        let mut trials = choice.trials.iter();
        let trial = trials.find(|trial| trial.method.to_string() == text);
        trial.unwrap_or_else(|| panic!("{text}: {:?}", choice.left_out))
    };
    let [one, several] = ["path:bvh", "path:bvh:light-samples=4"].map(trial);
    // A frame has less error, as far as lamps make it: images have 0.2 to 0.45 of it. What is not
    // certain of it counts as other light.
    let of_frame = |trial: &Trial| trial.error * f64::from(trial.frames);
    let left = of_frame(several) / of_frame(one);
    assert!((0.45..0.8).contains(&left), "{left}");
    let cost = several.cost / one.cost;
    assert!((1.5..4.0).contains(&cost), "{cost}");
    // Like those that have images, they are given what pilots do not show.
    assert!(several.prior < one.prior, "{} {}", several.prior, one.prior);
    assert!(several.short.error < 1.0, "{:?}", several.short);
}

/// Adds a ball of glass.
fn add_glass_ball(description: &mut SceneDescription, center: [f32; 3], radius: f32) {
    description.materials.push(Material::Dielectric {
        eta: 1.5,
        roughness: None,
        specular_reflectance: ColorTexture::Constant(Rgb::ONE),
        specular_transmittance: ColorTexture::Constant(Rgb::ONE),
    });
    description.shapes.push(ShapeDescription {
        name: "ball".into(),
        geometry: Geometry::Sphere(SphereGeometry {
            center: center.into(),
            radius,
            flip_normals: false,
        }),
        material: description.materials.len() as u32 - 1,
        emission: None,
    });
}

/// Beside a ball of glass the outliers of shared paths are light that the glass throws, which no
/// pixel shares with another. The pilot meets few of them.
/// Planted fault: outliers that are not shared counted as shared ones.
#[test]
fn light_that_glass_throws_is_not_shared() {
    let mut description = builtin::cornell();
    (description.settings.width, description.settings.height) = (96, 96);
    description.settings.max_depth = Some(3);
    add_glass_ball(&mut description, [0.3, -0.2, 0.4], 0.3);
    let mut scene = Scene::new(&description).unwrap();
    let task = AutoTask::new([96, 96], 400);
    let choice = auto("auto").choose(&mut scene, &task, &AtomicBool::new(false));
    let choice = choice.unwrap();
    assert_eq!(choice.method.to_string(), "path", "{:?}", choice.trials);
}

/// Where sharing wins beside something smooth, frames that also resample are taken if the pilot had
/// too few of them to judge: there, and not in an image of few of them or where nothing is smooth.
/// The work stays the same.
/// Planted faults: a frame that resamples counted as one that shares; images of few taken, too.
#[test]
fn frames_that_resample_are_taken_where_they_are_too_few_to_judge() {
    let choose = |is_smooth: bool, [width, height]: [u32; 2], samples: u32| {
        let mut description = builtin::corridor();
        (description.settings.width, description.settings.height) = (width, height);
        if is_smooth {
            add_glass_ball(&mut description, [0.0, 0.5, 0.0], 0.01);
        }
        let mut scene = Scene::new(&description).unwrap();
        let choice = auto("auto").choose(
            &mut scene,
            &AutoTask::new([width, height], samples),
            &AtomicBool::new(false),
        );
        choice.unwrap()
    };
    let [smooth, rough] = [true, false].map(|is_smooth| choose(is_smooth, [48, 32], ENOUGH));
    assert_eq!(rough.method.to_string(), "path-reuse", "{:?}", rough.trials);
    assert_eq!(
        smooth.method.to_string(),
        "restir-pt-offline",
        "{:?}",
        smooth.trials
    );
    assert!(
        smooth
            .left_out
            .iter()
            .all(|left| left.method != "restir-pt-offline")
    );
    let ratio = smooth.cost / rough.cost;
    assert!((4.0..5.0).contains(&ratio), "{ratio}");
    let frames = |choice: &Choice, samples: u32| f64::from(samples) / choice.cost;
    assert!(frames(&smooth, ENOUGH) >= 8.0);
    let few = choose(true, [192, 128], 30);
    assert_eq!(few.method.to_string(), "path-reuse", "{:?}", few.trials);
    assert!(frames(&few, 30) < 36.0);
}

/// A chain that has found light which few paths find is judged by that light, in larger images as
/// well, of which the pilot sees a small part: images by it have a tenth of the relative error.
/// Planted fault: each image with the same share in the brightness that errors refer to.
#[test]
fn chains_win_where_paths_miss_light() {
    for size in [[112, 112], [192, 192]] {
        let mut description = builtin::pool();
        [description.settings.width, description.settings.height] = size;
        let mut scene = Scene::new(&description).unwrap();
        let choice = auto("auto").choose(&mut scene, &AutoTask::new(size, 190), &AtomicBool::new(false));
        let choice = choice.unwrap();
        assert_eq!(choice.method.name(), "mcmm", "{size:?}: {:?}", choice.trials);
    }
}

/// Where emitters make the error of direct light, several are sampled.
#[test]
fn several_emitters_are_sampled() {
    let mut description = builtin::by_name("warehouse").unwrap();
    (description.settings.width, description.settings.height) = (48, 32);
    description.settings.max_depth = Some(2);
    let mut scene = Scene::new(&description).unwrap();
    let task = AutoTask::new([48, 32], 2 * ENOUGH);
    let choice = auto("auto").choose(&mut scene, &task, &AtomicBool::new(false));
    let choice = choice.unwrap();
    assert_eq!(
        choice.method.to_string(),
        "path:bvh:light-samples=4",
        "{:?}",
        choice.trials
    );
}

/// Few frames show that emitters by power are far worse than by a tree; where they are not, as
/// among small lamps side by side, they have all frames of their share.
/// Planted faults: few frames always; few frames never.
#[test]
fn power_is_tried_in_part_where_a_tree_is_far_better() {
    let frames = |scene: &mut Scene, samples: u32| {
        let task = AutoTask::new([48, 32], samples);
        let plan = task.plan().unwrap();
        let choice = auto("auto").choose(scene, &task, &AtomicBool::new(false));
        let choice = choice.unwrap();
        assert_eq!(choice.trials[0].method.to_string(), "path");
        assert_eq!(choice.trials[1].method.to_string(), "path:bvh");
        ([choice.trials[0].frames, plan.samples], choice)
    };
    let mut far = scene("candles");
    let ([tried, all], choice) = frames(&mut far, 4 * ENOUGH);
    assert!(all >= 8 && tried == all.div_ceil(4), "{tried} of {all}");
    assert!(choice.trials[0].merit() > 8.0 * choice.trials[1].merit());
    let mut description = builtin::cornell();
    (description.settings.width, description.settings.height) = (48, 32);
    description.settings.max_depth = Some(2);
    for number in 0..80 {
        let [x, z] = [number % 10, number / 10].map(|n| 0.04 * n as f32 - 0.2);
        description.shapes.push(ShapeDescription {
            name: format!("lamp {number}"),
            geometry: Geometry::Sphere(SphereGeometry {
                center: [x, 0.9, z].into(),
                radius: 0.01,
                flip_normals: false,
            }),
            material: 0,
            emission: Some(Rgb::splat(100.0)),
        });
    }
    let mut near = Scene::new(&description).unwrap();
    let ([tried, all], choice) = frames(&mut near, 4 * ENOUGH);
    assert_eq!(tried, all, "{:?}", choice.trials);
}

/// A candidate that found no light in the pilot has no error, and is the worst all the same.
#[test]
fn darkness_has_no_merit() {
    let choice = choose("auto", "corridor", ENOUGH, 2);
    let lit = &choice.trials[0];
    let dark = Trial {
        error: 0.0,
        relative: 0.0,
        is_lit: false,
        ..lit.clone()
    };
    assert!(lit.is_lit && lit.merit().is_finite());
    assert!(dark.merit() > lit.merit());
}

/// An interruption ends the pilot, and leaves what can be said without one.
#[test]
fn pilots_are_interrupted() {
    let task = AutoTask::new([48, 32], ENOUGH);
    let choice = auto("auto").choose(&mut scene("corridor"), &task, &AtomicBool::new(true));
    let choice = choice.unwrap();
    assert!(choice.pilot.is_none() && choice.trials.is_empty() && choice.cost == 1.0);
    assert_eq!(choice.method.to_string(), "path");
}

/// Chains are tried where light goes through smooth surfaces on paths of few edges, if the work is
/// enough and its parts may follow from each other. Their trial is compared with the others'.
#[test]
fn chains_are_tried_where_they_may_learn() {
    let run = |name: &str, samples: u32, chains: bool| {
        let task = AutoTask {
            chains,
            ..AutoTask::new([48, 32], samples)
        };
        auto("auto")
            .choose(&mut scene(name), &task, &AtomicBool::new(false))
            .unwrap()
    };
    let has_chain = |choice: &Choice| choice.trials.iter().any(|trial| trial.method.name() == "mcmm");
    let tried = run("pool", 3000, true);
    assert!(has_chain(&tried), "{:?}", tried.trials);
    let chain = tried.trials.last().unwrap();
    assert!(chain.prior <= 1.0 && chain.prior > 0.05 && chain.error.is_finite());
    // Nothing is shared there, which pilots know for certain: so less work is enough.
    let in_parts = run("pool", 3000, false);
    assert!(!has_chain(&in_parts), "of an image in parts");
    assert_eq!(in_parts.method.name(), "path", "{:?}", in_parts.trials);
    assert!(in_parts.trials.iter().all(|trial| trial.shared < 0.02));
    assert!(has_chain(&run("pool", 1000, true)));
    assert!(!has_chain(&run("pool", 700, true)), "too little work");
    assert!(!has_chain(&run("cornell", 3000, true)), "nothing is smooth");
}
