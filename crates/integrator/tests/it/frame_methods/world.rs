//! Reservoirs in cells of space against direct light.

use super::direct::{agree_under_motion, settings, truth};
use super::ensemble::Ensemble;
use super::scenes::every_emitter;
use lightshed_film::FrameMethod;
use lightshed_integrator::{RestirDi, RestirDiError, RestirDiSettings, WorldReuse};
use lightshed_scene::Rgb;
use lightshed_testkit::check_faults;
use std::sync::atomic::AtomicBool;

/// Cells of few pixels, whose sites move often, without reuse on the screen.
fn in_cells() -> RestirDiSettings {
    let mut world = WorldReuse::default();
    (world.cell_pixels, world.reservoirs, world.contributors) = (8.0, 4, 6);
    (world.confidence_cap, world.renewal) = (40.0, 3);
    settings().with_world(world, false)
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Cells alone, which do not see all that their pixels see.
    CellsAlone,
}

/// Frames that cells have served before, in a scene with every kind of emitter.
#[test]
fn frames_with_cells_agree_with_direct_light() {
    let scene = every_emitter(32, 2);
    let truth = truth(&scene, 100);
    check_faults(&[Fault::CellsAlone], |fault| {
        let mut settings = in_cells();
        settings.biased = fault.is_some();
        let make = || RestirDi::new(&scene, scene.emitters_by_power(), settings).unwrap();
        let agreement = Ensemble::of_chains(make, 2..5, 90, 1).compare(&truth);
        println!("{fault:?}: {agreement:?}");
        agreement.verdict()
    })
    .unwrap();
}

/// Cells persist while the camera moves; on the screen as well as in space.
#[test]
fn frames_with_cells_of_a_moving_camera_agree_with_direct_light() {
    let mut settings = in_cells();
    (settings.temporal_reuse, settings.spatial_rounds) = (true, 1);
    agree_under_motion(settings);
}

/// A frame's bits do not depend on the number of threads, and figures count what cells hold.
#[test]
fn cells_hold_the_same_for_any_number_of_threads() {
    let scene = every_emitter(32, 2);
    let render = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut method = RestirDi::new(&scene, scene.emitters_by_power(), in_cells()).unwrap();
        let mut image = vec![Rgb::ZERO; 32 * 32];
        for frame in 0..3 {
            pool.install(|| method.render_frame(frame, 7, &mut image, &AtomicBool::new(false)))
                .unwrap();
        }
        (image, method.figures())
    };
    let (image, figures) = render(1);
    assert_eq!(render(3), (image, figures.clone()));
    let figure = |name: &str| figures.iter().find(|(other, _)| *other == name).unwrap().1;
    assert!(figure("world_cells") > 10.0 && figure("world_cells_refused") == 0.0);
    assert!(figure("distinct_samples") <= figure("held_samples"));
    assert!((0.1..=1.0).contains(&figure("world_distinct_share")));
}

#[test]
fn cells_out_of_range_are_refused() {
    let scene = every_emitter(8, 2);
    let refused = |change: &dyn Fn(&mut WorldReuse)| {
        let mut world = WorldReuse::default();
        change(&mut world);
        let mut settings = in_cells();
        settings.world = Some(world);
        let method = RestirDi::new(&scene, scene.emitters_by_power(), settings);
        matches!(method.err(), Some(RestirDiError::World(_)))
    };
    assert!(!refused(&|_| ()));
    assert!(refused(&|world| world.cell_pixels = f32::NAN));
    assert!(refused(&|world| world.confidence_cap = 0.0));
    assert!(refused(&|world| world.reads = 0));
    assert!(refused(&|world| world.reservoirs = 65));
    assert!(refused(&|world| world.slots = 0));
    assert!(refused(&|world| world.renewal = 0));
}
