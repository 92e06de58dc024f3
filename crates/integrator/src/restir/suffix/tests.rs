//! Suffix reuse against path tracing, and faults planted in it.

use super::{RestirSuffix, RestirSuffixError, RestirSuffixOptions};
use crate::restir::pt::{Neighbourhood, PathMapping, RestirPtError, RestirPtOptions};
use crate::{CameraMotion, PathTracer, SceneWorld};
use lightshed_film::{FrameMethod, PixelEstimator, SampleId};
use lightshed_resampling::{Jacobian, Pulled, ShiftMapping, Shifted, Undefined};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{EmittersByPower, Rgb, Scene, builtin};
use lightshed_shift::{PathDomain, PathSample, PathShift};
use lightshed_testkit::{MeanTest, check_faults};
use std::sync::atomic::AtomicBool;

type World<'a> = SceneWorld<'a, EmittersByPower<'a>>;

/// What is done wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    /// The throughput of integration prefixes is left out.
    NoThroughput,
    /// It is there twice.
    ThroughputTwice,
    /// The canonical term is divided by the number of prefixes.
    CanonicalDivided,
    /// Prefixes bring suffixes by their throughput, and weigh them as if by equal chances.
    ChancesIgnored,
    /// `1/J` for the Jacobian of suffixes.
    InverseJacobian,
    /// Prefixes find direct light, which has samples of its own.
    DirectTwice,
    /// Camera rays add emission that separate rays see.
    EmissionTwice,
}

/// The shift of suffixes, with or without a fault.
#[derive(Clone, Copy)]
struct Faulty(bool);

impl Faulty {
    fn jacobian(self, jacobian: Jacobian) -> Jacobian {
        if self.0 { jacobian.inverse() } else { jacobian }
    }
}

impl<'w> ShiftMapping<PathDomain<'w, World<'w>>> for Faulty {
    fn shift(
        &self,
        x: &PathSample,
        from: &PathDomain<'w, World<'w>>,
        to: &PathDomain<'w, World<'w>>,
    ) -> Result<Shifted<PathSample>, Undefined> {
        let image = PathShift::default().shift(x, from, to)?;
        Ok(Shifted {
            jacobian: self.jacobian(image.jacobian),
            ..image
        })
    }

    fn pull(
        &self,
        y: &PathSample,
        to: &PathDomain<'w, World<'w>>,
        from: &PathDomain<'w, World<'w>>,
    ) -> Result<Pulled, Undefined> {
        let pulled = PathShift::default().pull(y, to, from)?;
        Ok(Pulled {
            jacobian: self.jacobian(pulled.jacobian),
            ..pulled
        })
    }
}

/// A built-in scene in small, with paths of at most four edges.
fn small(name: &str, side: u32) -> Scene {
    let mut description = builtin::by_name(name).unwrap();
    (description.settings.width, description.settings.height) = (side, side);
    description.settings.max_depth = Some(4);
    if name.starts_with("cornell") {
        // From so near that the light is not in view: its edges would be most of the noise.
        description.camera.fov_x = 0.4;
    }
    Scene::new(&description).unwrap()
}

fn real_time() -> RestirSuffixOptions {
    let mut options = RestirSuffixOptions::real_time(PathMapping::Hybrid);
    options.suffixes.neighbourhood = Neighbourhood::Disk {
        radius: 5.0,
        count: 2,
    };
    RestirSuffixOptions {
        prefixes: 3,
        camera_rays: 2,
        canonical: 1,
        borrowed: 2,
        ..options
    }
}

/// Luminance-like sums of the four quarters of an image.
fn quarters(image: &[Rgb], side: usize) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for (index, value) in image.iter().enumerate() {
        assert!(value.is_finite(), "pixel {index} is {value}");
        let quarter = 2 * usize::from(index / side >= side / 2) + usize::from(index % side >= side / 2);
        sums[quarter] += f64::from(value.element_sum()) / (side * side) as f64;
    }
    sums
}

