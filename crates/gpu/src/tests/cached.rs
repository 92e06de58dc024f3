//! Paths that end in a cache on the device are the CPU's.

use crate::programs::PATH;
use crate::tests::support::{exact_gpu, faulty, gpu, host_means, mean_luminance, planted};
use crate::{Gpu, GpuCachedPaths, GpuError, GpuMethod, GpuPathTracer, GpuScene, GpuStage};
use lightshed_film::{FrameMethod, PixelEstimator};
use lightshed_integrator::caching::Termination;
use lightshed_integrator::sampling::PointSet;
use lightshed_integrator::{
    CacheEnding, CachedPaths, CachedPathsOptions, GuideKind, GuidedPathsOptions, Method, PathTracer,
    SceneField,
};
use lightshed_scene::{EmittersByPower, Rgb, Scene, SceneDescription, builtin};
use lightshed_testkit::{MeanTest, check_faults};
use std::sync::atomic::AtomicBool;

const SIDE: u32 = 64;

fn sized(mut description: SceneDescription) -> Scene {
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    description.settings.max_depth = Some(8);
    Scene::new(&description).expect("built-in scenes are sound")
}

fn options(scene: &Scene, passes: u32, guide: bool) -> CachedPathsOptions {
    CachedPathsOptions {
        passes,
        points: PointSet::Independent,
        visible_emission: false,
        guide: guide.then(|| GuidedPathsOptions {
            worth_depth: u32::MAX,
            ..GuidedPathsOptions::new(GuideKind::Quadtree)
        }),
        ..CachedPathsOptions::new(Termination::Fixed { depth: 2 }, scene)
    }
}

/// A cache that the host has filled.
fn filled(scene: &Scene, options: CachedPathsOptions) -> CachedPaths<'_, EmittersByPower<'_>> {
    let mut host = CachedPaths::new(scene, scene.emitters_by_power(), options).expect("options are sound");
    host.prepare(&AtomicBool::new(false));
    host
}

fn quadtrees(field: Option<&SceneField>) -> Option<lightshed_integrator::guiding::FlatGuidingField<'_>> {
    match field {
        Some(SceneField::Quadtree(field)) => Some(field.flat()),
        _ => None,
    }
}

/// Paths of the device that are not the host's, as a share: in any bit on an exact device, else by
/// more than a thousandth. And the share of the host's that the cache has changed.
fn different(
    gpu: &Gpu,
    scene: &Scene,
    host: &CachedPaths<'_, EmittersByPower<'_>>,
    ending: &CacheEnding<'_>,
    program: &str,
) -> [f64; 2] {
    let flat = GpuScene::new(gpu, scene).expect("the scene is flat");
    let mut device = GpuPathTracer::of_program(gpu, &flat, Some(8), 5, program).expect("it is sound");
    device
        .set_cache(ending, quadtrees(host.field()).as_ref(), 5)
        .expect("it is small");
    let found = device.sample(5, 9).expect("the device answers");
    let plain = || PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(8), 5);
    let ended = plain().with_ending(ending);
    let (plain, guided) = (
        plain(),
        host.field()
            .map(|field| plain().with_ending(ending).with_guide(field)),
    );
    let (mut differing, mut changed) = (0, 0);
    for (i, found) in (0..).zip(&found) {
        let [x, y] = [i % SIDE, i / SIDE];
        let truth = match &guided {
            Some(guided) => guided.sample(x, y, 5, 9),
            None => ended.sample(x, y, 5, 9),
        };
        changed += usize::from(truth != plain.sample(x, y, 5, 9));
        differing += usize::from((0..3).any(|c| found[c].to_bits() != truth[c].to_bits()));
    }
    [differing, changed].map(|count| count as f64 / found.len() as f64)
}

const SPREAD: Termination = Termination::Spread { share: 0.01 };
const RELATIVE: Termination = Termination::Variance {
    threshold: 0.3,
    relative: true,
};
const MSE: Termination = Termination::Mse {
    target: 16.0,
    margin: Termination::MARGIN,
};

