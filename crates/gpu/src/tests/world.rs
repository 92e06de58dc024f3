//! Reservoirs in cells of space: pixels have the host's cells, and images have the expectation of
//! paths.

use crate::programs::{RESTIR_DI, RESTIR_DI_WORLD};
use crate::tests::support::{Chains, exact_gpu, faulty, gpu, host_means, planted};
use crate::{Gpu, GpuError, GpuMethod, GpuRestirDi, GpuScene, GpuStage};
use glam::Vec3;
use lightshed_film::{FrameMethod, PixelEstimator};
use lightshed_integrator::spatial::{HashGrid, SurfaceSite};
use lightshed_integrator::{Method, PathTracer, RestirDi, RestirDiSettings, WorldReuse};
use lightshed_scene::{Hit, Ray, Rgb, Scene, SceneDescription, builtin};
use lightshed_testkit::MeanTest;
use std::sync::atomic::AtomicBool;

const SIDE: u32 = 32;
/// Frames of a chain, of which the last counts.
const FRAMES: u32 = 5;

fn sized(mut description: SceneDescription) -> Scene {
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    Scene::new(&description).expect("built-in scenes are sound")
}

/// Cells for small images and short chains.
pub(crate) fn few_cells() -> WorldReuse {
    let mut reuse = WorldReuse::default();
    reuse.slots = 1 << 10;
    reuse.cell_pixels = 8.0;
    // Sites move within a chain.
    reuse.renewal = 4;
    reuse
}

fn settings(both: bool) -> RestirDiSettings {
    RestirDiSettings::UNBIASED.with_world(few_cells(), both)
}

fn method<'a>(gpu: &'a Gpu, scene: &'a GpuScene, both: bool, world: &str) -> GpuRestirDi<'a> {
    let method = GpuRestirDi::of_programs(gpu, scene, settings(both), false, [RESTIR_DI, world])
        .expect("the program is sound");
    let (pixels, slots) = (u64::from(SIDE * SIDE), 1 << 10);
    // All pixels may visit a cell of their own, which has 8 + 16 inputs.
    let cells = 40 * pixels + (56 + 8 * 48) * slots + (16 + 24 * 48) * pixels.min(slots);
    let rest = method.bytes() - GpuRestirDi::BYTES_PER_PIXEL * pixels - cells;
    assert!(rest < 1024, "{rest} bytes more");
    method
}

/// The cells of what the device's pixels see are those of the host, in the same slots.
#[test]
fn pixels_have_the_cells_of_the_host() {
    let Some(gpu) = exact_gpu() else { return };
    let scene = sized(builtin::cornell_glossy());
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    let reuse = settings(false).world.expect("it has cells");
    let agree = |program: &str| {
        let mut method = method(gpu, &on_device, false, program);
        let mut grid = HashGrid::new(reuse.cells(&scene), reuse.slots).expect("options are sound");
        (0..4).all(|frame| {
            method.frame(frame, 7).expect("the device answers");
            let (table, primaries) = method.cells(frame).expect("it has cells");
            let count = (SIDE * SIDE) as usize;
            let seen: Vec<[u32; 8]> = gpu.read(primaries, count).expect("the device answers");
            for words in seen.iter().filter(|words| words[1] != u32::MAX) {
                let number = |k: usize| f32::from_bits(words[k]);
                let hit = Hit {
                    t: number(0),
                    primitive: words[1],
                    barycentric: [number(2), number(3)],
                };
                let direction = Vec3::new(number(4), number(5), number(6));
                let ray = Ray::new(scene.camera().ray(Default::default(), [0.5; 2]).origin, direction);
                let point = scene.surface(&ray, &hit);
                let normal = match point.geometric_normal.dot(direction) <= 0.0 {
                    true => point.geometric_normal,
                    false => -point.geometric_normal,
                };
                grid.claim(&SurfaceSite::new(point.position, normal).with_eye_distance(hit.t));
            }
            grid.table.settle(|_| ());
            grid.table.evict(reuse.max_age, |_| ());
            let found: Vec<u64> = gpu.read(&table.words, table.slots()).expect("the device answers");
            assert!(found.iter().filter(|word| **word != 0).count() > 20);
            found == grid.table.words().collect::<Vec<_>>()
        })
    };
    assert!(agree(RESTIR_DI_WORLD));
    // Cells of the side that is not seen.
    let faults = [["-seen.direction) >= 0.0", "-seen.direction) < 0.0"]];
    for &fault in planted(gpu, &faults) {
        assert!(!agree(&faulty(RESTIR_DI_WORLD, fault)));
    }
}

