//! Methods with blue-noise points against path tracing with independent numbers, by ensembles of
//! seeds: the pixels of one image share one set of points, so only seeds are independent.

use super::ensemble::Ensemble;
use super::scenes::{cornell_without_light, every_emitter, small};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_integrator::{Method, Motion, PathTracer, Stage};
use lightshed_scene::{Rgb, Scene, SceneDescription, builtin};
use lightshed_testkit::check_faults;
use std::sync::atomic::AtomicBool;

const SIDE: u32 = 16;

/// What can be planted.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The points do not depend on the seed: the same error in all images.
    OneSeed,
    /// Every other column of pixels shows what its neighbour does.
    ColumnsTwice,
}

struct Planted<'a>(Box<dyn FrameMethod + 'a>, Option<Fault>);

impl FrameMethod for Planted<'_> {
    fn size(&self) -> [u32; 2] {
        self.0.size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let seed = if matches!(self.1, Some(Fault::OneSeed)) {
            7 + seed % 2
        } else {
            seed
        };
        let counts = self.0.render_frame(frame, seed, image, cancel);
        if matches!(self.1, Some(Fault::ColumnsTwice)) {
            image.chunks_exact_mut(2).for_each(|pair| pair[1] = pair[0]);
        }
        // Rays of plain samples are not counted.
        counts.map(|counts| RayCounts {
            camera: counts.camera.max(1),
            ..counts
        })
    }

    fn is_still(&self) -> bool {
        self.0.is_still()
    }
}

/// `frames` frames of `chains` seeds of each of `methods` against path tracing.
fn agree(
    name: &str,
    scene: &Scene,
    methods: &[&str],
    [chains, frames]: [u32; 2],
    fault: Option<Fault>,
) -> Result<(), String> {
    let plain = PathTracer::new(scene, scene.emitters_by_power());
    let truth = Ensemble::of_estimator(&plain, [SIDE, SIDE], 16, 240);
    let stage = &Stage::new(scene);
    for text in methods {
        let mut method: Method = text.parse().map_err(|error| format!("{text}: {error}"))?;
        method
            .set("points", "blue-noise")
            .map_err(|error| format!("{text}: {error}"))?;
        let start = || {
            let started = method.start(stage, Motion::STILL).unwrap();
            Planted(started.into_frames([SIDE, SIDE], 4), fault)
        };
        // Chains of several frames: their first one has no history.
        let found = Ensemble::of_chains(start, 0..frames, u64::from(chains), 1);
        let agreement = found.compare(&truth);
        println!("{name}, {text}: {agreement:?}");
        agreement
            .verdict()
            .map_err(|error| format!("{name}, {text}: {error}"))?;
    }
    Ok(())
}

const ALL: [&str; 6] = [
    "path",
    "path-reuse",
    "restir-pt",
    "restir-pt-offline",
    "restir-suffix",
    "mcmm",
];
const DIRECT: [&str; 3] = ["direct", "direct:4:bvh", "restir-di"];

fn with_depth(mut description: SceneDescription, depth: u32) -> SceneDescription {
    description.settings.max_depth = Some(depth);
    description
}

/// Paths, and a chain and direct light in the scene with every emitter.
#[test]
fn methods_agree_in_two_scenes() {
    let glossy = with_depth(cornell_without_light(builtin::cornell_glossy(), SIDE), 4);
    let glossy = Scene::new(&glossy).unwrap();
    check_faults(&[Fault::OneSeed, Fault::ColumnsTwice], |fault| {
        agree("cornell-glossy", &glossy, &["path"], [160, 1], fault)
    })
    .unwrap();
    agree(
        "cornell-glossy",
        &glossy,
        &["path-reuse", "restir-pt"],
        [60, 3],
        None,
    )
    .unwrap();
    let emitters = every_emitter(SIDE, 2);
    agree(
        "every emitter",
        &emitters,
        &["direct", "restir-di"],
        [100, 3],
        None,
    )
    .unwrap();
}

/// All methods in six scenes: `cargo test --release -p lightshed-integrator --test it -- --ignored
/// points --nocapture`.
#[test]
#[ignore = "takes minutes"]
fn all_methods_agree_in_six_scenes() {
    let scenes = [
        ("cornell", builtin::cornell()),
        ("cornell-glossy", builtin::cornell_glossy()),
        ("doorway", builtin::doorway()),
        ("many-lights", builtin::many_lights()),
        ("furnace", builtin::furnace()),
    ];
    for (name, description) in scenes {
        for (depth, methods) in [(4, &ALL[..]), (2, &DIRECT[..])] {
            let scene = small(with_depth(description.clone(), depth), SIDE);
            agree(name, &scene, methods, [120, 4], None).unwrap();
        }
    }
    agree("every emitter", &every_emitter(SIDE, 4), &ALL, [120, 4], None).unwrap();
    agree("every emitter", &every_emitter(SIDE, 2), &DIRECT, [120, 4], None).unwrap();
}
