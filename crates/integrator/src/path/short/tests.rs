//! Short paths apart against paths that find all light themselves.

use super::pilot::{Chosen, FOLLOWED, FOLLOWED_PIXELS, PathCosts, SETS, Seen, paths_of_set};
use super::{LongPaths, PixelTable, SHORT, Several, ShortLook, ShortPaths};
use crate::path::reuse::PathReuse;
use crate::path::tests::{glossy, mixed};
use crate::{LightChoosing, LightSelection, PathTracer};
use lightshed_film::{FrameMethod, PixelEstimator, SampleId};
use lightshed_lanes::LaneChoice;
use lightshed_sampling::{CounterRng, PointSet};
use lightshed_scene::{Rgb, Scene, SceneDescription, builtin};
use lightshed_testkit::{MeanTest, check_faults};
use std::sync::atomic::AtomicBool;

const WIDTH: u32 = 18;
const HEIGHT: u32 = 13;
const PIXELS: usize = (WIDTH * HEIGHT) as usize;

/// Two thirds of the pixels have short paths of their own, one to five a sample.
fn some() -> Option<ShortPaths> {
    let several = |pixel: u32| Several {
        samples: (pixel % 5 + 1) as u16,
        has_all: pixel % 7 > 3,
    };
    let samples = |pixel: u32| (!pixel.is_multiple_of(3)).then_some((pixel, several(pixel)));
    let pixels = PixelTable::new([WIDTH, HEIGHT], (0..PIXELS as u32).filter_map(samples));
    Some(ShortPaths { pixels })
}

fn scene(mut description: SceneDescription, longest: u32) -> Scene {
    let settings = &mut description.settings;
    (settings.width, settings.height) = (WIDTH, HEIGHT);
    (settings.max_depth, settings.roulette_depth) = (Some(longest), 3);
    Scene::new(&description).unwrap()
}

