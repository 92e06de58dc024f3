//! Paths guided by fields that earlier frames trained: unbiased, the same for any threads, and
//! better where there is something to find.

use crate::guides::{large_flames, mean, sized};
use lightshed_film::{Budget, FrameMethod, RenderOptions, render_frames};
use lightshed_guiding::{VmfLobe, VmfMixture};
use lightshed_integrator::{
    DirectionGuide, FieldDirections, GuideKind, GuidedPaths, GuidedPathsOptions, GuidedVertex, LightChoosing,
    LightSelection, ObservedPath, PathObserver, PathTracer, SceneField, VolumePathTracer, VolumeTracking,
};
use lightshed_sampling::{CosineHemisphere, Density, DirectionDistribution, Frame, SolidAngle};
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::FlightGuiding;
use lightshed_scene::{
    DensityDescription, MediumDescription, PhaseDescription, Rgb, Scene, SceneDescription, builtin, luminance,
};
use lightshed_testkit::{MeanTest, check_faults};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Frames of eight samples that train at once.
fn options(kind: GuideKind) -> GuidedPathsOptions {
    let mut options = GuidedPathsOptions::new(kind);
    (options.training, options.may_drop) = (16, false);
    (options.field.split_above, options.field.collapse_below) = (200, 100);
    options
}

fn guided(
    scene: &Scene,
    options: GuidedPathsOptions,
) -> GuidedPaths<'_, lightshed_scene::EmittersByPower<'_>> {
    GuidedPaths::new(scene, scene.emitters_by_power(), options).unwrap()
}

/// The mean of all pixels over some frames, which is that of the combination.
fn image_mean(method: &mut impl FrameMethod, frames: u32, seed: u64) -> f64 {
    let [width, height] = method.size();
    let mut image = vec![Rgb::ZERO; (width * height) as usize];
    let mut sum = 0.0;
    for frame in 0..frames {
        method
            .render_frame(frame, seed, &mut image, &AtomicBool::new(false))
            .unwrap();
        sum += image
            .iter()
            .map(|&value| f64::from(luminance(value)))
            .sum::<f64>();
    }
    sum / f64::from(frames)
}

/// What can be wrong with what a guide says.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The density is that of another region.
    OtherRegion,
    /// The density is that on the square.
    NoFactor,
}

/// A field that was trained, with a fault.
struct Faulty<'f>(&'f SceneField, Option<Fault>);

struct FaultyDirections<'f> {
    own: FieldDirections<'f>,
    other: Option<FieldDirections<'f>>,
    fault: Option<Fault>,
}

impl DirectionGuide for Faulty<'_> {
    type Distribution<'g>
        = FaultyDirections<'g>
    where
        Self: 'g;

    fn uses_reflection(&self) -> bool {
        self.0.uses_reflection()
    }

    fn guide(&self, vertex: &GuidedVertex) -> Option<(FaultyDirections<'_>, f32)> {
        let (own, share) = self.0.guide(vertex)?;
        let elsewhere = GuidedVertex {
            // A quarter of a turn away.
            position: Vec3::new(vertex.position.z, vertex.position.y, -vertex.position.x),
            ..*vertex
        };
        let other = self.0.guide(&elsewhere).map(|(other, _)| other);
        let fault = self.1;
        Some((FaultyDirections { own, other, fault }, share))
    }
}

impl DirectionDistribution for FaultyDirections<'_> {
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let (direction, _) = self.own.sample(u)?;
        Some((direction, self.pdf(direction)))
    }

    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        let pdf = self.own.pdf(direction);
        match (self.fault, &self.other) {
            (Some(Fault::OtherRegion), Some(other)) => other.pdf(direction),
            (Some(Fault::NoFactor), _) => {
                let norm = direction.abs().element_sum();
                Density::new(pdf.value() * 4.0 * norm * norm * norm / (4.0 * std::f32::consts::PI))
            }
            _ => pdf,
        }
    }
}