/// The same images for the same seed, though threads take visitors in any order.
#[test]
fn frames_do_not_depend_on_the_order_of_threads() {
    let Some(gpu) = gpu() else { return };
    let scene = sized(builtin::many_lights());
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    for both in [false, true] {
        let mut method = method(gpu, &on_device, both, RESTIR_DI_WORLD);
        let mut frames = || -> Vec<Vec<[f32; 3]>> {
            let frames = 0..4;
            frames
                .map(|frame| method.frame(frame, 3).expect("the device answers").0)
                .collect()
        };
        let first = frames();
        assert!(first.iter().flatten().any(|pixel| pixel[1] > 0.0));
        assert!(first == frames());
    }
}

/// The host's reflected direct light, by paths of two edges.
fn by_paths(scene: &Scene, images: u32) -> MeanTest {
    let [two, one] = [2, 1]
        .map(|depth| PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(depth), u32::MAX));
    host_means([SIDE; 2], images, |x, y, index| {
        two.sample(x, y, index, 5) - one.sample(x, y, index, 5)
    })
}

/// Means of images by z-tests at 1e-4 each: cells alone, and before neighbours. Programs with a
/// fault in what cells merge or pixels read are noticed.
#[test]
fn images_have_the_expectation_of_direct_light() {
    let Some(gpu) = gpu() else { return };
    let faults = [
        // Neighbours are trusted as if they could have produced everything; or the canonical ones
        // as if nobody else could.
        ["* fraction;", "* 0.0;"],
        [
            "fraction = package_lightshed_mis_share(p, p + theirs);",
            "fraction = 1.0;",
        ],
        // Each reservoir of a cell counts as much as all of them.
        ["held / f32(package_world_memory_world.each)", "held"],
        // Where the site moves, nothing is canonical.
        [
            "select(is_held, i == package_world_memory_world.each, moves)",
            "(is_held && !moves)",
        ],
        // Weights of the reservoirs that are kept ignore the others.
        ["contributions[i] * (total / weights[i])", "contributions[i]"],
        // Readers are asked in place of sites.
        [
            "return package_world_memory_sites[package_inputs_inputs.pixels[j] / package_world_memory_world.each];",
            "return package_primaries_primaries[package_inputs_inputs.pixels[0]];",
        ],
    ];
    for (name, description) in [
        ("cornell", builtin::cornell()),
        ("many-lights", builtin::many_lights()),
    ] {
        let scene = sized(description);
        let truth = by_paths(&scene, 400);
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        let seen = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
        let chains = Chains {
            counted: FRAMES - 1..FRAMES,
            known: &|[x, y], frame, seed| seen.sample(x, y, frame, seed),
        };
        for both in [false, true] {
            let mut sound = method(gpu, &on_device, both, RESTIR_DI_WORLD);
            assert!(chains.agree(name, &mut sound, 20, &truth), "{name}, both {both}");
        }
        if name == "cornell" {
            for &fault in planted(gpu, &faults) {
                let program = faulty(RESTIR_DI_WORLD, fault);
                let mut planted = method(gpu, &on_device, false, &program);
                assert!(chains.differ(&mut planted, 40, &truth), "{fault:?}");
            }
        }
    }
}

/// Mean squared difference of the last frames of chains from the mean over many paths, where there
/// is one.
fn error(truth: &[Option<Rgb>], mut frame: impl FnMut(u32, u64) -> Vec<Rgb>) -> f64 {
    const CHAINS: u64 = 20;
    let (mut sum, mut count) = (0.0, 0);
    for seed in 50..50 + CHAINS {
        let mut last = Vec::new();
        for number in 0..FRAMES {
            last = frame(number, seed);
        }
        for (value, truth) in last.iter().zip(truth) {
            if let Some(truth) = truth {
                sum += f64::from((*value - *truth).length_squared());
                count += 1;
            }
        }
    }
    sum / f64::from(count)
}

