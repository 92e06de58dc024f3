//! Every way of choosing an emitter gives the same image, and the same as choosing by power alone
//! does.
//!
//! Images are compared by tiles, each channel apart, with seeds of their own. A sound
//! implementation fails a comparison with probability 1e-5; there are about twenty without data,
//! and as many in the scenes of `LIGHTSHED_SCENES`.

use crate::common::data_folder;
use crate::rendered::{Rendered, compare};
use lightshed_film::{Film, FrameMethod, MAX_BATCH, PixelEstimator, SampleId};
use lightshed_integrator::{
    CutTree, DirectLight, DirectLightOptions, EmitterSampler, LightChoosing, LightSelection, LightcutOptions,
    Lightcuts, PathTracer,
};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::import::load;
use lightshed_scene::{
    EmitterDescription, Geometry, Material, Rgb, Scene, SceneDescription, ShapeDescription, SphereGeometry,
    builtin,
};
use lightshed_testkit::check_faults;
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

/// Many lights of all kinds, and a rough conductor among the occluders.
fn mixed_lights() -> SceneDescription {
    let mut scene = builtin::many_lights();
    [scene.settings.width, scene.settings.height] = [32, 32];
    scene.shapes.push(ShapeDescription {
        name: "ball".to_owned(),
        geometry: Geometry::Sphere(SphereGeometry {
            center: Vec3::new(0.0, 1.0, 0.0),
            radius: 0.3,
            flip_normals: false,
        }),
        material: 0,
        emission: Some(Rgb::new(2.0, 3.0, 4.0)),
    });
    scene.emitters.push(EmitterDescription::Point {
        position: Vec3::new(2.0, 2.0, 1.0),
        intensity: Rgb::new(3.0, 1.0, 1.0),
    });
    scene.emitters.push(EmitterDescription::Spot {
        position: Vec3::new(-2.0, 3.0, 1.0),
        direction: Vec3::NEG_Y,
        intensity: Rgb::splat(60.0),
        beam_width: 0.3,
        cutoff_angle: 0.6,
    });
    scene.emitters.push(EmitterDescription::Constant {
        radiance: Rgb::splat(0.05),
    });
    scene.emitters.push(EmitterDescription::Directional {
        direction: Vec3::new(0.3, -0.9, 0.1).normalize(),
        irradiance: Rgb::splat(0.1),
    });
    scene
}

/// Edge of the tiles. By uniform choice, and where a two-level tree's boxes overlap, the brightest
/// emitters are met so seldom that only the whole image averages them: a tile of `oacmpctf3` that
/// reads 0.85 after 500 samples reads 0.95 after 12,000.
fn tile_size(choosing: LightChoosing, size: [u32; 2]) -> usize {
    match choosing {
        LightChoosing::Uniform | LightChoosing::TwoLevel => size[0].max(size[1]) as usize,
        _ => 16,
    }
}

/// Leaves out pixels that see more than the sky: where a small emitter is met by one camera ray in
/// a thousand, noise is too skewed to be judged.
struct Mask(Vec<bool>);

impl Mask {
    fn new(scene: &Scene, size: [u32; 2]) -> Self {
        let seen = Rendered::new(
            &PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(1), 1),
            size,
            2048,
            99,
        );
        Self(seen.mean.iter().map(|&value| value > 0.0501).collect())
    }

    fn apply(&self, image: &mut Rendered) {
        for (index, _) in self.0.iter().enumerate().filter(|&(_, &hidden)| hidden) {
            (image.mean[index], image.variance_of_mean[index]) = (0.0, 0.0);
        }
    }
}

/// What all tests of [`mixed_lights`] leave out.
static MIXED_MASK: LazyLock<Mask> =
    LazyLock::new(|| Mask::new(&Scene::new(&mixed_lights()).unwrap(), [32, 32]));