fn scenes() -> [(&'static str, SceneDescription); 4] {
    [
        ("mixed", mixed()),
        ("glossy", glossy()),
        ("doorway", builtin::by_name("doorway").unwrap()),
        ("many-lights", builtin::many_lights()),
    ]
}

/// One sample of each pixel.
fn ids(index: u32) -> Vec<SampleId> {
    let id = |pixel: u32| SampleId {
        x: pixel % WIDTH,
        y: pixel / WIDTH,
        index,
    };
    (0..PIXELS as u32).map(id).collect()
}

fn frame(reuse: &mut PathReuse<'_, impl crate::EmitterSampler + Send>, seed: u64) -> Vec<Rgb> {
    let mut image = vec![Rgb::ZERO; PIXELS];
    reuse.render_frame(1, seed, &mut image, &AtomicBool::new(false));
    image
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    /// Paths find the light of short paths as well.
    Twice,
    /// Nobody finds it.
    Nobody,
    /// Short paths are not averaged.
    NotAveraged,
}

/// Means of paths, with one or two emitter samples and visible emission by rays, and of paths that
/// pixels share: z-tests at 1e-6 of four stripes of the image, over 60 seeds, 48 in all; the faults
/// are seen in the first scene.
#[test]
fn means_are_those_of_paths() {
    for (name, description) in scenes() {
        for longest in [2, 5] {
            let scene = scene(description.clone(), longest);
            for is_shared in [false, true] {
                if is_shared && longest == 2 {
                    continue;
                }
                let run = |fault: Option<Fault>| {
                    let stripes = means(&scene, is_shared, fault);
                    let tests = stripes.iter().map(|[plain, apart]| plain.test_equal(apart, 1e-6));
                    tests.collect::<Result<Vec<_>, _>>()
                };
                let faults = [Fault::Twice, Fault::Nobody, Fault::NotAveraged];
                // Elsewhere longer paths hold most of the light, or of its noise.
                let faults = if name == "mixed" { &faults[..] } else { &[][..] };
                if let Err(error) = check_faults(faults, run) {
                    panic!("{name} of {longest} edges, shared: {is_shared}: {error}");
                }
            }
        }
    }
}

/// Of four stripes, the light of images without and with short paths apart.
fn means(scene: &Scene, is_shared: bool, fault: Option<Fault>) -> Vec<[MeanTest; 2]> {
    let mut stripes = vec![[MeanTest::default(), MeanTest::default()]; 4];
    for seed in 0..60 {
        let images = [None, some()].map(|short| {
            let is_apart = short.is_some();
            let mut image = vec![Rgb::ZERO; PIXELS];
            let mut light = vec![Rgb::ZERO; PIXELS];
            let sampler = scene.emitters_by_power();
            let tracer = PathTracer::new(scene, sampler).with_emitter_samples(1 + seed as u32 % 2);
            let mut tracer = tracer.with_visible_emission();
            (tracer.points, tracer.short) = (PointSet::Sobol, short);
            let seed = 2 * seed + u64::from(is_apart);
            let words = tracer.words(seed);
            for index in 0..2 {
                tracer.add_short(&ids(index), words, &mut light);
            }
            if is_shared {
                let reuse = PathReuse::new(scene, sampler).with_points(PointSet::Sobol);
                let mut reuse = reuse.with_visible_emission().with_short(tracer.short.take());
                image = frame(&mut reuse, seed);
                light.iter_mut().for_each(|light| *light /= 2.0);
            } else {
                let mut values = vec![Rgb::ZERO; PIXELS];
                for index in 0..2 {
                    tracer.sample_many(&ids(index), seed, &mut values);
                    image
                        .iter_mut()
                        .zip(&values)
                        .for_each(|(sum, value)| *sum += *value);
                }
            }
            let more = match fault {
                Some(Fault::Twice) => 1.0,
                Some(Fault::Nobody) => -1.0,
                Some(Fault::NotAveraged) => 0.5,
                None => 0.0,
            };
            image
                .iter_mut()
                .zip(&light)
                .for_each(|(sum, light)| *sum += *light * more);
            image
        });
        for (image, which) in images.iter().zip(0..) {
            for (stripe, pixels) in stripes.iter_mut().zip(image.chunks(PIXELS.div_ceil(4))) {
                let sum: Rgb = pixels.iter().sum();
                stripe[which].push(f64::from(sum.element_sum()));
            }
        }
    }
    stripes
}

/// Samples alone and in batches of any size, and frames, with all kinds of lanes: the same bits.
#[test]
fn lanes_give_the_values_of_single_paths() {
    for (name, description) in scenes() {
        for longest in [1, 2, 3, 6] {
            let scene = scene(description.clone(), longest);
            let selection = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
            let mut expected = None;
            for lanes in LaneChoice::all() {
                // Up to eleven, more than are chosen together.
                let tracer = PathTracer::new(&scene, &selection).with_emitter_samples(2 * longest - 1);
                let mut tracer = tracer.with_points(PointSet::Sobol);
                (tracer.transport.lanes, tracer.short) = (lanes, some());
                let mut values = vec![Rgb::ZERO; PIXELS];
                tracer.sample_many(&ids(3), 7, &mut values);
                for (id, value) in ids(3).iter().zip(&values).step_by(5) {
                    assert_eq!(tracer.sample(id.x, id.y, id.index, 7), *value, "{name}, {id:?}");
                }
                let mut some_values = [Rgb::ZERO; 23];
                tracer.sample_many(&ids(3)[40..63], 7, &mut some_values);
                assert_eq!(values[40..63], some_values, "{name}");
                let reuse = PathReuse::new(&scene, &selection).with_points(PointSet::Sobol);
                let mut reuse = reuse.with_lanes(lanes).with_short(some());
                let all = (values, frame(&mut reuse, 7));
                let expected = expected.get_or_insert_with(|| all.clone());
                assert!(*expected == all, "{name} of {longest} edges, {lanes:?}");
            }
        }
    }
}

/// Lit candles are small beside what is dark, so that samples go to some pixels; under a sky that
/// is the same everywhere none do. A pilot is a part of the image's work.
#[test]
fn pilots_find_what_varies() {
    let mut description = builtin::by_name("candles").unwrap();
    (description.settings.width, description.settings.height) = (48, 32);
    let scene = Scene::new(&description).unwrap();
    let selection = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
    let found = |samples: u32| {
        let tracer = PathTracer::new(&scene, &selection).with_visible_emission();
        let (transport, visible) = (&tracer.transport, tracer.visible.as_deref());
        ShortPaths::new(transport, visible, LongPaths::SHARED, samples / 2)
    };
    let [many, again] = [1024, 1024].map(|samples| found(samples).expect("nothing varies"));
    let taken = |short: &ShortPaths| {
        (0..48 * 32)
            .map(|pixel| short.pixels.get(pixel).copied())
            .collect()
    };
    let (many, again): (Vec<_>, Vec<_>) = (taken(&many), taken(&again));
    assert_eq!(many, again);
    let apart = many.iter().flatten().count();
    assert!((100..48 * 32).contains(&apart), "{apart}");
    assert!(found(30).is_none());
    let furnace = Scene::new(&builtin::by_name("furnace").unwrap()).unwrap();
    let tracer = PathTracer::new(&furnace, furnace.emitters_by_power());
    assert!(tracer.with_short_paths(1024).short.is_none());
}

/// A pilot is 6 % of the image's work at most, one of the fewest paths 9 %, or there is none; where
/// short paths cost little, images of few samples have one.
/// Planted faults: the share of those followed to their ends left out; costs the wrong way round.
#[test]
fn pilots_are_a_small_share() {
    for short in [0.2, 0.3, 0.9, 1.0] {
        for samples in [1, 32, 64, 100, 400, 1 << 20] {
            for longest in [1, 2, 3, 8] {
                let whole = if longest > 2 { 1.0 } else { short };
                let costs = PathCosts { short, whole };
                let Some(of_set) = paths_of_set(samples, longest, costs) else {
                    continue;
                };
                let followed = if longest > 2 {
                    FOLLOWED as f32 / FOLLOWED_PIXELS as f32
                } else {
                    0.0
                };
                let paths = followed + short / whole * (SETS * of_set) as f32;
                let most = if of_set == 2 { 0.0901 } else { 0.0601 };
                assert!(paths <= most * samples as f32, "{costs:?} {samples} {longest}");
                assert!(of_set.is_power_of_two() && of_set <= 8);
            }
        }
    }
    let costs = |short: f32| PathCosts { short, whole: 1.0 };
    let of_set = |samples: u32, short: f32| paths_of_set(samples, 8, costs(short));
    assert_eq!([of_set(33, 0.3), of_set(34, 0.3)], [None, Some(2)]);
    assert_eq!([of_set(90, 0.3), of_set(91, 0.3)], [Some(2), Some(4)]);
    assert_eq!([of_set(80, 0.9), of_set(300, 0.9)], [None, Some(4)]);
    assert_eq!(of_set(1 << 30, 0.0), Some(8));
    assert_eq!(paths_of_set(1024, 0, costs(0.3)), None);
}

/// Short paths are a part of whole ones in a room, and nearly all of them under a sky. All blocks
/// tell about what a sixteenth of them does.
/// Planted faults: paths that are followed counted for each pixel; rays of short paths not counted.
#[test]
fn costs_are_those_of_the_scene() {
    let of = |name: &str, longest: u32| {
        let mut description = builtin::by_name(name).unwrap();
        let settings = &mut description.settings;
        (settings.width, settings.height, settings.max_depth) = (64, 48, Some(longest));
        let scene = Scene::new(&description).unwrap();
        let tracer = PathTracer::new(&scene, scene.emitters_by_power());
        tracer.short_look(2).costs
    };
    let ratio = |costs: PathCosts| costs.short / costs.whole;
    let [room, sky] = [of("cornell", 8), of("furnace", 8)].map(ratio);
    assert!(
        (0.15..0.4).contains(&room) && (0.6..1.01).contains(&sky),
        "{room} {sky}"
    );
    assert_eq!(ratio(of("cornell", 2)), 1.0);
    // A camera ray, one to an emitter and half of one that meets emitters, of paths that all hit.
    let costs = of("cornell", 2);
    assert!((1.2..2.01).contains(&costs.short), "{costs:?}");
}

/// Where paths with four samples of the emitters vary as those with one do, short paths have one;
/// where they vary by a quarter of that, they have four, which cost less than four paths.
/// Planted fault: costs left out.
#[test]
fn short_paths_are_of_the_cheaper_kind() {
    let of = |variance: f32| Seen {
        short: [variance; 2],
        cost: 2.0,
        ..Seen::default()
    };
    let all = [16.0, 8.0, 4.0].map(|all| Some(of(all))).map(|all| vec![all; 9]);
    let chosen = all.map(|of_paths| {
        let mut look = ShortLook {
            seen: vec![of(16.0); 9],
            size: [3, 3],
            of_set: 2,
            costs: PathCosts::ONE,
            longest: SHORT,
        };
        look.choose_kinds(4, &of_paths);
        look.seen[4]
    });
    let [same, half, quarter] = chosen;
    for (seen, has_all) in [(same, false), (half, false), (quarter, true)] {
        assert_eq!(seen.has_all, Chosen::by_all(has_all));
    }
    assert_eq!([same.own[0], half.own[0], quarter.own[0]], [16.0, 8.0, 4.0]);
    assert_eq!([same.short[0], quarter.short[0]], [16.0; 2]);
}

/// Where paths with one emitter sample and with four are as good as each other, the lesser variance
/// of few samples is less than either will be. What is promised is left all the same.
/// Planted faults: the choice of both halves judged by each; each half judged by itself.
#[test]
fn the_lesser_of_two_variances_promises_nothing() {
    const SIZE: [usize; 2] = [64, 48];
    let cost = PathCosts::ONE.beside(4).whole;
    let mut rng = CounterRng::new(3, 0, 0);
    // As two values of a normal distribution show a variance.
    let mut shown = |mean: f32| {
        let [u, v] = rng.next_2d();
        let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f32::consts::TAU * v).cos();
        mean * normal * normal
    };
    let mut of = |mean: f32| {
        let short = [shown(mean), shown(mean)];
        let (own, brightness, cost) = (short, 1.0, 1.0);
        Seen {
            short,
            own,
            brightness,
            cost,
            ..Seen::default()
        }
    };
    let mean = |pixel: usize| if pixel % 8 == 3 { 300.0 } else { 1.0 };
    let pixels = 0..SIZE[0] * SIZE[1];
    let mut seen_of = |scale: f32| {
        pixels
            .clone()
            .map(|pixel| of(scale * mean(pixel)))
            .collect::<Vec<_>>()
    };
    let of_paths: Vec<_> = seen_of(1.0 / cost).into_iter().map(Some).collect();
    let mut look = ShortLook {
        seen: seen_of(1.0),
        size: SIZE,
        of_set: 2,
        costs: PathCosts::ONE,
        longest: SHORT,
    };
    look.choose_kinds(4, &of_paths);
    let allotment = look.allot(LongPaths::ALONE, 4).unwrap();
    let left = pixels.map(|pixel| {
        let all = mean(pixel) / cost;
        match (allotment.samples[pixel], look.seen[pixel].has_all.by_both) {
            (0, _) => all,
            (samples, true) => all / f32::from(samples),
            (samples, false) => mean(pixel) / f32::from(samples),
        }
    });
    let ratio = allotment.left.iter().sum::<f32>() / left.sum::<f32>();
    assert!(ratio > 0.94, "{ratio}");
}