/// The same bits, path by path, by every rule, with look-ups that are moved and that are not, with
/// roulette, and with a guide; on diffuse, glossy, refracting and mirroring surfaces. Faults are
/// noticed.
#[test]
fn paths_end_where_those_of_the_cpu_do() {
    let Some(gpu) = exact_gpu() else { return };
    let fixed = Termination::Fixed { depth: 2 };
    let absolute = Termination::variance(0.02);
    for (name, description, is_guided, rules) in [
        (
            "cornell",
            builtin::cornell(),
            false,
            &[fixed, SPREAD, absolute, RELATIVE, MSE][..],
        ),
        ("cornell-glossy", builtin::cornell_glossy(), true, &[RELATIVE]),
        ("glass", crate::tests::paths::glass(), false, &[RELATIVE, MSE]),
        ("door-gap", builtin::door_gap(), false, &[RELATIVE]),
    ] {
        let scene = sized(description);
        let host = filled(&scene, options(&scene, 12, is_guided));
        for (number, &rule) in rules.iter().enumerate() {
            let ending = CacheEnding {
                rule,
                jitter: number != 1,
                survival: if number == 4 { 0.7 } else { 1.0 },
                ..host.ending()
            };
            let [found, changed] = different(gpu, &scene, &host, &ending, PATH);
            println!("{name}, {rule:?}: {found} differ, {changed} were changed");
            assert!(found == 0.0, "{name}, {rule:?}: {found} of all paths differ");
            assert!(
                changed > 0.02,
                "{name}, {rule:?}: {changed} of all paths were changed"
            );
        }
    }
    let scene = sized(builtin::cornell());
    let host = filled(&scene, options(&scene, 12, false));
    let faults = [
        // What the cache replaces counts twice, or is that of another place; the path goes on with
        // all of it; the look-up is moved by other numbers, or by half; variances are forgotten,
        // and so is the bound of the first vertex.
        (RELATIVE, ["(1.0 - decided.share) * throughput", "throughput"]),
        (fixed, ["row.a.xyz", "row.a.yzw"]),
        (RELATIVE, ["path.throughput * end.goes_on", "path.throughput"]),
        (
            fixed,
            [
                "FIRST_END_BLOCK: u32 = 536870912u",
                "FIRST_END_BLOCK: u32 = 536870914u",
            ],
        ),
        (
            fixed,
            ["(u - vec2f(0.5)) * side", "(u - vec2f(0.5)) * (0.5 * side)"],
        ),
        (
            RELATIVE,
            ["budget.variance += at.variance", "budget.variance += 0.0"],
        ),
        (SPREAD, ["root += distance / sqrt(density)", "root += distance"]),
    ];
    for &(rule, fault) in planted(gpu, &faults) {
        let ending = CacheEnding {
            rule,
            ..host.ending()
        };
        let program = faulty(PATH, fault);
        let [found, _] = different(gpu, &scene, &host, &ending, &program);
        assert!(found > 0.01, "{fault:?} is not noticed: {found}");
    }
}

/// The largest value of a frame of the host, and how far the device's is from it at most, relative
/// to that.
fn apart(
    device: &mut GpuCachedPaths<'_>,
    host: &mut CachedPaths<'_, EmittersByPower<'_>>,
    frame: u32,
) -> [f32; 2] {
    let (image, _) = device.frame(frame, 17).expect("the device answers");
    let mut truth = vec![Rgb::ZERO; (SIDE * SIDE) as usize];
    host.render_frame(frame, 17, &mut truth, &AtomicBool::new(false));
    let scale = truth.iter().map(|value| value.max_element()).fold(0.0, f32::max);
    let apart = |(value, truth): (&[f32; 3], &Rgb)| (Rgb::from(*value) - *truth).abs().max_element();
    let worst = image.iter().zip(&truth).map(apart).fold(0.0, f32::max) / scale;
    [scale, worst]
}

/// Frames of the method equal those of the host alone, to rounding; and use 20 bytes more a pixel.
#[test]
fn frames_are_those_of_the_cpu() {
    let Some(gpu) = exact_gpu() else { return };
    let scene = sized(builtin::door_gap());
    let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
    for samples in [1, 2] {
        let options = CachedPathsOptions {
            rule: RELATIVE,
            samples,
            ..options(&scene, 6, samples == 1)
        };
        let mut device = GpuCachedPaths::new(gpu, &scene, &flat, options).expect("options are sound");
        let mut host = filled(&scene, options);
        for frame in 0..2 {
            let [scale, worst] = apart(&mut device, &mut host, frame);
            println!("{samples} samples, frame {frame}: {worst}");
            assert!(scale > 0.0 && worst < 1e-6, "{worst}");
        }
        let paths = u64::from(SIDE * SIDE) * 64;
        let bytes = (GpuPathTracer::BYTES_PER_PIXEL - 48 + 20) * paths + 48 * u64::from(SIDE * SIDE);
        assert_eq!(device.device().bytes(), bytes);
        assert!(device.device().cache_bytes() > 72 << 16);
    }
}

