//! Guided paths on the device are the CPU's.

use crate::programs::PATH;
use crate::tests::support::{exact_gpu, faulty, gpu, host_means, mean_luminance, planted};
use crate::{Gpu, GpuError, GpuGuidedPaths, GpuMethod, GpuPathTracer, GpuScene, GpuStage};
use lightshed_film::{FrameMethod, PixelEstimator};
use lightshed_integrator::sampling::PointSet;
use lightshed_integrator::{GuideKind, GuidedPaths, GuidedPathsOptions, Method, PathTracer, SceneField};
use lightshed_scene::{Rgb, Scene, SceneDescription, builtin};
use lightshed_testkit::MeanTest;
use std::sync::atomic::AtomicBool;

const SIDE: u32 = 64;

fn sized(mut description: SceneDescription) -> Scene {
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    description.settings.max_depth = Some(8);
    Scene::new(&description).expect("built-in scenes are sound")
}

fn options(bits: u32, training: u32) -> GuidedPathsOptions {
    let mut options = GuidedPathsOptions {
        training,
        may_drop: false,
        points: PointSet::Independent,
        // The device's roulette goes by throughput.
        worth_depth: u32::MAX,
        visible_emission: false,
        ..GuidedPathsOptions::new(GuideKind::Quadtree)
    };
    options.quadtree.bits = bits;
    options
}

/// The host's guided frames after some that trained.
fn trained(scene: &Scene, options: GuidedPathsOptions, seed: u64) -> GuidedPaths<'_, ByPower<'_>> {
    let mut method = GuidedPaths::new(scene, scene.emitters_by_power(), options).expect("options are sound");
    let mut image = vec![Rgb::ZERO; (SIDE * SIDE) as usize];
    for frame in 0..options.training {
        method
            .render_frame(frame, seed, &mut image, &AtomicBool::new(false))
            .expect("nothing cancels");
    }
    method
}

type ByPower<'a> = lightshed_scene::EmittersByPower<'a>;

/// Share of the paths of a program that are not the host's with this field: in any bit on an exact
/// device, else by more than a thousandth; so, too, with a spot, whose light falls off by a
/// polynomial. And the share of the host's that the guide has changed.
fn different(gpu: &Gpu, scene: &Scene, field: &SceneField, has_spot: bool, program: &str) -> [f64; 2] {
    let SceneField::Quadtree(quadtrees) = field else {
        panic!("it has quadtrees")
    };
    let flat = GpuScene::new(gpu, scene).expect("the scene is flat");
    let mut device = GpuPathTracer::of_program(gpu, &flat, Some(8), 12, program).expect("it is sound");
    device
        .set_guide(Some(&quadtrees.flat()), 12)
        .expect("it is small");
    let found = device.sample(5, 9).expect("the device answers");
    let plain = || PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(8), 12);
    let (host, plain) = (plain().with_guide(field), plain());
    let (mut differing, mut guided) = (0, 0);
    for (i, found) in (0..).zip(&found) {
        let truth = host.sample(i % SIDE, i / SIDE, 5, 9);
        guided += usize::from(truth != plain.sample(i % SIDE, i / SIDE, 5, 9));
        let differs = |c: usize| match has_spot {
            false => found[c].to_bits() != truth[c].to_bits(),
            true => (found[c] - truth[c]).abs() > 1e-3 * truth[c].abs() + 1e-6,
        };
        differing += usize::from((0..3).any(differs));
    }
    [differing, guided].map(|count| count as f64 / found.len() as f64)
}

/// The same bits, path by path, in scenes of diffuse, glossy, refracting and mirroring surfaces, at
/// several widths of trees. Faults are noticed: guides left out of a weight, of a density, a share
/// that is not divided by, another region, numbers that choose twice.
#[test]
fn guided_paths_are_those_of_the_cpu() {
    let Some(gpu) = exact_gpu() else { return };
    for (name, description, bits) in [
        ("cornell", builtin::cornell(), 64),
        ("cornell-glossy", builtin::cornell_glossy(), 128),
        ("glass", crate::tests::paths::glass(), 32),
        ("lighthouse", builtin::lighthouse(), 64),
    ] {
        let scene = sized(description);
        let method = trained(&scene, options(bits, 4), 3);
        let [found, guided] = different(gpu, &scene, method.field(), name == "lighthouse", PATH);
        println!("{name}: {found} differ, {guided} were guided");
        let allowed = if name == "lighthouse" { 0.05 } else { 0.0 };
        assert!(found <= allowed, "{name}: {found} of all paths differ");
        assert!(guided > 0.02, "{name}: {guided} of all paths were guided");
    }
    let scene = sized(builtin::cornell_glossy());
    let method = trained(&scene, options(64, 4), 3);
    let faults = [
        ["pdf * (1.0 - guidance.share)", "pdf"],
        ["found.pdf * own + ", "found.pdf + "],
        ["(u_lobe - share) / own", "u_lobe"],
        ["sample.weight * (sample.pdf / pdf)", "sample.weight"],
        ["4.0 / (q * q * q)", "4.0"],
    ];
    for &fault in planted(gpu, &faults) {
        let program = faulty(PATH, fault);
        let [found, _] = different(gpu, &scene, method.field(), false, &program);
        assert!(found > 0.01, "{fault:?} is not noticed: {found}");
    }
}