/// Their direct light, chosen by power.
static MIXED_DIRECT_LIGHT: LazyLock<Rendered> = LazyLock::new(|| {
    let scene = Scene::new(&mixed_lights()).unwrap();
    let mut image = Rendered::new(
        &DirectLight::new(&scene, scene.emitters_by_power(), DirectLightOptions::default()).unwrap(),
        [32, 32],
        4096,
        1,
    );
    MIXED_MASK.apply(&mut image);
    image
});

fn selected(
    scene: &Scene,
    choosing: LightChoosing,
    each: u32,
    camera_strata: u32,
) -> DirectLight<'_, LightSelection<'_>> {
    let selection = LightSelection::trained(scene, choosing).unwrap();
    let options = DirectLightOptions {
        bsdf_samples_where_diffuse: false,
        camera_strata,
        ..DirectLightOptions::samples(each, 1)
    };
    DirectLight::new(scene, selection, options).unwrap()
}

#[test]
fn every_selection_gives_the_same_direct_light() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// All counts for 4 % too much, as with a pmf that is not the one sampled.
        Brighter,
        /// The spot is missing from the selection.
        NoSpot,
    }
    let (description, size) = (mixed_lights(), [32, 32]);
    let (mask, expected) = (&*MIXED_MASK, &*MIXED_DIRECT_LIGHT);
    for (seed, choosing) in (2..).zip(LightChoosing::ALL) {
        let faults = match choosing {
            LightChoosing::OpenBvh => &[Fault::Brighter, Fault::NoSpot][..],
            _ => &[],
        };
        check_faults(faults, |fault| {
            let mut description = description.clone();
            if let Some(Fault::NoSpot) = fault {
                description.emitters.remove(1);
            }
            let scene = Scene::new(&description).unwrap();
            let estimator = selected(&scene, choosing, 4, 2);
            let mut found = Rendered::new(&estimator, size, 64, seed);
            if let Some(Fault::Brighter) = fault {
                found.mean.iter_mut().for_each(|value| *value *= 1.04);
            }
            mask.apply(&mut found);
            compare(&found, expected, tile_size(choosing, size))
        })
        .unwrap_or_else(|error| panic!("{}: {error:?}", choosing.name()));
    }
}

/// Frames of stochastic lightcuts, through both trees, with and without interleaving, against
/// choosing by power.
#[test]
fn lightcuts_give_the_same_direct_light() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Brighter,
        NoSpot,
        /// Only every other frame of the interleaving is seen.
        HalfTheFrames,
    }
    let (description, size) = (mixed_lights(), [32, 32]);
    let (mask, expected) = (&*MIXED_MASK, &*MIXED_DIRECT_LIGHT);
    let usual = LightcutOptions::default();
    let all = [Fault::Brighter, Fault::NoSpot];
    let cases = [
        (usual, &all[..]),
        (
            LightcutOptions {
                interleaving: 2,
                subtrees: 24,
                rebuild: true,
                ..usual
            },
            &[Fault::HalfTheFrames],
        ),
        (
            LightcutOptions {
                tree: CutTree::Bvh,
                block: 5,
                subtrees: 13,
                ..usual
            },
            &[],
        ),
    ];
    for (seed, (options, faults)) in (20..).zip(cases) {
        check_faults(faults, |fault| {
            let mut description = description.clone();
            if let Some(Fault::NoSpot) = fault {
                description.emitters.remove(1);
            }
            let scene = Scene::new(&description).unwrap();
            let mut method = Lightcuts::new(&scene, options).unwrap();
            let frames = 256;
            let (mut film, mut image) = (Film::new(32, 32).unwrap(), vec![Rgb::ZERO; 1024]);
            for frame in 0..frames {
                let number = match fault {
                    Some(Fault::HalfTheFrames) => 2 * frame,
                    _ => frame,
                };
                let done = method.render_frame(number, seed, &mut image, &AtomicBool::new(false));
                assert!(done.is_some());
                for (place, &value) in (0..).zip(&image) {
                    film.add(place % 32, place / 32, value);
                }
            }
            let mut found = Rendered::of(&film, size, frames);
            if let Some(Fault::Brighter) = fault {
                found.mean.iter_mut().for_each(|value| *value *= 1.04);
            }
            mask.apply(&mut found);
            compare(&found, expected, 16)
        })
        .unwrap_or_else(|error| panic!("{options:?}: {error:?}"));
    }
}