/// A trained field gives the image's mean, on surfaces of all lobes and in the lighthouse: z-tests
/// at 1e-5, one for each kind of guide and scene. A density that belongs to another region and one
/// without the octahedral factor are found.
#[test]
fn trained_fields_do_not_change_the_mean() {
    for (name, description, samples) in [
        ("cornell-glossy", builtin::cornell_glossy(), 300),
        ("lighthouse", builtin::lighthouse(), 1500),
    ] {
        let scene = sized(description);
        let tracer = || PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(4), 3);
        let plain = mean(&tracer(), samples, 1);
        let kinds = GuideKind::ALL.map(|kind| (kind, false));
        // Quadtrees alone, and times what surfaces reflect.
        for (kind, product) in kinds.into_iter().chain([(GuideKind::Quadtree, true)]) {
            let mut options = GuidedPathsOptions {
                samples: 32,
                ..options(kind)
            };
            options.quadtree.product = product;
            let mut training = guided(&scene, options);
            image_mean(&mut training, 16, 7);
            let field = training.field();
            assert!(
                field.learnt_regions() > 1 && field.mean_share() > 0.1,
                "{}",
                field.mean_share()
            );
            let faults: &[Fault] = match (kind, name) {
                (GuideKind::Quadtree, "lighthouse") => &[Fault::OtherRegion, Fault::NoFactor],
                _ => &[],
            };
            check_faults(faults, |fault| {
                let guided = mean(&tracer().with_guide(Faulty(field, fault)), samples, 2);
                println!(
                    "{name}, {kind:?}, product {product}, {fault:?}: {} against {}",
                    guided.mean(),
                    plain.mean()
                );
                guided.test_equal(&plain, 1e-5).map_err(|error| error.to_string())
            })
            .unwrap();
        }
    }
}

/// What can be wrong with a chain's lobe.
#[derive(Clone, Copy, Debug)]
enum ChainFault {
    /// The density has the lobe that sampled twice.
    OwnTwice,
    /// The part of the directions that any light is found with is left out of the density.
    NoDefence,
}

/// Lobes of a field, and directions of a cosine as a part of the guide.
struct Chains<'f> {
    field: &'f SceneField,
    fault: Option<ChainFault>,
}

struct ChainDirections<'f> {
    own: FieldDirections<'f>,
    normal: Vec3,
    fault: Option<ChainFault>,
}

/// Part of the lobes in [`ChainDirections`].
const LOBES: f32 = 0.75;

impl DirectionGuide for Chains<'_> {
    type Distribution<'g>
        = ChainDirections<'g>
    where
        Self: 'g;

    fn guide(&self, vertex: &GuidedVertex) -> Option<(ChainDirections<'_>, f32)> {
        let (own, share) = self.field.guide(vertex)?;
        let (normal, fault) = (vertex.normal?, self.fault);
        Some((ChainDirections { own, normal, fault }, share))
    }
}

impl DirectionDistribution for ChainDirections<'_> {
    fn sample(&self, [u, v]: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let direction = if u < LOBES {
            self.own.sample([u / LOBES, v])?.0
        } else {
            let around = CosineHemisphere::sample([(u - LOBES) / (1.0 - LOBES), v]);
            Frame::from_normal(self.normal).to_world(around)
        };
        Some((direction, self.pdf(direction)))
    }

    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        let mut pdf = LOBES * self.own.pdf(direction).value();
        if let (Some(ChainFault::OwnTwice), FieldDirections::Lobes(mixture)) = (self.fault, &self.own) {
            let density = |lobe: VmfLobe| lobe.weight * VmfMixture::new(&[lobe]).pdf(direction).value();
            pdf += LOBES * mixture.lobes().map(density).fold(0.0, f32::max);
        }
        if !matches!(self.fault, Some(ChainFault::NoDefence)) {
            let cosine = direction.dot(self.normal).max(0.0);
            pdf += (1.0 - LOBES) * cosine * std::f32::consts::FRAC_1_PI;
        }
        Density::new(pdf)
    }
}

