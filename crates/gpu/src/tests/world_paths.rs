//! Paths in cells of space: images have the expectation of paths.

use crate::programs::{RESTIR_PT, RESTIR_PT_WORLD};
use crate::tests::support::{Chains, faulty, gpu, host_means, planted, under_the_sky};
use crate::tests::world::few_cells;
use crate::{Gpu, GpuMethod, GpuRestirPt, GpuScene};
use lightshed_film::PixelEstimator;
use lightshed_integrator::{PathMapping, PathTracer, RestirPtOptions};
use lightshed_scene::{EmitterDescription, Rgb, Scene, SceneDescription, builtin};
use lightshed_testkit::MeanTest;

const SIDE: u32 = 32;
/// Frames of a chain.
const FRAMES: u32 = 4;

fn sized(mut description: SceneDescription) -> Scene {
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    Scene::new(&description).expect("built-in scenes are sound")
}

fn method<'a>(
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    (mapping, both): (PathMapping, bool),
    world: &str,
) -> GpuRestirPt<'a> {
    let options = RestirPtOptions::real_time(mapping).with_world(few_cells(), both);
    GpuRestirPt::of_programs(gpu, scene, options, [RESTIR_PT, world]).expect("the program is sound")
}

/// The host's reflected light.
fn by_paths(scene: &Scene, images: u32) -> MeanTest {
    let all = PathTracer::new(scene, scene.emitters_by_power());
    let seen = PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
    host_means([SIDE; 2], images, |x, y, index| {
        all.sample(x, y, index, 5) - seen.sample(x, y, index, 5)
    })
}

/// Means of images by z-tests at 1e-4 each: cells alone, and before neighbours. Programs with a
/// fault in what cells merge or pixels read are noticed.
#[test]
fn images_with_cells_have_the_expectation_of_paths() {
    let Some(gpu) = gpu() else { return };
    let faults = [
        // Samples are carried without their Jacobian to cells.
        ["m * weight * image.jacobian, 0.0", "m * weight, 0.0"],
        // Where the site moves, nothing is canonical.
        [
            "select(is_held, i == package_world_memory_world.each, moves)",
            "(is_held && !moves)",
        ],
    ];
    let mut lit_from_around = builtin::cornell_glossy();
    lit_from_around.emitters.push(EmitterDescription::Constant {
        radiance: Rgb::new(0.3, 0.4, 0.6),
    });
    for (name, description, mapping) in [
        (
            "cornell-glossy",
            under_the_sky(builtin::cornell_glossy()),
            PathMapping::Hybrid,
        ),
        ("cornell-glossy", lit_from_around, PathMapping::Reconnection),
    ] {
        let scene = sized(description);
        let truth = by_paths(&scene, 300);
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        let seen = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
        let chains = Chains {
            counted: 0..FRAMES,
            known: &|[x, y], frame, seed| seen.sample(x, y, frame, seed),
        };
        for both in [false, true] {
            // Shifts by reconnection alone are part of the hybrid ones.
            if both && mapping == PathMapping::Reconnection {
                continue;
            }
            let mut sound = method(gpu, &on_device, (mapping, both), RESTIR_PT_WORLD);
            assert!(chains.agree(name, &mut sound, 20, &truth), "{name}, both {both}");
        }
        if mapping == PathMapping::Hybrid {
            continue;
        }
        for &fault in planted(gpu, &faults) {
            let program = faulty(RESTIR_PT_WORLD, fault);
            let mut planted = method(gpu, &on_device, (mapping, false), &program);
            assert!(chains.differ(&mut planted, 24, &truth), "{fault:?}");
        }
    }
}

/// The same images for the same seed, though threads take visitors in any order.
#[test]
fn frames_of_paths_do_not_depend_on_the_order_of_threads() {
    let Some(gpu) = gpu() else { return };
    let scene = sized(builtin::cornell_glossy());
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    let mut method = method(gpu, &on_device, (PathMapping::Hybrid, true), RESTIR_PT_WORLD);
    let mut frames = || -> Vec<Vec<[f32; 3]>> {
        let frames = 0..FRAMES;
        frames
            .map(|frame| method.frame(frame, 3).expect("the device answers").0)
            .collect()
    };
    let first = frames();
    assert!(first.iter().flatten().any(|pixel| pixel[1] > 0.0));
    assert!(first == frames());
}