/// Frames have the error of the host's, which depends on how far samples are trusted: what is
/// unbiased and useless is noticed.
#[test]
fn frames_have_the_error_of_the_host() {
    let Some(gpu) = gpu() else { return };
    let scene = sized(builtin::cornell());
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    let [two, one] = [2, 1]
        .map(|depth| PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(depth), u32::MAX));
    const SAMPLES: u32 = 512;
    // Where no lamp is seen.
    let mean = |i: u32| {
        let [x, y] = [i % SIDE, i / SIDE];
        let sum = |of: &PathTracer<'_>| (0..SAMPLES).map(|sample| of.sample(x, y, sample, 9)).sum::<Rgb>();
        (sum(&one) == Rgb::ZERO).then(|| sum(&two) / SAMPLES as f32)
    };
    let truth: Vec<Option<Rgb>> = (0..SIDE * SIDE).map(mean).collect();
    let mut few = settings(false);
    few.emitter_candidates = 1;
    let mut host = RestirDi::new(&scene, scene.emitters_by_power(), few).expect("settings are sound");
    let of_host = error(&truth, |frame, seed| {
        let mut image = vec![Rgb::ZERO; (SIDE * SIDE) as usize];
        host.render_frame(frame, seed, &mut image, &AtomicBool::new(false));
        image
    });
    let of = |world: &str| {
        let mut method = GpuRestirDi::of_programs(gpu, &on_device, few, false, [RESTIR_DI, world])
            .expect("the program is sound");
        error(&truth, |frame, seed| {
            let (image, _) = method.frame(frame, seed).expect("the device answers");
            image.into_iter().map(Rgb::from).collect()
        })
    };
    let sound = of(RESTIR_DI_WORLD);
    println!("{sound}, the host's {of_host}");
    assert!((sound / of_host - 1.0).abs() < 0.15);
    let faults = [
        // Nobody finds a cell; cells are not trusted.
        ["world_sited[visit.slot] = 1u", "world_sited[visit.slot] = 0u"],
        ["confidence = package_world", "confidence = 1e-3 * package_world"],
    ];
    for &fault in planted(gpu, &faults) {
        let useless = of(&faulty(RESTIR_DI_WORLD, fault));
        println!("  {useless}");
        assert!(useless > 1.2 * of_host, "{fault:?}");
    }
}

/// Cells are taken, alone and before neighbours; what the device does not do is refused by name.
#[test]
fn options_are_taken_or_refused() {
    let Some(gpu) = gpu() else { return };
    let scene = sized(builtin::cornell());
    let started = |text: &str| {
        let method: Method = text.parse().expect("it is a method");
        GpuStage::new(gpu, &scene, &method).map(|stage| stage.start().map(|_| ()))
    };
    for text in [
        "restir-di:world",
        "restir-di:both",
        "restir-di:both:lights=tree",
        "restir-di:world:world-cells=4:world-reads=8:world-cap=40:world-bring=2",
        "restir-pt:world:reconnection",
        "restir-pt:both:cap=10:world-bring=4",
    ] {
        let found = started(text);
        assert!(matches!(found, Ok(Ok(()))), "{text}: {:?}", found.err());
    }
    for (text, why) in [
        ("restir-di:world:world-bring=17", "16 pixels"),
        ("restir-di:both:world-reads=9", "8 reservoirs"),
        ("restir-pt:world:world-reads=9", "8 reservoirs"),
        ("restir-pt:both:footprint=100", "does not have"),
        ("restir-di:both:mutations=2", "does not have"),
        ("restir-di-biased:world", "not restir-di-biased"),
        ("restir-gi:world", "not restir-gi"),
    ] {
        match started(text) {
            Err(GpuError::Settings(found)) => assert!(found.contains(why), "{text}: {found}"),
            Ok(Err(GpuError::Settings(found))) => assert!(found.contains(why), "{text}: {found}"),
            Err(other) => panic!("{text}: {other}"),
            Ok(_) => panic!("{text} is taken"),
        }
    }
}