/// Chains in cells of a hash grid give the image's mean, eight and one in a cell, also in the
/// smallest table: z-tests at 1e-5 by candles without a list of lights. A lobe that counts twice
/// and a density without its defensive part are found. The density of a state after its update is
/// found by a test of `lightshed-guiding`.
#[test]
fn chains_in_a_hash_grid_do_not_change_the_mean() {
    let scene = sized(large_flames());
    let by_list = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
    let unfound = LightSelection::new(&scene, LightChoosing::Unfound).unwrap();
    let plain = mean(&PathTracer::new(&scene, &by_list), 1500, 1);
    let faults = [ChainFault::OwnTwice, ChainFault::NoDefence];
    for (states, memory, faults) in [
        (8, 8 << 20, &faults[..]),
        (1, 8 << 20, &faults[..0]),
        (8, 4 << 10, &faults[..0]),
    ] {
        let mut options = options(GuideKind::MixtureGrid);
        (options.samples, options.states, options.memory) = (32, states, memory);
        options.every_frame = true;
        let mut method = GuidedPaths::new(&scene, &unfound, options).unwrap();
        image_mean(&mut method, 8, 7);
        let field = method.field();
        let SceneField::MixtureGrid(grid) = field else {
            panic!("another guide")
        };
        let occupancy = grid.partition().occupancy();
        println!("{states} states, share {}: {occupancy:?}", field.mean_share());
        assert!(field.learnt_regions() > 8 && field.mean_share() > 0.2);
        assert_eq!(occupancy.slots == 32, memory < 1 << 20);
        check_faults(faults, |fault| {
            let chains = Chains { field, fault };
            let guided = mean(&PathTracer::new(&scene, &unfound).with_guide(chains), 3000, 2);
            println!("  {fault:?}: {} against {}", guided.mean(), plain.mean());
            guided.test_equal(&plain, 1e-5).map_err(|error| error.to_string())
        })
        .unwrap();
    }
}

/// Without a list of lights, places find the flames of candles again: most of what is found comes
/// from directions to them. It does not if the field is not told where the last edge ended.
#[test]
fn places_learn_flames_that_no_list_leads_to() {
    let mut description = builtin::candles();
    (description.settings.width, description.settings.height) = (64, 64);
    let scene = Scene::new(&description).unwrap();
    let unfound = LightSelection::new(&scene, LightChoosing::Unfound).unwrap();
    let mut options = GuidedPathsOptions::new(GuideKind::Places);
    (options.samples, options.may_drop) = (32, false);
    let mut method = GuidedPaths::new(&scene, &unfound, options).unwrap();
    image_mean(&mut method, 16, 3);
    let (regions, share) = (method.field().learnt_regions(), method.field().mean_share());
    println!("{regions} regions, share {share}");
    assert!(regions > 2 && share > 0.5);
}

/// Frames that are guided by places, and explored by paths whose light does not count, have
/// the mean of path tracing by a list of lights: candles with flames of eight times the radius and
/// the same power, over an ensemble of seeds. A z-test at 1e-5.
#[test]
fn frames_that_explore_are_unbiased() {
    let scene = sized(large_flames());
    let by_list = LightSelection::new(&scene, LightChoosing::Bvh).unwrap();
    let unfound = LightSelection::new(&scene, LightChoosing::Unfound).unwrap();
    let plain = mean(&PathTracer::new(&scene, &by_list), 3000, 1);
    let ensemble = |exploring| {
        let image = |seed: u64| {
            let mut options = options(GuideKind::Places);
            (options.samples, options.exploring) = (16, exploring);
            let mut method = GuidedPaths::new(&scene, &unfound, options).unwrap();
            image_mean(&mut method, 8, 100 + seed)
        };
        (0..60).map(image).collect::<Vec<f64>>()
    };
    // What exploring paths find, as they would be counted.
    let explored = mean(&PathTracer::new(&scene, &unfound), 3000, 3).mean();
    let ensembles = [0, 16].map(|exploring| (exploring, ensemble(exploring)));
    check_faults(
        &[Miscounted::OnTop, Miscounted::HalfShare, Miscounted::Twice],
        |fault| {
            for (exploring, ensemble) in &ensembles {
                let mut counted = MeanTest::new();
                for &image in ensemble {
                    counted.push(match fault {
                        None => image,
                        Some(Miscounted::OnTop) => image + explored,
                        Some(Miscounted::HalfShare) => 0.5 * image + 0.25 * explored,
                        Some(Miscounted::Twice) => (image + 2.0 * explored) / 2.0,
                    });
                }
                println!(
                    "exploring {exploring}, {fault:?}: {} against {}",
                    counted.mean(),
                    plain.mean()
                );
                counted
                    .test_equal(&plain, 1e-5)
                    .map_err(|error| error.to_string())?;
            }
            Ok::<(), String>(())
        },
    )
    .unwrap();
}

