//! Paths in cells of space against path tracing.

use super::ensemble::Ensemble;
use super::restir_pt::{Domain, lit_by_the_ceiling, truth};
use super::scenes::{cornell_without_light, every_emitter, small_description};
use lightshed_film::FrameMethod;
use lightshed_integrator::{
    CameraMotion, Neighbourhood, PathMapping, RestirDi, RestirDiSettings, RestirGi, RestirPt, RestirPtError,
    RestirPtOptions, SceneWorld, WorldReuse,
};
use lightshed_resampling::{Domain as _, Jacobian, Pulled, ShiftMapping, Shifted, Undefined};
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{Rgb, Scene, SceneDescription, builtin};
use lightshed_shift::{PathSample, PathShift};
use lightshed_testkit::check_faults;
use std::sync::atomic::AtomicBool;

/// Cells of few pixels, whose sites move often.
fn cells() -> WorldReuse {
    let mut world = WorldReuse::default();
    (world.cell_pixels, world.reservoirs, world.contributors) = (8.0, 4, 6);
    (world.confidence_cap, world.renewal) = (40.0, 3);
    world
}

/// Without reuse on the screen, or beside it.
fn options(both: bool) -> RestirPtOptions {
    let options = RestirPtOptions {
        neighbourhood: Neighbourhood::Disk {
            radius: 6.0,
            count: 3,
        },
        ..RestirPtOptions::real_time(PathMapping::Hybrid)
    };
    options.with_world(cells(), both)
}

fn depths(mut description: SceneDescription, side: u32) -> Scene {
    description = small_description(description, side);
    description.settings.max_depth = Some(4);
    Scene::new(&description).unwrap()
}

/// Frames that cells have served before.
#[test]
fn frames_of_paths_in_cells_agree_with_path_tracing() {
    let mut glossy = cornell_without_light(builtin::cornell_glossy(), 24);
    glossy.settings.max_depth = Some(4);
    let scenes = [
        ("every emitter", every_emitter(32, 4), 80),
        ("cornell-glossy", Scene::new(&glossy).unwrap(), 80),
        ("cornell", depths(builtin::cornell(), 24), 80),
        ("doorway", depths(builtin::doorway(), 24), 120),
        ("many-lights", depths(builtin::many_lights(), 24), 120),
    ];
    for (name, scene, chains) in scenes {
        let truth = truth(&scene, 75);
        let world = SceneWorld::new(&scene, scene.emitters_by_power());
        for both in [false, true] {
            let make = || RestirPt::new(&world, options(both), CameraMotion::STILL).unwrap();
            let agreement = Ensemble::of_chains(make, 2..5, chains, 1).compare(&truth);
            println!("{name}, both {both}: {agreement:?}");
            agreement.verdict().unwrap();
        }
    }
}

