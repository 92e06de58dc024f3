//! Suffix reuse on the device against path tracing, and faults planted in it.

use super::{GpuRestirSuffix, check};
use crate::programs::{RESTIR_PREFIX, RESTIR_SUFFIX};
use crate::tests::support::{Chains, faulty, gpu, host_means, planted, under_the_sky};
use crate::{Gpu, GpuError, GpuMethod, GpuScene};
use lightshed_film::PixelEstimator;
use lightshed_integrator::{PathMapping, PathTracer, RestirPtOptions, RestirSuffixOptions, WorldReuse};
use lightshed_scene::{EmitterDescription, Rgb, Scene, SceneDescription, builtin, luminance};
use lightshed_testkit::MeanTest;

const SIDE: u32 = 24;
/// Frames of a chain.
const FRAMES: u32 = 4;

/// What the device does not do is refused, not ignored.
#[test]
fn other_options_are_refused() {
    let usual = GpuRestirSuffix::real_time(PathMapping::Hybrid);
    assert!(check(&usual).is_ok());
    let changes: [fn(&mut RestirSuffixOptions); 14] = [
        |options| options.suffixes.footprint = Some(100.0),
        |options| options.suffixes.mutations = 1,
        |options| options.suffixes.pairs = Some(16),
        |options| options.suffixes.world = Some(WorldReuse::default()),
        |options| options.spacing = 2,
        |options| options.search_leaves = 2,
        |options| options.borrowed = 9,
        |options| options.prefixes = 0,
        |options| options.canonical = 9,
        |options| options.canonical = 0,
        |options| options.camera_rays = 9,
        |options| options.prefix_cap = 0.5,
        |options| options.search_radius = f32::NAN,
        |options| options.normal_scale = -1.0,
    ];
    for (number, change) in changes.iter().enumerate() {
        let mut options = usual;
        change(&mut options);
        assert!(
            matches!(check(&options), Err(GpuError::Settings(_))),
            "change {number}"
        );
    }
}

fn small(mut description: SceneDescription) -> Scene {
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    Scene::new(&description).expect("built-in scenes are sound")
}

fn method<'a>(
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    options: RestirSuffixOptions,
    programs: [&str; 2],
) -> GpuRestirSuffix<'a> {
    GpuRestirSuffix::of_programs(gpu, scene, options, programs).expect("the programs are sound")
}

/// Resampled, direct light is part of paths behind a single camera ray: that of the path tracer.
fn behind_one_ray(mapping: PathMapping) -> RestirSuffixOptions {
    let usual = GpuRestirSuffix::real_time(mapping);
    RestirSuffixOptions {
        suffixes: RestirPtOptions {
            direct_samples: 0,
            ..usual.suffixes
        },
        camera_rays: 1,
        prefixes: 4,
        canonical: 2,
        ..usual
    }
}

/// The host's light, without what camera rays see of emitters if that is `reflected`.
fn by_paths(scene: &Scene, images: u32, reflected: bool) -> MeanTest {
    let all = PathTracer::new(scene, scene.emitters_by_power());
    let seen = PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
    host_means([SIDE; 2], images, |x, y, index| {
        let whole = all.sample(x, y, index, 5);
        if reflected {
            whole - seen.sample(x, y, index, 5)
        } else {
            whole
        }
    })
}

fn lit_from_around() -> SceneDescription {
    let mut scene = builtin::cornell_glossy();
    scene.emitters.push(EmitterDescription::Constant {
        radiance: Rgb::new(0.3, 0.4, 0.6),
    });
    scene
}