fn truth(scene: &Scene, images: u32, samples: u32) -> [MeanTest; 4] {
    let tracer = PathTracer::new(scene, scene.emitters_by_power());
    let side = scene.settings().width;
    let mut means = [MeanTest::new(); 4];
    let mut image = vec![Rgb::ZERO; (side * side) as usize];
    for number in 0..images {
        for (index, value) in (0..).zip(&mut image) {
            let id = |sample| SampleId {
                x: index % side,
                y: index / side,
                index: number * samples + sample,
            };
            let ids: Vec<SampleId> = (0..samples).map(id).collect();
            let mut values = vec![Rgb::ZERO; ids.len()];
            tracer.sample_many(&ids, 0x5eed, &mut values);
            *value = values.into_iter().sum::<Rgb>() / samples as f32;
        }
        let sums = quarters(&image, side as usize);
        means.iter_mut().zip(sums).for_each(|(mean, sum)| mean.push(sum));
    }
    means
}

/// The mean of the last of `frames` frames over chains of independent seeds.
fn chains(
    scene: &Scene,
    options: RestirSuffixOptions,
    [chains, frames]: [u32; 2],
    motion: CameraMotion,
    fault: Option<Fault>,
) -> [MeanTest; 4] {
    let world = SceneWorld::new(scene, scene.emitters_by_power());
    let side = scene.settings().width as usize;
    let mut means = [MeanTest::new(); 4];
    for chain in 0..chains {
        let mut method = RestirSuffix::new(&world, options, motion).unwrap();
        method.fault = fault;
        let mut method = method.with_shift(Faulty(fault == Some(Fault::InverseJacobian)));
        let mut image = vec![Rgb::ZERO; side * side];
        for frame in 0..frames {
            let counts =
                method.render_frame(frame, u64::from(chain) + 77, &mut image, &AtomicBool::new(false));
            assert!(counts.is_some());
        }
        let sums = quarters(&image, side);
        means.iter_mut().zip(sums).for_each(|(mean, sum)| mean.push(sum));
    }
    means
}

/// Whether chance explains the difference, with a false-positive rate of 4·10⁻⁵.
fn agree(found: &[MeanTest; 4], truth: &[MeanTest; 4]) -> Result<(), String> {
    for (found, truth) in found.iter().zip(truth) {
        println!(
            "{:.5} ± {:.5} against {:.5}",
            found.mean(),
            found.standard_error(),
            truth.mean()
        );
        found.test_equal(truth, 1e-5).map_err(|error| error.to_string())?;
    }
    Ok(())
}