/// Cells persist while the camera moves.
#[test]
fn frames_of_paths_in_cells_of_a_moving_camera_agree_with_path_tracing() {
    let per_frame = Vec3::new(0.12, 0.03, 0.05);
    let mut there = cornell_without_light(builtin::cornell_glossy(), 24);
    there.settings.max_depth = Some(4);
    let scene = Scene::new(&there).unwrap();
    there.camera.to_world = Affine3A::from_translation(per_frame * 3.0) * there.camera.to_world;
    let truth = truth(&Scene::new(&there).unwrap(), 80);
    let motion = CameraMotion::translation(per_frame).unwrap();
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    for both in [false, true] {
        let make = || RestirPt::new(&world, options(both), motion).unwrap();
        let agreement = Ensemble::of_chains(make, 3..4, 160, 1).compare(&truth);
        println!("both {both}: {agreement:?}");
        agreement.verdict().unwrap();
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Weights ask the reader, in place of the site, what the site could have produced.
    ReadersDomain,
    /// Shifts are taken for volume-preserving.
    JacobianDropped,
}

struct Faulty(Option<Fault>);

impl<'w> ShiftMapping<Domain<'w>> for Faulty {
    fn shift(
        &self,
        x: &PathSample,
        from: &Domain<'w>,
        to: &Domain<'w>,
    ) -> Result<Shifted<PathSample>, Undefined> {
        let mut image = PathShift::default().shift(x, from, to)?;
        if self.0 == Some(Fault::JacobianDropped) {
            image.jacobian = Jacobian::IDENTITY;
        }
        Ok(image)
    }

    fn pull(&self, y: &PathSample, to: &Domain<'w>, from: &Domain<'w>) -> Result<Pulled, Undefined> {
        match self.0 {
            Some(Fault::ReadersDomain) => Ok(Pulled {
                jacobian: Jacobian::IDENTITY,
                proxy: to.target(y),
            }),
            Some(Fault::JacobianDropped) => PathShift::default().pull(y, to, from).map(|pulled| Pulled {
                jacobian: Jacobian::IDENTITY,
                ..pulled
            }),
            None => PathShift::default().pull(y, to, from),
        }
    }
}

/// In a scene lit indirectly, by cells of most of the image, where determinants differ from 1 and
/// sites do not see what their readers see.
#[test]
fn faults_of_cells_are_detected_in_images() {
    let scene = lit_by_the_ceiling(24);
    let truth = truth(&scene, 120);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let mut options = options(false);
    options.world = options.world.map(|mut world| {
        (world.cell_pixels, world.reads) = (24.0, 4);
        world
    });
    check_faults(&[Fault::ReadersDomain, Fault::JacobianDropped], |fault| {
        let make = || {
            RestirPt::new(&world, options, CameraMotion::STILL)
                .unwrap()
                .with_shift(Faulty(fault))
        };
        let agreement = Ensemble::of_chains(make, 1..4, 130, 1).compare(&truth);
        println!("{fault:?}: {agreement:?}");
        agreement.verdict()
    })
    .unwrap();
}

fn frames(method: &mut dyn FrameMethod, threads: usize) -> (Vec<Rgb>, Vec<(&'static str, f64)>) {
    let [width, height] = method.size();
    let mut image = vec![Rgb::ZERO; (width * height) as usize];
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    for frame in 0..3 {
        pool.install(|| method.render_frame(frame, 7, &mut image, &AtomicBool::new(false)))
            .unwrap();
    }
    (image, method.figures())
}

fn gi_settings(both: bool) -> RestirDiSettings {
    RestirDiSettings::UNBIASED.with_world(cells(), both)
}

/// A frame's bits do not depend on the number of threads, and figures count what cells hold.
#[test]
fn cells_hold_the_same_paths_for_any_number_of_threads() {
    let scene = every_emitter(32, 4);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    for both in [false, true] {
        let paths = || RestirPt::new(&world, options(both), CameraMotion::STILL).unwrap();
        let senders = || RestirGi::new(&scene, scene.emitters_by_power(), gi_settings(both)).unwrap();
        let one = (frames(&mut paths(), 1), frames(&mut senders(), 1));
        for threads in [2, 7] {
            let several = (frames(&mut paths(), threads), frames(&mut senders(), threads));
            assert_eq!(one, several, "{threads} threads, both {both}");
        }
        for (_, figures) in [&one.0, &one.1] {
            let figure = |name: &str| figures.iter().find(|(other, _)| *other == name).unwrap().1;
            assert!(figure("world_cells") > 10.0 && figure("world_cells_refused") == 0.0);
            assert!(figure("world_reservoirs") > figure("world_cells"));
            assert!(figure("distinct_samples") <= figure("held_samples"));
            assert!((0.1..=1.0).contains(&figure("world_distinct_share")));
        }
    }
}

/// The frame after lamps were exchanged shows the new ones alone, with pixels and cells that have
/// served the old ones before.
#[test]
fn nothing_of_a_switched_off_lamp_remains() {
    let lit_by = |colour: Rgb| {
        let mut description = cornell_without_light(builtin::cornell(), 24);
        description.settings.max_depth = Some(4);
        let lamps = description
            .shapes
            .iter_mut()
            .filter_map(|shape| shape.emission.as_mut());
        lamps.for_each(|emission| *emission = colour);
        Scene::new(&description).unwrap()
    };
    let [red, green] = [Rgb::X, Rgb::Y].map(|colour| lit_by(colour * 9.0));
    let worlds = [&red, &green].map(|scene| SceneWorld::new(scene, scene.emitters_by_power()));
    let mut image = vec![Rgb::ZERO; 24 * 24];
    let mut shown = |method: &mut dyn FrameMethod, frames: std::ops::Range<u32>| {
        for frame in frames {
            method
                .render_frame(frame, 3, &mut image, &AtomicBool::new(false))
                .unwrap();
        }
        let sum = image.iter().sum::<Rgb>();
        [sum.x > 0.0, sum.y > 0.0]
    };
    let mut paths = RestirPt::new(&worlds[0], options(true), CameraMotion::STILL).unwrap();
    let mut direct = RestirDi::new(&red, red.emitters_by_power(), gi_settings(true)).unwrap();
    let mut senders = RestirGi::new(&red, red.emitters_by_power(), gi_settings(true)).unwrap();
    assert_eq!(shown(&mut paths, 0..4), [true, false]);
    assert_eq!(shown(&mut direct, 0..4), [true, false]);
    assert_eq!(shown(&mut senders, 0..4), [true, false]);
    paths.change_world(&worlds[1]).unwrap();
    direct.change_scene(&green, green.emitters_by_power()).unwrap();
    senders.change_scene(&green, green.emitters_by_power()).unwrap();
    assert_eq!(shown(&mut paths, 4..5), [false, true]);
    assert_eq!(shown(&mut direct, 4..5), [false, true]);
    assert_eq!(shown(&mut senders, 4..5), [false, true]);
}

#[test]
fn cells_of_paths_out_of_range_are_refused() {
    let scene = every_emitter(8, 3);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let refused = |change: &dyn Fn(&mut RestirPtOptions)| {
        let mut options = options(false);
        change(&mut options);
        RestirPt::new(&world, options, CameraMotion::STILL).err()
    };
    assert_eq!(refused(&|_| ()), None);
    let sensor = refused(&|options| options.path_starts_at_sensor = true);
    assert_eq!(sensor, Some(RestirPtError::WorldSensor));
    let reads = refused(&|options| options.world.iter_mut().for_each(|world| world.reads = 0));
    assert!(matches!(reads, Some(RestirPtError::World(_))));
}