/// Chains of frames against path tracing by z-tests at 1e-4 each, and faults in the final gather.
#[test]
fn images_have_the_expectation_of_paths() {
    let Some(gpu) = gpu() else { return };
    let faults = [
        // The throughput of integration prefixes is there twice.
        [
            "prefix.throughput * package_reuse_gathered",
            "prefix.throughput * prefix.throughput * package_reuse_gathered",
        ],
        // The canonical term is divided by the number of prefixes, whatever its chance was.
        ["1.0 / (q * f32(", "1.0 / (1.0 * f32("],
        // The Jacobian of shifted suffixes is taken for its inverse.
        [
            "path_jacobian(x.density, image.density));",
            "path_jacobian(image.density, x.density));",
        ],
        // What roulette leaves of a prefix counts for nothing in MIS weights.
        [
            "own_suffixes[thread] = package_lightshed__1path_sample__1empty_reservoir(1.0)",
            "own_suffixes[thread] = package_lightshed__1path_sample__1empty_reservoir(0.0)",
        ],
    ];
    let scenes = [
        (
            "under the sky",
            under_the_sky(builtin::cornell_glossy()),
            PathMapping::Hybrid,
        ),
        ("cornell", builtin::cornell(), PathMapping::Hybrid),
        ("lit from around", lit_from_around(), PathMapping::Reconnection),
    ];
    for (name, description, mapping) in scenes {
        let scene = small(description);
        let truth = by_paths(&scene, 500, true);
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        let seen = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
        let chains = Chains {
            counted: 0..FRAMES,
            known: &|[x, y], frame, seed| seen.sample(x, y, frame, seed),
        };
        let options = behind_one_ray(mapping);
        let mut sound = method(gpu, &on_device, options, [RESTIR_PREFIX, RESTIR_SUFFIX]);
        assert!(chains.agree(name, &mut sound, 24, &truth), "{name}");
        if mapping == PathMapping::Hybrid {
            continue;
        }
        // With more borrowed suffixes, and roulette.
        let options = RestirSuffixOptions {
            canonical: 1,
            borrowed: 3,
            ..options
        };
        let mut sound = method(gpu, &on_device, options, [RESTIR_PREFIX, RESTIR_SUFFIX]);
        assert!(chains.agree("roulette", &mut sound, 24, &truth), "roulette");
        for &fault in planted(gpu, &faults) {
            let program = faulty(RESTIR_SUFFIX, fault);
            let mut planted = method(gpu, &on_device, options, [RESTIR_PREFIX, &program]);
            assert!(
                chains.differ(&mut planted, 48, &truth),
                "{fault:?} is not noticed"
            );
        }
    }
}

/// Direct light beside reuse, several camera rays, no reuse of one kind or the other: the whole
/// image has the expectation of paths.
#[test]
fn all_parts_add_up() {
    let Some(gpu) = gpu() else { return };
    let scene = small(lit_from_around());
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    let truth = by_paths(&scene, 400, false);
    let chains = Chains {
        counted: 0..2,
        known: &|_, _, _| Rgb::ZERO,
    };
    let usual = GpuRestirSuffix::real_time(PathMapping::Hybrid);
    let plain = RestirPtOptions {
        temporal_cap: None,
        rounds: 0,
        direct_samples: 0,
        ..usual.suffixes
    };
    let rows = [
        ("usual", usual),
        (
            "camera rays",
            RestirSuffixOptions {
                suffixes: plain,
                ..usual
            },
        ),
        (
            "nothing borrowed",
            RestirSuffixOptions {
                borrowed: 0,
                canonical: 8,
                ..usual
            },
        ),
        (
            "two rounds, several trees",
            RestirSuffixOptions {
                suffixes: RestirPtOptions {
                    candidates: 4,
                    rounds: 2,
                    temporal_cap: None,
                    ..usual.suffixes
                },
                borrowed: 8,
                prefixes: 3,
                canonical: 2,
                camera_rays: 2,
                ..usual
            },
        ),
    ];
    for (name, options) in rows {
        let mut sound = method(gpu, &on_device, options, [RESTIR_PREFIX, RESTIR_SUFFIX]);
        assert!(chains.agree(name, &mut sound, 24, &truth), "{name}");
    }
    let faults = [
        // Prefixes find direct light, too.
        ["length >= least_length", "true"],
        // Each camera ray adds all emission that it meets.
        [
            "seen_emission(seen) / f32(package__1restir_suffix_domain_frame.camera_rays)",
            "seen_emission(seen)",
        ],
    ];
    for (&fault, (_, options)) in planted(gpu, &faults).iter().zip(rows) {
        let program = faulty(RESTIR_SUFFIX, fault);
        let mut planted = method(gpu, &on_device, options, [RESTIR_PREFIX, &program]);
        assert!(
            chains.differ(&mut planted, 48, &truth),
            "{fault:?} is not noticed"
        );
    }
}

