//! What earlier samples have trained, guides and light caches, against path tracing by tiles.
//!
//! Each scene has a test of its own, of some minutes:
//! `cargo test --release -p lightshed-integrator --test it -- --ignored learnt --nocapture`. The
//! means of images are known to about two thousandths; the verdict is that of [`Agreement`], with a
//! false-positive rate of 3·10⁻⁵ for each method and scene, as far as the central limit holds.

use super::ensemble::{Agreement, Ensemble};
use super::scenes::{cornell_without_light, every_emitter, small, small_description};
use crate::guides::large_flames;
use lightshed_integrator::{
    DirectLight, DirectLightOptions, EmitterSampler, GuideKind, GuidedPaths, GuidedPathsOptions,
    LightChoosing, LightSelection, PathTracer, RestirDi, RestirDiSettings,
};
use lightshed_scene::import::load;
use lightshed_scene::{Scene, SceneDescription, builtin};

/// Independent chains of each method.
const CHAINS: u64 = 100;

/// Frames of a chain: the guide has learnt after 1, 2 and 4 of them.
const FRAMES: u32 = 8;

fn guided<'a, S: EmitterSampler + Copy + Send>(
    scene: &'a Scene,
    sampler: S,
    kind: GuideKind,
) -> GuidedPaths<'a, S> {
    let mut options = GuidedPathsOptions::new(kind);
    (options.training, options.may_drop) = (16, false);
    (options.field.split_above, options.field.collapse_below) = (200, 100);
    GuidedPaths::new(scene, sampler, options).unwrap()
}

fn size(scene: &Scene) -> [u32; 2] {
    [scene.settings().width, scene.settings().height]
}

fn judge(scene: &str, method: &str, agreement: &Agreement) -> Result<(), String> {
    println!("{scene}, {method}: {agreement:?}");
    agreement
        .verdict()
        .map_err(|error| format!("{scene}, {method}: {error}"))
}

/// Path tracing with every guide and with a light cache, alone and together; direct light with a
/// light cache, alone and reused. The truth is made of so many images of 16 samples a pixel.
fn agrees(name: &str, scene: &Scene, images: u32) {
    let by_power = scene.emitters_by_power();
    let truth = Ensemble::of_estimator(&PathTracer::new(scene, by_power), size(scene), 16, images);
    for kind in GuideKind::ALL {
        let guide = format!("path --guide {}", kind.name());
        let frames = Ensemble::of_chains(|| guided(scene, by_power, kind), 0..FRAMES, CHAINS, 1);
        judge(name, &guide, &frames.compare(&truth)).unwrap();
    }
    // Caches are trained once: their samples are independent from then on.
    let cache = LightSelection::trained(scene, LightChoosing::Vlc).unwrap();
    let tracer = PathTracer::new(scene, &cache);
    let paths = Ensemble::of_seeded_estimator(&tracer, size(scene), 16, images, 2);
    judge(name, "path --lights vlc", &paths.compare(&truth)).unwrap();
    let both = || guided(scene, &cache, GuideKind::Quadtree);
    let frames = Ensemble::of_chains(both, 0..FRAMES, CHAINS, 1);
    judge(name, "path --guide cdq --lights vlc", &frames.compare(&truth)).unwrap();

    let options = DirectLightOptions::samples(1, 1);
    let direct = |sampler| DirectLight::new(scene, sampler, options).unwrap();
    let plain = LightSelection::new(scene, LightChoosing::Power).unwrap();
    let truth = Ensemble::of_estimator(&direct(&plain), size(scene), 16, images);
    let cached = Ensemble::of_seeded_estimator(&direct(&cache), size(scene), 16, images, 2);
    judge(name, "direct --lights vlc", &cached.compare(&truth)).unwrap();
    let reused = || RestirDi::new(scene, &cache, RestirDiSettings::UNBIASED).unwrap();
    let frames = Ensemble::of_chains(reused, 0..4, CHAINS, 1);
    judge(name, "restir-di --lights vlc", &frames.compare(&truth)).unwrap();
}

/// A published scene, if `LIGHTSHED_SCENES` names their folder.
fn published(name: &str, side: u32) -> Option<Scene> {
    let folder = std::env::var_os("LIGHTSHED_SCENES")?;
    let file = std::path::Path::new(&folder).join(name).join("scene.xml");
    let loaded = load(file, &[]).unwrap_or_else(|error| panic!("{}", error.chain()));
    let mut description = loaded.description;
    description.settings.max_depth = Some(6);
    Some(small(description, side))
}

