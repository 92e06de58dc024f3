//! What is chosen, and that it depends on nothing but the scene and what is asked.

use super::{Auto, AutoTask, Choice, MethodRequest, TailBound};
use lightshed_sampling::CounterRng;
use lightshed_scene::{Scene, builtin};
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

/// Enough for a pilot of eight paths in each of some thousand pixels.
const ENOUGH: u32 = 1200;

/// Every figure of the trials is the same for any number of threads; a pilot is worth its name.
#[test]
fn the_choice_does_not_depend_on_threads() {
    let one = choose("auto", "corridor", ENOUGH, 1);
    let three = choose("auto", "corridor", ENOUGH, 3);
    assert!(one.trials.len() >= 3, "{:?}", one.trials);
    assert_eq!(one.trials, three.trials);
    assert_eq!((&one.method, &one.why), (&three.method, &three.why));
    // Light around corners is what tiles are for.
    assert_eq!(one.method.name(), "path-reuse", "{:?}", one.trials);
    let pilot = one.pilot.unwrap();
    assert!(
        pilot.size[0] * pilot.size[1] >= 1000 && pilot.size[0] <= 48,
        "{pilot:?}"
    );
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

#[test]
fn options_that_are_given_hold() {
    let of = |text: &str| choose(text, "many-lights", ENOUGH, 0);
    let given = of("auto:lights=tree");
    assert_eq!(given.method.to_string(), "path:tree");
    assert!(given.trials.is_empty(), "there is nothing to choose");
    // Direct light of a thousand lamps: a tree has a fraction of the error.
    let free = of("auto:visible=paths");
    assert_eq!(free.trials.len(), 2);
    assert!(
        free.trials
            .iter()
            .all(|trial| trial.method.to_string().ends_with(":paths"))
    );
    assert!(free.left_out.iter().any(|left| left.method == "path-reuse"));
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
    for text in [
        "auto:smis=spatial",
        "auto:lights=nearest",
        "auto:light-samples=2",
        "auto:lights",
    ] {
        assert!(text.parse::<MethodRequest>().is_err(), "{text}");
    }
}

/// Errors of a candidate with rare outliers, none of which the pilot has met yet, and of one with
/// a greater typical error: the means mislead in two of three pilots, the bounds seldom.
#[test]
fn heavy_tails_are_not_chosen() {
    // Pareto values of shape 1.05 have no mean at all.
    let values = |seed: u64, of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let mut rng = CounterRng::new(seed, 0, 0);
        (0..1500)
            .map(|_| of(f64::from(rng.next_2d()[0]).max(1e-9)))
            .collect()
    };
    let (mut misled, mut chosen) = (0, 0);
    for seed in 0..40 {
        let heavy = TailBound::of(&mut values(2 * seed, &|u| u.powf(-1.05)));
        // Squares of normal errors are much like this: exponential.
        let plain = TailBound::of(&mut values(2 * seed + 1, &|u| -16.0 * u.ln()));
        misled += u32::from(heavy.mean < plain.mean);
        chosen += u32::from(heavy.bound < plain.bound);
        assert!(plain.bound < 1.35 * plain.mean, "{plain:?}");
    }
    assert!(misled >= 15 && chosen <= 8, "{misled} {chosen}");
}