/// If all frames see the same, merging prefixes with those of the frame before is averaging: after
/// frame `f` of a single pixel, `W p̂ = (Y_f + c W' p̂') / (1 + c)` with `c = min(f, cap)`. No mean
/// of images depends on what supporting prefixes there are.
#[test]
fn merging_prefixes_with_what_is_seen_again_is_averaging() {
    let Some(gpu) = gpu() else { return };
    let scene = small(builtin::cornell_glossy());
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    // All frames look through the middles of pixels.
    let camera = "package__1restir_suffix_domain_block(pixel, package_primaries_CAMERA)";
    assert!(RESTIR_PREFIX.contains(camera));
    let sound = RESTIR_PREFIX.replace(camera, "vec4u(0x80000000u)");
    const CAP: f32 = 2.0;
    let held = |temporal_cap, program: &str| -> Vec<Vec<f32>> {
        let usual = GpuRestirSuffix::real_time(PathMapping::Hybrid);
        let options = RestirSuffixOptions {
            suffixes: RestirPtOptions {
                temporal_cap,
                ..usual.suffixes
            },
            prefix_cap: CAP,
            ..usual
        };
        let mut method = method(gpu, &on_device, options, [program, RESTIR_SUFFIX]);
        let frames = 0..FRAMES;
        frames
            .map(|frame| {
                method.frame(frame, 11).expect("the device answers");
                method.frames.held_prefixes(frame).expect("the device answers")
            })
            .collect()
    };
    let own = held(None, &sound);
    let share = |program: &str| -> f64 {
        let merged = held(Some(CAP), program);
        let shares = (1..FRAMES as usize).map(|frame| {
            let c = (frame as f32).min(CAP);
            let alike = (0..own[frame].len()).filter(|&i| {
                let expected = (own[frame][i] + c * merged[frame - 1][i]) / (1.0 + c);
                (merged[frame][i] - expected).abs() <= 1e-3 * expected.max(1e-3)
            });
            alike.count() as f64 / own[frame].len() as f64
        });
        shares.fold(1.0, f64::min)
    };
    let sound_share = share(&sound);
    println!("{sound_share:.4} of the pixels are averages");
    assert!(sound_share > 0.98);
    let faults = [
        ["min(confidence, cap)", "min(confidence, 1000.0)"],
        ["min(confidence, cap)", "0.5"],
        [
            "MergeInput(held.confidence,",
            "MergeInput(min(held.confidence, 1.0),",
        ],
        [
            "MergeImage(package_reuse__1prefix_target(image.prefix),",
            "MergeImage(1.0,",
        ],
    ];
    for &fault in planted(gpu, &faults) {
        let share = share(&faulty(&sound, fault));
        println!("  {share:.4}");
        assert!(share < 0.6, "{fault:?} is not noticed");
    }
}

/// How many pixels' integration prefixes are in memory at a time changes nothing, and the sites of
/// every frame make a tree.
#[test]
fn memory_changes_nothing() {
    let Some(gpu) = gpu() else { return };
    let scene = small(lit_from_around());
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    let options = GpuRestirSuffix::real_time(PathMapping::Hybrid);
    let images = |in_memory: Option<u32>| -> Vec<Vec<[f32; 3]>> {
        let mut method = method(gpu, &on_device, options, [RESTIR_PREFIX, RESTIR_SUFFIX]);
        let pixels = u64::from(SIDE * SIDE);
        assert_eq!(
            method.bytes(),
            GpuRestirSuffix::BYTES_PER_PIXEL * pixels
                + method.frames.tree_bytes()
                + 144 * u64::from(options.prefixes) * pixels
        );
        method.frames.restrict(in_memory);
        let mut image = |frame| {
            let (image, _) = method.frame(frame, 7).expect("the device answers");
            assert_eq!(method.frames.wrong_site(), Ok(None));
            image
        };
        (0..3).map(&mut image).collect()
    };
    let whole = images(None);
    assert!(
        whole
            .iter()
            .flatten()
            .any(|&pixel| luminance(Rgb::from(pixel)) > 0.0)
    );
    assert!(whole == images(Some(100)));
}