/// Frames of the method, trained on the host and rendered on the device, equal those of the host
/// alone to rounding; also once the guide was dropped.
#[test]
fn frames_are_those_of_the_cpu() {
    let Some(gpu) = exact_gpu() else { return };
    let cancel = AtomicBool::new(false);
    for (name, description, may_drop, frames) in [
        ("lighthouse", builtin::lighthouse(), false, 6),
        ("cornell", builtin::cornell(), true, 18),
    ] {
        let scene = sized(description);
        let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
        let options = GuidedPathsOptions {
            may_drop,
            ..options(64, if may_drop { 16 } else { 4 })
        };
        let mut device =
            GpuGuidedPaths::with_options(gpu, &scene, &flat, options).expect("the options are sound");
        let mut host =
            GuidedPaths::new(&scene, scene.emitters_by_power(), options).expect("options are sound");
        let mut truth = vec![Rgb::ZERO; (SIDE * SIDE) as usize];
        let mut worst: f32 = 0.0;
        for frame in 0..frames {
            let (image, _) = device.frame(frame, 17).expect("the device answers");
            host.render_frame(frame, 17, &mut truth, &cancel)
                .expect("nothing cancels");
            let scale =
                (frame + 1) as f32 * truth.iter().map(|value| value.max_element()).fold(0.0, f32::max);
            for (value, truth) in image.iter().zip(&truth) {
                worst = worst.max((Rgb::from(*value) - *truth).abs().max_element() / scale);
            }
        }
        println!("{name}: {worst}, dropped: {}", device.host().is_dropped());
        // A spot's light falls off by a polynomial.
        let bound = if name == "lighthouse" { 1e-4 } else { 1e-6 };
        assert_eq!(device.host().is_dropped(), host.is_dropped());
        assert_eq!(device.host().is_dropped(), may_drop, "{name}");
        assert!(worst < bound, "{name}: {worst}");
    }
}

/// Means agree with plain paths of the host, by a z-test at 10⁻⁴. A guide's density without
/// the factor of the map, and one without the BSDF's part, are found.
#[test]
fn guided_means_are_those_of_plain_paths() {
    let Some(gpu) = gpu() else { return };
    const SAMPLES: u32 = 48;
    let scene = sized(builtin::cornell());
    let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
    let plain = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(8), 12);
    let truth = host_means([SIDE; 2], SAMPLES, |x, y, sample| plain.sample(x, y, sample, 1));
    let method = trained(&scene, options(64, 4), 3);
    let SceneField::Quadtree(field) = method.field() else {
        panic!("it has quadtrees")
    };
    let agree = |program: &str| {
        let mut device = GpuPathTracer::of_program(gpu, &flat, Some(8), 12, program).expect("it is sound");
        device.set_guide(Some(&field.flat()), 12).expect("it is small");
        let mut found = MeanTest::new();
        for sample in 0..SAMPLES {
            let image = device.sample(sample, 2).expect("the device answers");
            let value = |x: u32, y: u32| Rgb::from(image[(y * SIDE + x) as usize]);
            found.push(mean_luminance([SIDE; 2], value));
        }
        println!(
            "{:.5} ({:.5}), {:.5} ({:.5})",
            found.mean(),
            found.standard_error(),
            truth.mean(),
            truth.standard_error()
        );
        found.test_equal(&truth, 1e-4).is_ok()
    };
    assert!(agree(PATH));
    let faults = [
        ["4.0 / (q * q * q)", "4.0"],
        ["found.pdf * own + guided.pdf * share", "guided.pdf * share"],
    ];
    for &fault in planted(gpu, &faults) {
        assert!(!agree(&faulty(PATH, fault)), "{fault:?}");
    }
}

/// Other guides and other sets of mixtures are refused by name, and those that are known are not.
#[test]
fn options_are_taken_or_refused() {
    let Some(gpu) = gpu() else { return };
    let scene = sized(builtin::cornell());
    let started = |text: &str| {
        let method: Method = text.parse().expect("it is a method");
        GpuStage::new(gpu, &scene, &method).map(|stage| stage.start().map(|_| ()))
    };
    for text in [
        "path:cdq:guide-training=2",
        "direct:vlc",
        "mcmm",
        "mcmm:smis-size=8:smis-emitters",
    ] {
        assert!(matches!(started(text), Ok(Ok(()))), "{text}");
    }
    for (text, why) in [
        ("path:vmf", "cdq alone"),
        ("path:mcmm", "cdq alone"),
        ("path:cdq:guide-always", "trains before"),
        ("volpath:cdq", "guides path alone"),
        ("path:cdq:sobol", "independent"),
        ("mcmm:temporal", "spatial sets"),
        ("mcmm:smis-steps=2", "one step"),
        ("mcmm:bvh", "by tree"),
        ("restir-di:vlc", "by tree"),
    ] {
        match started(text) {
            Err(GpuError::Settings(found)) => assert!(found.contains(why), "{text}: {found}"),
            Err(other) => panic!("{text}: {other}"),
            Ok(_) => panic!("{text} is taken"),
        }
        let method: Method = text.parse().expect("it is a method");
        let by_stage = ["independent", "by tree"].contains(&why);
        assert_eq!(method.capabilities().device, by_stage, "{text}");
    }
}
