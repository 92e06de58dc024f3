//! Published scenes, which are no part of this repository: `LIGHTSHED_SCENES` names their folder,
//! in Mitsuba 3's format. `LIGHTSHED_CHAINS` multiplies the number of chains, and with it the work.

use super::ensemble::Ensemble;
use lightshed_integrator::{
    DirectLight, DirectLightOptions, PathReuse, PathTracer, RestirDi, RestirDiSettings,
};
use lightshed_scene::Scene;
use lightshed_scene::import::load;

/// Small images of a door ajar, an atrium and the Cornell box, and how often all of it is done;
/// `None` without the folder.
fn scenes() -> Option<(Vec<(&'static str, Scene)>, u32)> {
    let Some(folder) = std::env::var_os("LIGHTSHED_SCENES") else {
        println!("SKIPPED: LIGHTSHED_SCENES is not set");
        return None;
    };
    let times = std::env::var("LIGHTSHED_CHAINS").map_or(1, |times| times.parse().expect("a number"));
    let sizes = [
        ("cornell", [128, 128]),
        ("sponza_crytek", [240, 135]),
        ("veach_ajar", [240, 135]),
    ];
    let scene = |(name, size): (&'static str, [u32; 2])| {
        let file = std::path::Path::new(&folder).join(name).join("scene.xml");
        let loaded = load(file, &[]).unwrap_or_else(|error| panic!("{}", error.chain()));
        let mut description = loaded.description;
        [description.settings.width, description.settings.height] = size;
        description.settings.max_depth = Some(6);
        (name, Scene::new(&description).unwrap())
    };
    Some((sizes.map(scene).into(), times))
}

fn size(scene: &Scene) -> [u32; 2] {
    [scene.settings().width, scene.settings().height]
}

#[test]
fn direct_light_by_reuse_agrees_in_published_scenes() {
    let Some((scenes, times)) = scenes() else { return };
    for (name, scene) in scenes {
        let truth = Ensemble::of_estimator(
            &DirectLight::new(&scene, scene.emitters_by_power(), DirectLightOptions::default()).unwrap(),
            size(&scene),
            6,
            16 * times,
        );
        let frames = Ensemble::of_chains(
            || RestirDi::new(&scene, scene.emitters_by_power(), RestirDiSettings::UNBIASED).unwrap(),
            1..4,
            16 * u64::from(times),
            1,
        );
        let agreement = frames.compare(&truth);
        println!("restir-di, {name}: {agreement:?}");
        agreement.verdict().unwrap();
    }
}

#[test]
fn path_reuse_agrees_in_published_scenes() {
    let Some((scenes, times)) = scenes() else { return };
    for (name, scene) in scenes {
        let truth = Ensemble::of_estimator(
            &PathTracer::new(&scene, scene.emitters_by_power()),
            size(&scene),
            6,
            16 * times,
        );
        let frames = Ensemble::of_chains(
            || PathReuse::new(&scene, scene.emitters_by_power()),
            0..1,
            32 * u64::from(times),
            1,
        );
        let agreement = frames.compare(&truth);
        println!("path-reuse, {name}: {agreement:?}");
        agreement.verdict().unwrap();
    }
}
