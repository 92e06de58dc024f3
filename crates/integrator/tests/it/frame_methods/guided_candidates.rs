//! Guides for paths and prefixes that are resampled.

use super::ensemble::Ensemble;
use super::restir_pt::truth;
use super::scenes::{cornell_without_light, every_emitter, small_description};
use lightshed_film::FrameMethod;
use lightshed_integrator::{
    AnyEmitters, CameraMotion, GuideError, GuideKind, GuideSource, GuidedPathsOptions, GuidedWorlds,
    Neighbourhood, PathGuiding, PathMapping, PixelSensor, RestirPt, RestirPtOptions, RestirSuffix,
    RestirSuffixOptions, SceneWorld, Stage,
};
use lightshed_resampling::{Pulled, ShiftMapping, Shifted, Undefined};
use lightshed_scene::{Rgb, Scene, builtin};
use lightshed_shift::{PathDomain, PathShift, check_world};
use lightshed_testkit::check_faults;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

type World<'w> = SceneWorld<'w, AnyEmitters<'w>>;
type Domain<'w> = PathDomain<'w, World<'w>>;

/// What is done wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Jacobians have the densities of the BSDF alone where a path goes.
    DensityOfBsdf,
    /// They have those of an earlier frame's guide.
    GuideOfOtherFrame,
}

/// The shift, whose Jacobian is that into another world if there is one.
#[derive(Clone, Copy)]
struct Faulty<'w>(Option<&'w World<'w>>);

impl<'w> Faulty<'w> {
    fn twin(self, of: &Domain<'w>) -> Option<Domain<'w>> {
        let (first, wo) = of.first()?;
        Some(PathDomain::behind(
            self.0?,
            first.clone(),
            wo,
            of.connectability(),
            u32::MAX,
        ))
    }
}

impl<'w> ShiftMapping<Domain<'w>> for Faulty<'w> {
    fn shift(
        &self,
        x: &lightshed_shift::PathSample,
        from: &Domain<'w>,
        to: &Domain<'w>,
    ) -> Result<Shifted<lightshed_shift::PathSample>, Undefined> {
        let shift = PathShift::default();
        let mut image = shift.shift(x, from, to)?;
        if let Some(twin) = self.twin(to)
            && let Ok(other) = shift.shift(x, from, &twin)
        {
            image.jacobian = other.jacobian;
        }
        Ok(image)
    }

    fn pull(
        &self,
        y: &lightshed_shift::PathSample,
        to: &Domain<'w>,
        from: &Domain<'w>,
    ) -> Result<Pulled, Undefined> {
        let shift = PathShift::default();
        let mut pulled = shift.pull(y, to, from)?;
        if let Some(twin) = self.twin(from)
            && let Ok(other) = shift.pull(y, to, &twin)
        {
            pulled.jacobian = other.jacobian;
        }
        Ok(pulled)
    }
}

/// A guide that learns fast.
fn guide(kind: GuideKind) -> GuidedPathsOptions {
    GuidedPathsOptions {
        samples: 8,
        ..GuidedPathsOptions::new(kind)
    }
}

/// Worlds of a chain's own.
fn worlds<'w>(stage: &'w Stage<'w>) -> &'w GuidedWorlds<'w, AnyEmitters<'w>> {
    stage.guided_worlds(None).unwrap()
}

/// What a shift with this fault asks.
fn faulty<'w>(worlds: &'w GuidedWorlds<'w, AnyEmitters<'w>>, fault: Option<Fault>) -> Faulty<'w> {
    Faulty(fault.map(|fault| match fault {
        Fault::DensityOfBsdf => worlds.first(),
        Fault::GuideOfOtherFrame => worlds.world(1),
    }))
}