/// Paths of up to four edges there by the path tracer that chooses by power, one emitter at each
/// vertex.
static MIXED_PATHS: LazyLock<Rendered> = LazyLock::new(|| {
    let scene = Scene::new(&mixed_lights()).unwrap();
    let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(4), 3);
    let mut image = Rendered::new(&tracer, [32, 32], 1024, 1);
    MIXED_MASK.apply(&mut image);
    image
});

/// Paths with several samples of the emitters at their first vertices. Planted faults: weights by
/// the power heuristic of one sample, at emitters or where directions meet them; a stratum twice.
#[test]
fn several_emitter_samples_give_the_same_paths() {
    let scene = Scene::new(&mixed_lights()).unwrap();
    let size = [32, 32];
    let selected = |choosing| LightSelection::new(&scene, choosing).unwrap();
    let by_power = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(4), 3);
    let by_tree = PathTracer::new(&scene, selected(LightChoosing::Bvh)).with_depths(Some(4), 3);
    let tracers: [(&str, &dyn PixelEstimator); 2] = [
        ("by power", &by_power.with_emitter_samples(5)),
        (
            "by a tree",
            &by_tree.with_emitter_samples(4).with_visible_emission(),
        ),
    ];
    for (seed, (name, tracer)) in (20..).zip(tracers) {
        let mut found = Rendered::new(&tracer, size, 256, seed);
        MIXED_MASK.apply(&mut found);
        compare(&found, &MIXED_PATHS, tile_size(LightChoosing::Bvh, size))
            .unwrap_or_else(|error| panic!("{name}: {error:?}"));
    }
}

/// Paths of up to four edges, with every selection, against the path tracer that chooses by power;
/// ten per cent too much light is noticed.
#[test]
fn every_selection_gives_the_same_paths() {
    let description = mixed_lights();
    let scene = Scene::new(&description).unwrap();
    let size = [32, 32];
    let (mask, expected) = (&*MIXED_MASK, &*MIXED_PATHS);
    for (seed, choosing) in (2..).zip(LightChoosing::ALL) {
        let faults: &[bool] = if choosing == LightChoosing::Bvh {
            &[true]
        } else {
            &[]
        };
        check_faults(faults, |fault| {
            let selection = LightSelection::new(&scene, choosing).unwrap();
            let estimator = PathTracer::new(&scene, selection).with_depths(Some(4), 3);
            let mut found = Rendered::new(&estimator, size, 256, seed);
            if fault.is_some() {
                found.mean.iter_mut().for_each(|value| *value *= 1.1);
            }
            mask.apply(&mut found);
            compare(&found, expected, tile_size(choosing, size))
        })
        .unwrap_or_else(|error| panic!("{}: {error:?}", choosing.name()));
    }
}

/// In company and alone, and for any number of company: bit for bit.
#[test]
fn a_sample_does_not_depend_on_its_batch() {
    let scene = Scene::new(&mixed_lights()).unwrap();
    let ids: Vec<SampleId> = (0..300)
        .map(|i| SampleId {
            x: i % 32,
            y: i / 32 * 3,
            index: i,
        })
        .collect();
    for (choosing, strata, each) in [
        (LightChoosing::Uniform, 1, 1),
        (LightChoosing::Power, 1, 40),
        (LightChoosing::Tree, 2, 3),
        (LightChoosing::OpenBvh, 8, 1),
        (LightChoosing::Bvh, 3, 20),
    ] {
        let estimator = selected(&scene, choosing, each, strata);
        let alone: Vec<Rgb> = ids
            .iter()
            .map(|id| estimator.sample(id.x, id.y, id.index, 5))
            .collect();
        assert!(alone.iter().any(|&value| value != Rgb::ZERO));
        for size in [1, 7, MAX_BATCH, 300] {
            let mut together = vec![Rgb::NAN; ids.len()];
            for (ids, values) in ids.chunks(size).zip(together.chunks_mut(size)) {
                estimator.sample_many(ids, 5, values);
            }
            assert_eq!(alone, together, "{}, batches of {size}", choosing.name());
        }
    }
}