fn shallow(mut description: SceneDescription, side: u32) -> SceneDescription {
    description.settings.max_depth = Some(5);
    small_description(description, side)
}

#[test]
#[ignore = "takes minutes"]
fn learnt_methods_agree_in_a_glossy_box() {
    let description = cornell_without_light(shallow(builtin::cornell_glossy(), 32), 32);
    agrees("cornell-glossy", &Scene::new(&description).unwrap(), 200);
}

#[test]
#[ignore = "takes minutes"]
fn learnt_methods_agree_in_the_lighthouse() {
    agrees("lighthouse", &small(builtin::lighthouse(), 32), 1200);
}

#[test]
#[ignore = "takes minutes"]
fn learnt_methods_agree_behind_a_doorway() {
    let scene = Scene::new(&shallow(builtin::doorway(), 32)).unwrap();
    agrees("doorway", &scene, 300);
}

#[test]
#[ignore = "takes minutes"]
fn learnt_methods_agree_under_every_emitter() {
    agrees("every emitter", &every_emitter(32, 4), 1000);
}

#[test]
#[ignore = "takes minutes"]
fn learnt_methods_agree_in_the_warehouse() {
    let scene = Scene::new(&shallow(builtin::warehouse(), 32)).unwrap();
    agrees("warehouse", &scene, 1200);
}

#[test]
#[ignore = "takes minutes"]
fn learnt_methods_agree_behind_a_door_ajar() {
    if let Some(scene) = published("veach_ajar", 32) {
        agrees("veach_ajar", &scene, 400);
    }
}

#[test]
#[ignore = "takes minutes"]
fn learnt_methods_agree_in_the_atrium() {
    if let Some(scene) = published("sponza_crytek", 32) {
        agrees("sponza_crytek", &scene, 200);
    }
}

/// Chains in cells of a hash grid, of eight and of one state, and in a table that is full, against
/// the truth of `expected`; `sampler` guides.
fn cells_agree(name: &str, scene: &Scene, expected: &LightSelection, sampler: &LightSelection, images: u32) {
    let tracer = PathTracer::new(scene, expected);
    let truth = Ensemble::of_estimator(&tracer, size(scene), 16, images);
    for (states, memory) in [(8, 8 << 20), (1, 8 << 20), (8, 32 << 10)] {
        let make = || {
            let mut options = GuidedPathsOptions::new(GuideKind::MixtureGrid);
            (options.training, options.may_drop) = (16, false);
            (options.field.split_above, options.field.collapse_below) = (200, 100);
            (options.states, options.memory) = (states, memory);
            GuidedPaths::new(scene, sampler, options).unwrap()
        };
        let method = format!("{states} states in {} KiB", memory >> 10);
        let frames = Ensemble::of_chains(make, 0..FRAMES, CHAINS, 1);
        judge(name, &method, &frames.compare(&truth)).unwrap();
    }
}

/// The same with one choice of emitters, by power.
fn cells_agree_by_power(name: &str, scene: &Scene, images: u32) {
    let by_power = LightSelection::new(scene, LightChoosing::Power).unwrap();
    cells_agree(name, scene, &by_power, &by_power, images);
}

#[test]
#[ignore = "takes minutes"]
fn cells_of_chains_agree_in_a_glossy_box() {
    let description = cornell_without_light(shallow(builtin::cornell_glossy(), 32), 32);
    cells_agree_by_power("cornell-glossy", &Scene::new(&description).unwrap(), 200);
}

#[test]
#[ignore = "takes minutes"]
fn cells_of_chains_agree_by_large_flames() {
    let scene = Scene::new(&shallow(large_flames(), 32)).unwrap();
    let [list, unfound] =
        [LightChoosing::Bvh, LightChoosing::Unfound].map(|rule| LightSelection::new(&scene, rule).unwrap());
    cells_agree("large flames", &scene, &list, &unfound, 300);
}

#[test]
#[ignore = "takes minutes"]
fn cells_of_chains_agree_in_the_pool() {
    let mut description = small_description(builtin::pool(), 32);
    description.settings.max_depth = Some(3);
    cells_agree_by_power("pool", &Scene::new(&description).unwrap(), 600);
}

#[test]
#[ignore = "takes minutes"]
fn cells_of_chains_agree_behind_a_door_ajar() {
    if let Some(scene) = published("veach_ajar", 32) {
        cells_agree_by_power("veach_ajar", &scene, 400);
    }
}