/// A pilot sees lamps in view by the rays that images see them by.
/// Planted faults: sums over a set in place of means; emission of every pixel.
#[test]
fn pilots_see_emission_in_view() {
    let mut description = builtin::by_name("many-lights").unwrap();
    let settings = &mut description.settings;
    (settings.width, settings.height, settings.max_depth) = (48, 32, Some(2));
    let scene = Scene::new(&description).unwrap();
    let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_visible_emission();
    let visible = tracer.visible.as_deref().unwrap();
    let seen = tracer.short_look(4).seen;
    let (mut expected, mut found) = (0.0, 0.0);
    for (pixel, seen) in seen.iter().enumerate() {
        if !visible.takes(pixel) {
            assert_eq!([seen.emission, seen.emission_brightness], [0.0; 2], "{pixel}");
            continue;
        }
        let [x, y] = [pixel % 48, pixel / 48].map(|at| at as u32);
        let ids: [_; 32] = std::array::from_fn(|index| SampleId {
            x,
            y,
            index: index as u32,
        });
        let mut values = [Rgb::ZERO; 32];
        visible.add(&scene, scene.camera(), (PointSet::Sobol, 5), &ids, &mut values);
        expected += values.iter().sum::<Rgb>().element_sum() / 32.0;
        found += seen.emission_brightness;
    }
    assert!(
        expected > 0.0 && (found / expected - 1.0).abs() < 0.1,
        "{found} {expected}"
    );
    assert!(seen.iter().any(|seen| seen.emission > 0.0));
}

/// Where light varies most, in all and for its brightness.
/// Planted faults: only one of both; the least first.
#[test]
fn the_most_varying_pixels_are_at_edges() {
    let of = |pixel: usize| {
        let (variance, brightness) = match pixel % 16 {
            3 => (100.0, 100.0),
            10 => (1.0, 0.1),
            _ => (0.01, 1.0),
        };
        Seen {
            short: [variance; 2],
            brightness,
            ..Seen::default()
        }
    };
    let look = ShortLook {
        seen: (0..256).map(of).collect(),
        size: [16, 16],
        of_set: 2,
        costs: PathCosts::ONE,
        longest: SHORT,
    };
    let taken = look.most_varying();
    assert_eq!(taken.len(), 64);
    let near = |column: usize| {
        taken
            .iter()
            .filter(|pixel| (*pixel % 16).abs_diff(column) <= 1)
            .count()
    };
    assert_eq!([near(3), near(10)], [32; 2]);
}