/// Scenes without finite lights, and without any.
#[test]
fn nothing_to_choose_from() {
    let mut description = builtin::furnace();
    let scene = Scene::new(&description).unwrap();
    let estimator = selected(&scene, LightChoosing::Tree, 4, 1);
    assert_eq!(estimator.sample(0, 0, 0, 1), Rgb::ONE);
    description.emitters.clear();
    description.materials = vec![Material::Diffuse {
        reflectance: Rgb::splat(0.5).into(),
    }];
    let scene = Scene::new(&description).unwrap();
    for choosing in LightChoosing::ALL {
        assert_eq!(selected(&scene, choosing, 4, 1).sample(32, 32, 0, 1), Rgb::ZERO);
    }
}

/// Where a sampled place on an emitter is met again, its density is that of the sample.
#[test]
fn densities_of_samples_and_of_hits_agree() {
    let scene = Scene::new(&mixed_lights()).unwrap();
    let selection = LightSelection::new(&scene, LightChoosing::OpenBvh).unwrap();
    let mut compared = 0;
    for i in 0..3000u32 {
        let mut rng = lightshed_sampling::CounterRng::new(4, i, 0);
        let ray = scene.camera().ray(Vec2::from(rng.next_2d()) * 32.0, [0.5; 2]);
        let Some(point) = scene.intersect(&ray) else {
            continue;
        };
        let bsdf = scene.bsdf(&point);
        let wo = point.shading.to_local(-ray.direction);
        let at = lightshed_integrator::shading_point(&point, &bsdf, wo);
        let Some(sample) = selection.sample(point.position, &at, rng.next_u64(), rng.next_2d()) else {
            continue;
        };
        let Some(met) = scene.intersect(&point.spawn(sample.direction)) else {
            continue;
        };
        if sample.is_delta || met.emitter != sample.emitter {
            continue;
        }
        let again = selection.pdf(point.position, &at, &met).value();
        let ratio = again / sample.pdf.value();
        assert!(
            (ratio - 1.0).abs() < 0.02,
            "{again} is not {}",
            sample.pdf.value()
        );
        compared += 1;
    }
    assert!(compared > 300, "{compared}");
}

/// The scenes with the most lights there are, at a size at which a few samples say much: every
/// selection against the best.
#[test]
fn published_scenes_look_the_same_by_every_selection() {
    let Some(scenes) = data_folder("LIGHTSHED_SCENES") else {
        return;
    };
    for name in ["many_lights_1000", "oacmpctf3", "oacmpdm9", "classroom"] {
        let mut description = load(scenes.join(name).join("scene.xml"), &[])
            .unwrap_or_else(|error| panic!("{}", error.chain()))
            .description;
        let size = [48, 27];
        [description.settings.width, description.settings.height] = size;
        let scene = Scene::new(&description).unwrap();
        let mask = Mask::new(&scene, size);
        let mut expected = Rendered::new(&selected(&scene, LightChoosing::OpenBvh, 8, 1), size, 64, 1);
        mask.apply(&mut expected);
        for (seed, choosing) in (2..).zip(LightChoosing::ALL) {
            // A few of twenty thousand emitters light most of this room: chosen uniformly they are
            // rarely met.
            let samples = match (name, choosing) {
                ("classroom", LightChoosing::Uniform) => 1024,
                _ => 64,
            };
            let mut found = Rendered::new(&selected(&scene, choosing, 8, 1), size, samples, seed);
            mask.apply(&mut found);
            compare(&found, &expected, tile_size(choosing, size))
                .unwrap_or_else(|e| panic!("{name}, {}: {e}", choosing.name()));
        }
    }
}