/// What can be wrong with paths that explore: their light counts …
#[derive(Clone, Copy, Debug)]
enum Miscounted {
    /// … besides that of the frame.
    OnTop,
    /// … as half of the samples, but with a quarter of the weight.
    HalfShare,
    /// … as half of the samples, and each twice.
    Twice,
}

/// Combinations of frames that were trained on each other have the mean of path tracing: over an
/// ensemble of seeds, since frames depend on those before. z-tests at 1e-5.
#[test]
fn combined_frames_are_unbiased() {
    for (name, description) in [
        ("doorway", builtin::doorway()),
        ("lighthouse", builtin::lighthouse()),
    ] {
        let scene = sized(description);
        let tracer = PathTracer::new(&scene, scene.emitters_by_power());
        let plain = mean(&tracer, 1500, 1);
        for kind in GuideKind::ALL {
            let mut ensemble = MeanTest::new();
            for seed in 0..40 {
                ensemble.push(image_mean(&mut guided(&scene, options(kind)), 6, 100 + seed));
            }
            println!("{name}, {kind:?}: {} against {}", ensemble.mean(), plain.mean());
            ensemble.test_equal(&plain, 1e-5).unwrap();
        }
    }
}

/// Frames have the same bits for one, two and seven threads.
#[test]
fn frames_do_not_depend_on_threads() {
    let scene = sized(builtin::cornell_glossy());
    let kinds = GuideKind::ALL.map(|kind| (kind, false));
    for (kind, product) in kinds.into_iter().chain([(GuideKind::Quadtree, true)]) {
        let rendered = |threads| {
            let mut render = RenderOptions::new(12, 12, Budget::Samples(6));
            (render.threads, render.seed) = (threads, 5);
            let mut options = options(kind);
            options.quadtree.product = product;
            let mut method = guided(&scene, options);
            let outcome = render_frames(&mut method, &render, &|_| (), &AtomicBool::new(false)).unwrap();
            outcome.film.mean_image()
        };
        let one = rendered(1);
        assert!(one == rendered(2) && one == rendered(7), "{kind:?}");
    }
}

/// Frames count their rays: a camera ray for each sample, and as many others as the observer of a
/// plain path tracer sees where a frame is plain.
#[test]
fn frames_count_their_rays() {
    let scene = sized(builtin::cornell());
    let pixels = scene.settings().width * scene.settings().height;
    let options = GuidedPathsOptions {
        visible_emission: false,
        ..options(GuideKind::Quadtree)
    };
    let mut method = guided(&scene, options);
    let mut image = vec![Rgb::ZERO; pixels as usize];
    for frame in 0..3 {
        let rays = method.render_frame(frame, 1, &mut image, &AtomicBool::new(false));
        let rays = rays.unwrap();
        assert_eq!(rays.camera, u64::from(4 * pixels));
        assert!(rays.path > rays.camera && rays.emitter > rays.camera, "{rays:?}");
    }
}

/// Separate rays for the visible lamp take noise from guided frames as from plain ones, and show
/// the same lamp: the sums of the images differ by less than four standard errors.
#[test]
fn visible_emission_has_its_own_rays() {
    let scene = sized(builtin::cornell());
    let pixels = (scene.settings().width * scene.settings().height) as usize;
    let [(rays, variance, sum), (more_rays, less_variance, same_sum)] =
        [false, true].map(|visible_emission| {
            let options = GuidedPathsOptions {
                visible_emission,
                ..options(GuideKind::Vmf)
            };
            let mut method = guided(&scene, options);
            let mut image = vec![Rgb::ZERO; pixels];
            let (mut camera, mut variance, mut sum) = (0, 0.0, 0.0_f32);
            for frame in 0..16 {
                let rays = method.render_frame(frame, 1, &mut image, &AtomicBool::new(false));
                camera += rays.unwrap().camera;
                variance += method.last_variance();
                sum += image.iter().map(|value| value.element_sum()).sum::<f32>() / 16.0;
            }
            (camera, variance / 16.0, sum)
        });
    println!("{variance} with {rays} camera rays, {less_variance} with {more_rays}; {sum}, {same_sum}");
    assert!(more_rays > rays && less_variance < 0.5 * variance);
    let error = ((variance + less_variance) / 16.0).sqrt() as f32;
    assert!((same_sum - sum).abs() < 4.0 * error, "{sum}, {same_sum}: {error}");
}