/// So are frames of a cache that learns before each of them, which differ from those of one that
/// does not. A device that keeps what the cache answered first is found.
#[test]
fn a_cache_that_learns_is_followed() {
    let Some(gpu) = exact_gpu() else { return };
    let scene = sized(builtin::door_gap());
    let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
    let options = CachedPathsOptions {
        every_frame: true,
        rule: RELATIVE,
        ..options(&scene, 4, true)
    };
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// The host has the passes before each frame, the device those before the first.
        Kept,
    }
    check_faults(&[Fault::Kept], |fault| {
        let of_device = CachedPathsOptions {
            every_frame: fault.is_none(),
            ..options
        };
        let mut device = GpuCachedPaths::new(gpu, &scene, &flat, of_device).expect("options are sound");
        let mut host =
            CachedPaths::new(&scene, scene.emitters_by_power(), options).expect("options are sound");
        for frame in 0..4 {
            let [scale, worst] = apart(&mut device, &mut host, frame);
            println!("{fault:?}, frame {frame}: {worst}");
            if !(scale > 0.0 && worst < 1e-6) {
                return Err(format!("frame {frame}: {worst}"));
            }
        }
        Ok(())
    })
    .expect("the fault is noticed");
}

/// Means of ended paths agree with the host's, by z-tests at 10⁻⁴, in three scenes; another seed
/// than the host's. What the cache replaces twice is found.
#[test]
fn ended_means_are_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    const SAMPLES: u32 = 24;
    for (name, description) in [
        ("cornell", builtin::cornell()),
        ("door-gap", builtin::door_gap()),
        ("glossy-bounce", builtin::glossy_bounce()),
    ] {
        let scene = sized(description);
        let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
        let host = filled(&scene, options(&scene, 12, false));
        let ending = CacheEnding {
            rule: RELATIVE,
            ..host.ending()
        };
        let ended = PathTracer::new(&scene, scene.emitters_by_power())
            .with_depths(Some(8), 5)
            .with_ending(&ending);
        let truth = host_means([SIDE; 2], SAMPLES, |x, y, sample| ended.sample(x, y, sample, 1));
        let agree = |program: &str| {
            let mut device = GpuPathTracer::of_program(gpu, &flat, Some(8), 5, program).expect("it is sound");
            device.set_cache(&ending, None, 5).expect("it is small");
            let mut found = MeanTest::new();
            for sample in 0..SAMPLES {
                let image = device.sample(sample, 2).expect("the device answers");
                let value = |x: u32, y: u32| Rgb::from(image[(y * SIDE + x) as usize]);
                found.push(mean_luminance([SIDE; 2], value));
            }
            println!(
                "{name}: {:.5} ({:.5}), {:.5} ({:.5})",
                found.mean(),
                found.standard_error(),
                truth.mean(),
                truth.standard_error()
            );
            found.test_equal(&truth, 1e-4).is_ok()
        };
        assert!(agree(PATH), "{name}");
        if name == "cornell" {
            let faults = [["(1.0 - decided.share) * throughput", "throughput"]];
            for &fault in planted(gpu, &faults) {
                assert!(!agree(&faulty(PATH, fault)), "{name}");
            }
        }
    }
}

/// Caches are taken, with quadtrees as a guide, too; what the device does not do is refused by
/// name.
#[test]
fn options_are_taken_or_refused() {
    let Some(gpu) = gpu() else { return };
    let scene = sized(builtin::cornell());
    let started = |text: &str| {
        let method: Method = text.parse().expect("it is a method");
        GpuStage::new(gpu, &scene, &method).map(|stage| stage.start().map(|_| ()))
    };
    for text in [
        "path:fixed",
        "path:spread@0.01",
        "path:variance@0.1:cache-passes=4:cache-borders:cache-survival=0.6",
        "path:variance-absolute@0.1:cdq",
        "path:mse@16:points=independent",
        "path:variance@0.3:cache-always",
    ] {
        assert!(matches!(started(text), Ok(Ok(()))), "{text}");
    }
    for (text, why) in [
        ("path:fixed:cache-refine=2", "not split"),
        ("path:fixed:cache-facets=8", "by direction"),
        ("path:fixed:vmf", "cdq alone"),
        ("path:fixed:sobol", "independent"),
        ("path:fixed:visible=rays", "has to be paths"),
        ("path:fixed:bvh", "by tree"),
    ] {
        match started(text) {
            Err(GpuError::Settings(found)) => assert!(found.contains(why), "{text}: {found}"),
            Err(other) => panic!("{text}: {other}"),
            Ok(_) => panic!("{text} is taken"),
        }
    }
}