fn scenes() -> [(&'static str, Scene); 4] {
    let mut zoo = crate::shifts::zoo();
    zoo.settings.max_depth = Some(4);
    (zoo.settings.width, zoo.settings.height) = (24, 24);
    let mut glossy = cornell_without_light(builtin::cornell_glossy(), 24);
    glossy.settings.max_depth = Some(4);
    let mut doorway = small_description(builtin::by_name("doorway").unwrap(), 16);
    doorway.settings.max_depth = Some(4);
    [
        ("every emitter", every_emitter(32, 4)),
        ("cornell-glossy", Scene::new(&glossy).unwrap()),
        ("zoo", Scene::new(&zoo).unwrap()),
        ("doorway", Scene::new(&doorway).unwrap()),
    ]
}

fn paths() -> RestirPtOptions {
    RestirPtOptions {
        neighbourhood: Neighbourhood::Disk {
            radius: 6.0,
            count: 3,
        },
        ..RestirPtOptions::real_time(PathMapping::Hybrid)
    }
}

fn prefixes() -> RestirSuffixOptions {
    RestirSuffixOptions {
        suffixes: RestirPtOptions {
            direct_samples: 2,
            ..paths()
        },
        prefixes: 4,
        camera_rays: 2,
        canonical: 2,
        borrowed: 2,
        ..RestirSuffixOptions::real_time(PathMapping::Hybrid)
    }
}

/// Frames before, between and after the times at which the guide learns.
#[test]
fn guided_paths_that_pixels_share_agree_with_path_tracing() {
    for (name, scene) in scenes() {
        let truth = truth(&scene, 50);
        for kind in [GuideKind::Quadtree, GuideKind::Vmf] {
            let stage = Stage::new(&scene);
            let make = || {
                let worlds = worlds(&stage);
                let guiding = PathGuiding::new(worlds, guide(kind)).unwrap();
                let method = RestirPt::new(worlds.first(), paths(), CameraMotion::STILL).unwrap();
                method.with_guiding(guiding)
            };
            let agreement = Ensemble::of_chains(make, 1..6, 40, 1).compare(&truth);
            println!("{name}, {kind:?}: {agreement:?}");
            agreement.verdict().unwrap();
        }
    }
}

/// Guides that learn from the paths that pixels hold, in frames before, between and after the times
/// at which they do. Without the rule that everything held is forgotten then, it is not so.
#[test]
fn guides_that_learn_from_reservoirs_agree_with_path_tracing() {
    for (name, scene) in scenes() {
        let truth = truth(&scene, 50);
        let sources = [
            (GuideKind::Quadtree, GuideSource::Both),
            (GuideKind::Vmf, GuideSource::Reservoirs),
            (GuideKind::Mixture, GuideSource::Reservoirs),
        ];
        for (kind, source) in sources {
            let stage = Stage::new(&scene);
            let make = || {
                let worlds = worlds(&stage);
                let guiding = PathGuiding::new(worlds, guide(kind)).unwrap();
                let method = RestirPt::new(worlds.first(), paths(), CameraMotion::STILL).unwrap();
                method.with_guiding_from(guiding, source)
            };
            let agreement = Ensemble::of_chains(make, 1..6, 40, 1).compare(&truth);
            println!("{name}, {kind:?} from {source:?}: {agreement:?}");
            agreement.verdict().unwrap();
        }
    }
}

#[test]
fn guided_prefixes_agree_with_path_tracing() {
    for (name, scene) in scenes() {
        let truth = truth(&scene, 50);
        let stage = Stage::new(&scene);
        let make = || {
            let worlds = worlds(&stage);
            let guiding = PathGuiding::new(worlds, guide(GuideKind::Quadtree)).unwrap();
            let method = RestirSuffix::new(worlds.first(), prefixes(), CameraMotion::STILL).unwrap();
            method.with_guiding(guiding)
        };
        let agreement = Ensemble::of_chains(make, 1..6, 40, 1).compare(&truth);
        println!("{name}: {agreement:?}");
        agreement.verdict().unwrap();
    }
}

/// Paths from afar, where Jacobians matter, in the last of some frames.
#[test]
fn densities_without_the_guide_are_found() {
    let mut glossy = cornell_without_light(builtin::cornell_glossy(), 24);
    glossy.settings.max_depth = Some(4);
    let scene = Scene::new(&glossy).unwrap();
    let truth = truth(&scene, 100);
    let far = RestirPtOptions {
        rounds: 3,
        neighbourhood: Neighbourhood::Disk {
            radius: 16.0,
            count: 5,
        },
        ..paths()
    };
    let faults = [Fault::DensityOfBsdf, Fault::GuideOfOtherFrame];
    check_faults(&faults, |fault| {
        let stage = Stage::new(&scene);
        let make = || {
            let worlds = worlds(&stage);
            let guiding = PathGuiding::new(worlds, guide(GuideKind::Quadtree)).unwrap();
            let method = RestirPt::new(worlds.first(), far, CameraMotion::STILL).unwrap();
            method.with_guiding(guiding).with_shift(faulty(worlds, fault))
        };
        let chains = if fault.is_some() { 40 } else { 100 };
        let agreement = Ensemble::of_chains(make, 5..8, chains, 1).compare(&truth);
        println!("{fault:?}: {agreement:?}");
        // Wrong weights of a frame multiply those of the next: then the mean is thousands of times
        // as bright, and its standard error as wide.
        match agreement.whole.iter().any(|[off, ..]| !(off.abs() < 0.5)) {
            true => Err(format!("{agreement:?}")),
            false => agreement.verdict(),
        }
    })
    .unwrap();
}

/// Guided worlds keep the laws that shifts rest on, at surfaces of every kind.
#[test]
fn guided_worlds_keep_the_laws() {
    let mut zoo = crate::shifts::zoo();
    (zoo.settings.width, zoo.settings.height) = (24, 24);
    let scene = Scene::new(&zoo).unwrap();
    let camera = Arc::new(scene.camera().clone());
    let sensors: Vec<PixelSensor> = (0..64)
        .map(|place| PixelSensor {
            camera: Arc::clone(&camera),
            pixel: [place % 8 * 3, place / 8 * 3],
        })
        .collect();
    let stage = Stage::new(&scene);
    let worlds = worlds(&stage);
    let guiding = PathGuiding::new(worlds, guide(GuideKind::Quadtree)).unwrap();
    let method = RestirPt::new(worlds.first(), paths(), CameraMotion::STILL).unwrap();
    let mut method = method.with_guiding(guiding);
    let mut image = vec![Rgb::ZERO; 24 * 24];
    for frame in 0..5 {
        let counts = method.render_frame(frame, 1, &mut image, &AtomicBool::new(false));
        assert!(counts.is_some_and(|rays| rays.path > 0));
    }
    assert!(worlds.first().guide().is_none());
    let regions = worlds
        .world(3)
        .guide()
        .map(lightshed_integrator::SceneField::learnt_regions);
    assert!(regions.is_some_and(|regions| regions > 0), "{regions:?}");
    assert!(worlds.world(4).guide().is_none(), "frames 0, 1 and 3 taught");
    let tally = check_world(worlds.world(3), &[], &sensors, 1).unwrap();
    assert!(tally.scattering_densities >= 16, "{tally:?}");
    let again = PathGuiding::new(worlds, guide(GuideKind::Quadtree)).err();
    assert_eq!(again, Some(GuideError::Used));
}

/// A guide learns from what pixels hold, without a ray beside those of replays, and everything held
/// is forgotten then.
#[test]
fn reservoirs_teach_and_are_forgotten() {
    let (_, scene) = scenes().into_iter().next().unwrap();
    let stage = Stage::new(&scene);
    let worlds = worlds(&stage);
    let guiding = PathGuiding::new(worlds, guide(GuideKind::Vmf)).unwrap();
    let method = RestirPt::new(worlds.first(), paths(), CameraMotion::STILL).unwrap();
    let mut method = method.with_guiding_from(guiding, GuideSource::Reservoirs);
    let plain = RestirPt::new(stage.world(None).unwrap(), paths(), CameraMotion::STILL);
    let (mut plain, mut image) = (plain.unwrap(), vec![Rgb::ZERO; 32 * 32]);
    let held = |figures: Vec<(&'static str, f64)>| {
        let held = figures.into_iter().find(|(name, _)| *name == "held_samples");
        held.unwrap().1
    };
    for frame in 0..6 {
        let rays = method.render_frame(frame, 5, &mut image, &AtomicBool::new(false));
        let unguided = plain.render_frame(frame, 5, &mut image, &AtomicBool::new(false));
        let (rays, unguided) = (rays.unwrap(), unguided.unwrap());
        assert!(rays.path < 2 * unguided.path, "{rays:?}, {unguided:?}");
        // The guide learns after the first, the second and the fourth frame.
        let learns = [0, 1, 3].contains(&frame);
        assert_eq!(held(method.figures()) == 0.0, learns, "frame {frame}");
    }
    let regions = worlds
        .world(3)
        .guide()
        .map(lightshed_integrator::SceneField::learnt_regions);
    assert!(regions.is_some_and(|regions| regions > 0), "{regions:?}");
}

/// The same image for any number of threads, also after the guide has learnt.
#[test]
fn guided_frames_do_not_depend_on_threads() {
    let (_, scene) = scenes().into_iter().next().unwrap();
    let images = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let stage = Stage::new(&scene);
            let worlds = worlds(&stage);
            let guiding = PathGuiding::new(worlds, guide(GuideKind::Vmf)).unwrap();
            let method = RestirSuffix::new(worlds.first(), prefixes(), CameraMotion::STILL).unwrap();
            let mut method = method.with_guiding(guiding);
            let mut image = vec![Rgb::ZERO; 32 * 32];
            for frame in 0..4 {
                let counts = method.render_frame(frame, 5, &mut image, &AtomicBool::new(false));
                assert!(counts.is_some());
            }
            image
        })
    });
    assert!(images[0] == images[1]);
}
