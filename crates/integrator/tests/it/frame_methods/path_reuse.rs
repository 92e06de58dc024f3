//! Path reuse against path tracing.

use super::ensemble::Ensemble;
use super::scenes::{cornell_without_light, every_emitter};
use lightshed_integrator::{PathReuse, PathTracer};
use lightshed_sampling::PointSet;
use lightshed_scene::{Scene, builtin};

/// Paths of up to four edges: everything that is shared, and what lies beyond; and long ones that
/// roulette ends, whose light differs most, and with it the number of pixels that share it.
/// Planted faults: a path is shared by pixels without its own, or by more of them if the pixel
/// that made it is near (which nobody else's density knows).
#[test]
fn frames_agree_with_path_tracing() {
    let mut glossy = cornell_without_light(builtin::cornell_glossy(), 24);
    glossy.settings.max_depth = Some(4);
    let mut hidden = cornell_without_light(builtin::cornell(), 24);
    hidden.camera.fov_x = 0.3;
    hidden.settings.max_depth = Some(3);
    let mut ended = cornell_without_light(builtin::cornell(), 24);
    (ended.settings.max_depth, ended.settings.roulette_depth) = (Some(8), 2);
    let scenes = [
        ("cornell", Scene::new(&hidden).unwrap()),
        ("cornell-glossy", Scene::new(&glossy).unwrap()),
        ("every emitter", every_emitter(24, 4)),
        ("roulette", Scene::new(&ended).unwrap()),
    ];
    for (name, scene) in scenes {
        let truth = Ensemble::of_estimator(
            &PathTracer::new(&scene, scene.emitters_by_power()),
            [24, 24],
            16,
            60,
        );
        let plain = || PathReuse::new(&scene, scene.emitters_by_power());
        let stratified = || plain().with_points(PointSet::Sobol).with_visible_emission();
        let chains = if name == "roulette" { 900 } else { 350 };
        let frames = Ensemble::of_chains(plain, 0..1, chains, 1);
        let pairs = Ensemble::of_chains(stratified, 0..2, chains / 2, 1);
        for frames in [frames, pairs] {
            let agreement = frames.compare(&truth);
            println!("{name}: {agreement:?}");
            agreement.verdict().unwrap();
        }
    }
}