#[test]
fn frames_agree_with_path_tracing() {
    for (name, side, count) in [
        ("cornell", 12, 50),
        // Rare paths by way of the boxes have much of the light: means of few chains are skewed.
        ("cornell-glossy", 12, 400),
        ("doorway", 12, 40),
        ("many-lights", 10, 30),
        ("furnace", 8, 20),
        ("warehouse", 10, 30),
    ] {
        let scene = small(name, side);
        println!("{name}");
        let truth = truth(&scene, 60, 32);
        let found = chains(&scene, real_time(), [count, 3], CameraMotion::STILL, None);
        agree(&found, &truth).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn independent_frames_and_all_canonical_suffixes_agree_too() {
    let scene = small("cornell-glossy", 12);
    let truth = truth(&scene, 60, 32);
    let offline = RestirSuffixOptions {
        suffixes: RestirPtOptions {
            candidates: 2,
            ..RestirSuffixOptions::offline(PathMapping::Reconnection).suffixes
        },
        prefixes: 4,
        camera_rays: 4,
        canonical: 4,
        ..RestirSuffixOptions::offline(PathMapping::Reconnection)
    };
    agree(
        &chains(&scene, offline, [40, 1], CameraMotion::STILL, None),
        &truth,
    )
    .unwrap();
    let alone = RestirSuffixOptions {
        borrowed: 0,
        canonical: 3,
        ..real_time()
    };
    agree(&chains(&scene, alone, [60, 2], CameraMotion::STILL, None), &truth).unwrap();
}

/// A still frame after motion: what moved is no part of it.
#[test]
fn a_still_frame_after_motion_agrees() {
    let scene = small("cornell", 12);
    let truth = truth(&moved(), 60, 32);
    agree(&chains(&scene, real_time(), [60, 3], moving(), None), &truth).unwrap();
}

/// From a frame to the next.
fn moving() -> CameraMotion {
    CameraMotion::translation(Vec3::new(0.03, 0.01, -0.02)).unwrap()
}

/// `cornell` as the third frame sees it.
fn moved() -> Scene {
    let mut description = builtin::cornell();
    (description.settings.width, description.settings.height) = (12, 12);
    description.settings.max_depth = Some(4);
    description.camera.fov_x = 0.4;
    description.camera.to_world.translation += lightshed_scene::glam::Vec3A::new(0.06, 0.02, -0.04);
    Scene::new(&description).unwrap()
}

/// A lamp in view, of which separate rays see the edges, without samples of direct light: what
/// prefixes find on their way and what camera rays meet.
fn lamp_in_view() -> (Scene, RestirSuffixOptions) {
    let mut description = builtin::cornell();
    (description.settings.width, description.settings.height) = (12, 12);
    description.settings.max_depth = Some(4);
    let mut options = real_time();
    options.camera_rays = 3;
    options.suffixes.direct_samples = 0;
    options.suffixes.visible_emission = true;
    (Scene::new(&description).unwrap(), options)
}

#[test]
fn emission_in_view_counts_once() {
    let (scene, options) = lamp_in_view();
    let truth = truth(&scene, 60, 64);
    check_faults(&[Fault::EmissionTwice], |fault| {
        let found = chains(&scene, options, [80, 2], CameraMotion::STILL, fault);
        agree(&found, &truth)
    })
    .unwrap();
    // And beside samples of direct light.
    let mut apart = options;
    apart.suffixes.direct_samples = 2;
    agree(&chains(&scene, apart, [80, 2], CameraMotion::STILL, None), &truth).unwrap();
}

/// Suffixes from far away, where Jacobians differ from 1.
fn from_afar() -> RestirSuffixOptions {
    let mut options = real_time();
    options.suffixes.rounds = 2;
    options.suffixes.neighbourhood = Neighbourhood::Disk {
        radius: 12.0,
        count: 4,
    };
    RestirSuffixOptions {
        prefixes: 6,
        borrowed: 3,
        ..options
    }
}

#[test]
fn faults_are_found() {
    let scene = small("cornell", 12);
    let truth = truth(&scene, 80, 32);
    let faults = [
        Fault::NoThroughput,
        Fault::ThroughputTwice,
        Fault::CanonicalDivided,
        Fault::InverseJacobian,
        Fault::DirectTwice,
    ];
    check_faults(&faults, |fault| {
        let found = chains(&scene, from_afar(), [80, 2], CameraMotion::STILL, fault);
        agree(&found, &truth)
    })
    .unwrap();
}

/// Where prefixes leave through the open side of the box, those that stay bring suffixes with
/// other chances.
#[test]
fn chances_of_suffixes_count() {
    let scene = small("cornell", 12);
    let truth = truth(&scene, 80, 32);
    let options = RestirSuffixOptions {
        borrowed: 0,
        ..from_afar()
    };
    check_faults(&[Fault::ChancesIgnored], |fault| {
        let found = chains(&scene, options, [200, 1], CameraMotion::STILL, fault);
        agree(&found, &truth)
    })
    .unwrap();
}

/// Suffixes of pixels that reuse from each other.
#[test]
fn pairs_agree_too() {
    let scene = small("cornell", 12);
    let truth = truth(&scene, 80, 32);
    let mut options = from_afar();
    (options.suffixes.pairs, options.suffixes.rounds) = (Some(4), 3);
    check_faults(&[Fault::InverseJacobian], |fault| {
        let found = chains(&scene, options, [80, 2], CameraMotion::STILL, fault);
        agree(&found, &truth)
    })
    .unwrap();
}

/// Fewer supporting prefixes than pixels, with and without motion; surroundings in view, too, whose
/// light the rays of supporting prefixes do not add.
#[test]
fn spaced_supports_agree_too() {
    // Five does not divide the side.
    let spaced = |spacing, options| RestirSuffixOptions { spacing, ..options };
    let scene = small("cornell", 12);
    let still = truth(&scene, 160, 32);
    check_faults(&[Fault::InverseJacobian, Fault::CanonicalDivided], |fault| {
        let mut options = spaced(2, from_afar());
        options.suffixes.rounds = 5;
        let found = chains(&scene, options, [400, 2], CameraMotion::STILL, fault);
        agree(&found, &still)
    })
    .unwrap();
    let moved = truth(&moved(), 60, 32);
    agree(
        &chains(&scene, spaced(5, real_time()), [60, 3], moving(), None),
        &moved,
    )
    .unwrap();
    let furnace = small("furnace", 8);
    let truth = truth(&furnace, 60, 32);
    let mut options = spaced(2, real_time());
    options.suffixes.direct_samples = 0;
    let found = chains(&furnace, options, [40, 2], CameraMotion::STILL, None);
    agree(&found, &truth).unwrap();
}

#[test]
fn roulette_saves_rays() {
    let scene = small("cornell", 12);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let rays = |canonical| {
        let options = RestirSuffixOptions {
            prefixes: 8,
            canonical,
            suffixes: RestirPtOptions {
                direct_samples: 0,
                ..real_time().suffixes
            },
            ..real_time()
        };
        let mut method = RestirSuffix::new(&world, options, CameraMotion::STILL).unwrap();
        let mut image = vec![Rgb::ZERO; 144];
        method
            .render_frame(0, 1, &mut image, &AtomicBool::new(false))
            .unwrap()
    };
    let (one, all) = (rays(1), rays(8));
    assert!(
        one.path < all.path && one.emitter < all.emitter,
        "{one:?}, {all:?}"
    );
    assert_eq!(one.camera, 2 * 144, "that of the support, and a further one");
}

#[test]
fn options_out_of_range_are_refused() {
    let scene = small("cornell-glossy", 8);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let refused = |change: &dyn Fn(&mut RestirSuffixOptions)| {
        let mut options = RestirSuffixOptions::real_time(PathMapping::Hybrid);
        change(&mut options);
        RestirSuffix::new(&world, options, CameraMotion::STILL)
            .err()
            .unwrap()
    };
    assert_eq!(refused(&|o| o.prefixes = 0), RestirSuffixError::Prefixes(0, 4));
    assert_eq!(refused(&|o| o.canonical = 9), RestirSuffixError::Prefixes(8, 9));
    assert_eq!(refused(&|o| o.camera_rays = 9), RestirSuffixError::CameraRays(9));
    assert_eq!(
        refused(&|o| o.prefix_cap = 0.5),
        RestirSuffixError::PrefixCap(0.5)
    );
    assert_eq!(refused(&|o| o.borrowed = 33), RestirSuffixError::Borrowed(33));
    for spacing in [0, 65] {
        assert_eq!(
            refused(&|o| o.spacing = spacing),
            RestirSuffixError::Spacing(spacing)
        );
    }
    assert_eq!(refused(&|o| o.search_leaves = 0), RestirSuffixError::SearchLeaves);
    assert_eq!(
        refused(&|o| o.search_radius = -1.0),
        RestirSuffixError::Search(-1.0)
    );
    assert_eq!(
        refused(&|o| o.suffixes.candidates = 0),
        RestirSuffixError::Suffixes(RestirPtError::Candidates(0))
    );
    let error = refused(&|o| o.suffixes.min_roughness = 0.0).to_string();
    assert!(error.contains("roughness"), "{error}");
}