/// Roulette by what paths find shortens paths and leaves most of what the guide gains: at the same
/// depth of the other roulette, fewer rays, and in most of twelve chains less variance times rays;
/// their median has 0.64 of it. Chains that end most paths have up to 1.4 of it.
#[test]
fn roulette_by_worth_saves_rays() {
    let mut description = builtin::by_name("door-gap").unwrap();
    (description.settings.width, description.settings.height) = (32, 32);
    let scene = Scene::new(&description).unwrap();
    let mut image = vec![Rgb::ZERO; 32 * 32];
    let mut work = |worth_depth, seed| {
        let options = GuidedPathsOptions {
            worth_depth,
            ..options(GuideKind::Vmf)
        };
        let mut method = guided(&scene, options);
        let (mut rays, mut variance) = (0, 0.0);
        for frame in 0..64 {
            let counts = method.render_frame(frame, seed, &mut image, &AtomicBool::new(false));
            let counts = counts.unwrap();
            if frame >= 16 {
                rays += counts.path + counts.emitter;
                variance += method.last_variance();
            }
        }
        (rays as f64, variance)
    };
    let (mut all, mut fewer, mut products) = (0.0, 0.0, Vec::new());
    for seed in 1..13 {
        let [(rays, variance), (rays_by_worth, variance_by_worth)] =
            [u32::MAX, 2].map(|worth_depth| work(worth_depth, seed));
        println!("{rays} rays with variance {variance}, {rays_by_worth} with {variance_by_worth}");
        (all, fewer) = (all + rays, fewer + rays_by_worth);
        products.push(rays_by_worth * variance_by_worth / (rays * variance));
    }
    products.sort_by(f64::total_cmp);
    assert!(
        fewer < 0.75 * all && 0.5 * (products[5] + products[6]) < 0.75,
        "{fewer} of {all} rays, {products:?}"
    );
}

/// In the lighthouse guided paths have less than a quarter of the variance of plain ones; in a box
/// of even light the guide is dropped, and paths are plain.
#[test]
fn guides_gain_where_there_is_something_to_find() {
    let mut description = builtin::lighthouse();
    (description.settings.width, description.settings.height) = (32, 32);
    let scene = Scene::new(&description).unwrap();
    let mut options = GuidedPathsOptions::new(GuideKind::Quadtree);
    options.may_drop = false;
    let mut method = guided(&scene, options);
    image_mean(&mut method, 64, 1);
    assert!(!method.is_dropped());
    let guided_image = |estimator: &dyn lightshed_film::PixelEstimator| {
        let mut variance = 0.0;
        for (pixel, pair) in (0..32 * 32).flat_map(|pixel| (0..12).map(move |pair| (pixel, pair))) {
            let value = |index| luminance(estimator.sample(pixel % 32, pixel / 32, index, 77));
            variance += f64::from((value(2 * pair) - value(2 * pair + 1)).powi(2));
        }
        variance
    };
    let plain = guided_image(&PathTracer::new(&scene, scene.emitters_by_power()));
    let with = guided_image(&PathTracer::new(&scene, scene.emitters_by_power()).with_guide(method.field()));
    println!("variance {plain} without and {with} with a guide");
    assert!(with < 0.25 * plain, "{with} and {plain}");

    let scene = sized(builtin::furnace());
    options.may_drop = true;
    let mut method = guided(&scene, options);
    image_mean(&mut method, 9, 1);
    assert!(method.is_dropped());
}

#[test]
fn wrong_options_are_refused() {
    let scene = sized(builtin::cornell());
    for (samples, bits) in [(3, 64), (0, 64), (4, 65), (2000, 64)] {
        let mut options = GuidedPathsOptions::new(GuideKind::Quadtree);
        (options.samples, options.quadtree.bits) = (samples, bits);
        let refused = GuidedPaths::new(&scene, scene.emitters_by_power(), options).err();
        assert!(
            refused.is_some_and(|error| !error.to_string().is_empty()),
            "{samples}, {bits}"
        );
    }
    assert!("cdg".parse::<GuideKind>().is_err());
}

/// The Cornell box in thin fog: the lamp is seen through it.
fn fog_before_a_lamp() -> SceneDescription {
    let mut scene = builtin::cornell();
    scene.media.push(MediumDescription {
        name: "fog".to_owned(),
        density: DensityDescription::Homogeneous,
        extinction: Rgb::splat(0.15),
        albedo: Rgb::splat(0.7),
        albedo_grids: Vec::new(),
        phase: PhaseDescription::HenyeyGreenstein { g: 0.3 },
        emission: None,
    });
    (scene.camera_medium, scene.settings.max_depth) = (Some(0), Some(5));
    scene
}

/// Guided paths through a cloud, through smoke and through thin fog before a lamp have the mean of
/// plain ones, over an ensemble of seeds: with guided directions, with guided flights, and with
/// both. A guide of a path tracer that sees no media has another. z-tests at 1e-5.
#[test]
fn guides_of_media_are_unbiased() {
    for (name, description) in [
        ("cloud", builtin::cloud()),
        ("smoke", builtin::smoke_in_cornell()),
        ("fog", fog_before_a_lamp()),
    ] {
        let scene = sized(description);
        let plain = mean(&VolumePathTracer::new(&scene, scene.emitters_by_power()), 1000, 1);
        let flights = Some(FlightGuiding::default());
        for (kind, tracking, flights, share) in [
            (GuideKind::Vmf, VolumeTracking::Delta, None, 0.6),
            (GuideKind::Quadtree, VolumeTracking::Decomposition, None, 0.6),
            (GuideKind::Vmf, VolumeTracking::Delta, flights, 0.0),
            (GuideKind::Vmf, VolumeTracking::Delta, flights, 0.6),
        ] {
            let faults: &[()] = if name == "cloud" && share == 0.0 {
                &[()]
            } else {
                &[]
            };
            check_faults(faults, |fault| {
                let volume = if fault.is_some() { None } else { Some(tracking) };
                let mut options = GuidedPathsOptions {
                    volume,
                    flights,
                    samples: 8,
                    ..options(kind)
                };
                (options.field.max_share, options.field.min_share) = (share, 0.0);
                let mut ensemble = MeanTest::new();
                for seed in 0..20 {
                    ensemble.push(image_mean(&mut guided(&scene, options), 12, 100 + seed));
                }
                println!("{name}, {kind:?}, {tracking:?}, {flights:?}, {share}, {fault:?}:");
                println!("  {ensemble:?} against {}", plain.mean());
                ensemble
                    .test_equal(&plain, 1e-5)
                    .map(|report| println!("  {report:?}"))
                    .map_err(|error| error.to_string())
            })
            .unwrap();
        }
    }
}

/// Guided flights through media have the same bits for one and for several threads, and other bits
/// than flights without a guide.
#[test]
fn guided_flights_do_not_depend_on_threads() {
    let scene = sized(fog_before_a_lamp());
    let rendered = |threads, flights| {
        let mut render = RenderOptions::new(12, 12, Budget::Samples(6));
        (render.threads, render.seed) = (threads, 5);
        let options = GuidedPathsOptions {
            volume: Some(VolumeTracking::Delta),
            flights,
            ..options(GuideKind::Quadtree)
        };
        let mut method = guided(&scene, options);
        let outcome = render_frames(&mut method, &render, &|_| (), &AtomicBool::new(false)).unwrap();
        outcome.film.mean_image()
    };
    let flights = Some(FlightGuiding::default());
    let one = rendered(1, flights);
    assert!(one == rendered(2, flights) && one == rendered(7, flights));
    assert!(one != rendered(1, None));
}

/// Paths of the greatest length that end at an emitter tell guides how far it is, in media, too:
/// in a closed room no distance is infinite.
#[test]
fn paths_through_media_tell_where_their_last_edge_ended() {
    struct Lengths(AtomicUsize);

    impl PathObserver for Lengths {
        fn observe(&self, path: &ObservedPath<'_>) {
            for light in path.contributions {
                if !light.is_sampled_emitter && light.edges == 3 {
                    let place = light.place.expect("a place");
                    assert!(place.abs().max_element() < 1.0);
                    self.0.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
    }

    let scene = sized(fog_before_a_lamp());
    let lengths = Lengths(AtomicUsize::new(0));
    let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(3), 9);
    mean(
        &VolumePathTracer::of_tracer(tracer.with_observer(&lengths)),
        800,
        1,
    );
    assert!(lengths.0.into_inner() > 20);
}
