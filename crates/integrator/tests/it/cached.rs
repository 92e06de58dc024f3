//! Paths that end in a cache: what ends them keeps what it says, the image does not depend on
//! threads, and bounds hold.

use lightshed_caching::{CachedRadiance, Facets, Refinement, Termination};
use lightshed_film::{
    Budget, Film, FrameMethod, MAX_BATCH, PixelEstimator, RenderOptions, SampleId, render, render_frames,
};
use lightshed_integrator::{
    CachedPaths, CachedPathsError, CachedPathsOptions, EndingVertex, GuideKind, GuidedPathsOptions,
    PathEnding, PathTracer, VertexEnding,
};
use lightshed_sampling::{CounterRng, PointSet};
use lightshed_scene::{EmittersByPower, Rgb, Scene, SceneDescription, builtin, luminance};
use lightshed_testkit::check_faults;
use std::sync::atomic::AtomicBool;

fn sized(mut description: SceneDescription, side: u32) -> SceneDescription {
    (description.settings.width, description.settings.height) = (side, side);
    description
}

/// What can be wrong with an ending.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// What stands in counts in full.
    Twice,
    /// What stands in counts without the throughput.
    NoThroughput,
    /// The rest is lost.
    NothingStandsIn,
}

/// Ends paths in a white furnace anyhow: what scatters there has radiance 1.
struct Anyhow(Option<Fault>);

impl PathEnding for Anyhow {
    type Path = u32;

    fn at(&self, vertices: &mut u32, vertex: &EndingVertex) -> VertexEnding {
        *vertices += 1;
        assert_eq!(*vertices, vertex.depth, "vertices come in order");
        assert!((vertex.normal.length() - 1.0).abs() < 1e-5 && vertex.distance > 0.0);
        let pixel = vertex.id.y << 16 | vertex.id.x;
        let u = CounterRng::new(vertex.seed, pixel, vertex.id.index).next_f32();
        // A third ends, a third goes on, a third is blended.
        let goes_on = (3.0 * u - 1.0).clamp(0.0, 1.0);
        let stands_in = match self.0 {
            Some(Fault::NothingStandsIn) => 0.0,
            Some(Fault::Twice) if goes_on < 1.0 => 1.0,
            _ => 1.0 - goes_on,
        };
        let throughput = match self.0 {
            Some(Fault::NoThroughput) => Rgb::splat(0.5),
            _ => vertex.throughput,
        };
        VertexEnding {
            radiance: stands_in * throughput,
            goes_on,
        }
    }
}

/// Whatever share of a path goes on, a furnace stays white, pixel by pixel and in batches as alone.
#[test]
fn a_furnace_stays_white() {
    let scene = Scene::new(&sized(builtin::furnace(), 16)).unwrap();
    let ids: Vec<SampleId> = (0..16_384u32)
        .map(|i| SampleId {
            x: i % 16,
            y: i / 16 % 16,
            index: i / 256,
        })
        .collect();
    let faults = [Fault::Twice, Fault::NoThroughput, Fault::NothingStandsIn];
    check_faults(&faults, |fault| {
        let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_ending(Anyhow(fault));
        let mut values = vec![Rgb::ZERO; ids.len()];
        tracer.sample_many(&ids, 7, &mut values);
        for id in [0, 100, 200, 1000 - MAX_BATCH] {
            let SampleId { x, y, index } = ids[id];
            let alone = tracer.sample(x, y, index, 7);
            assert_eq!(alone, values[id], "a path alone is not what it is in a batch");
        }
        let mean = values.iter().map(|v| f64::from(luminance(*v))).sum::<f64>() / 16_384.0;
        // Samples of this furnace vary by less than 1: five standard errors.
        match (mean - 1.0).abs() < 5.0 / 128.0 {
            true => Ok(()),
            false => Err(format!("a mean of {mean}")),
        }
    })
    .expect("all faults are noticed");
}

fn cornell(side: u32) -> Scene {
    let mut description = sized(builtin::cornell(), side);
    // Caches stand for paths without end.
    (
        description.settings.max_depth,
        description.settings.roulette_depth,
    ) = (Some(48), 12);
    Scene::new(&description).unwrap()
}

fn options(scene: &Scene, rule: Termination) -> CachedPathsOptions {
    let mut options = CachedPathsOptions::new(rule, scene);
    options.cache.slots = 1 << 12;
    options.cache.cells.growth = 0.25;
    (options.cache.samples, options.passes) = (8, 16);
    options
}

fn cached<'a>(scene: &'a Scene, options: CachedPathsOptions) -> CachedPaths<'a, EmittersByPower<'a>> {
    CachedPaths::new(scene, scene.emitters_by_power(), options).unwrap()
}

fn rendered(method: &mut impl FrameMethod, frames: u32, seed: u64, threads: usize) -> Film {
    let [width, height] = method.size();
    let mut options = RenderOptions::new(width, height, Budget::Samples(frames));
    (options.seed, options.threads) = (seed, threads);
    let outcome = render_frames(method, &options, &|_| (), &AtomicBool::new(false)).unwrap();
    assert!(outcome.rays.is_some_and(|rays| rays.camera > 0));
    outcome.film
}

/// The same bits for any number of threads, of the image and of what the cache knows.
#[test]
fn threads_change_nothing() {
    let scene = cornell(24);
    let mut options = options(
        &scene,
        Termination::Mse {
            target: 50.0,
            margin: 0.9,
        },
    );
    (options.passes, options.every_frame, options.cache.slots) = (6, true, 64);
    same_for_any_number_of_threads(&scene, options, None).unwrap();
    options.guide = Some(GuidedPathsOptions::new(GuideKind::Vmf));
    same_for_any_number_of_threads(&scene, options, None).unwrap();
}

/// A fault of one thread.
#[derive(Clone, Copy, Debug)]
enum ThreadFault {
    /// With seven threads other vertices are kept.
    Kept,
    /// With seven threads cells are split, or separated by direction, as others are not.
    Cells,
}

/// So it is where cells are split while the table is full, and where records are by direction. A
/// fault of one thread is noticed.
#[test]
fn threads_change_no_split_and_no_facet() {
    let description = sized(builtin::cornell_glossy(), 24);
    let scene = Scene::new(&description).unwrap();
    let rule = Termination::Variance {
        threshold: 0.3,
        relative: true,
    };
    let mut refined = options(&scene, rule);
    (refined.passes, refined.every_frame, refined.cache.slots) = (64, true, 128);
    refined.cache.refinement = Some(Refinement {
        least_bias: 0.0,
        most_load: 1.0,
        levels: 3,
    });
    let mut both = refined;
    both.facets = Some(Facets::new(8).unwrap());
    let mut faceted = both;
    faceted.cache.refinement = None;
    let faults = [ThreadFault::Kept, ThreadFault::Cells];
    check_faults(&faults, |fault| {
        let split = same_for_any_number_of_threads(&scene, refined, fault)?;
        assert!(split > 0);
        assert_eq!(same_for_any_number_of_threads(&scene, faceted, fault)?, 0);
        same_for_any_number_of_threads(&scene, both, fault).map(drop)
    })
    .expect("all faults are noticed");
}

/// Returns how many cells are split.
fn same_for_any_number_of_threads(
    scene: &Scene,
    options: CachedPathsOptions,
    fault: Option<ThreadFault>,
) -> Result<usize, String> {
    let images = [1, 2, 7].map(|threads| {
        let mut options = options;
        match fault.filter(|_| threads == 7) {
            Some(ThreadFault::Kept) => options.cache.keep_one_in += 1,
            Some(ThreadFault::Cells) => (options.cache.refinement, options.facets) = (None, None),
            None => (),
        }
        let mut method = cached(scene, options);
        let film = rendered(&mut method, 2, 3, threads);
        let known = method.cache().view();
        let known: (Vec<u64>, Vec<CachedRadiance>) = (known.words().collect(), known.records().to_vec());
        (film.mean_image(), method.report(), method.figures(), known)
    });
    let (image, report, figures, known) = &images[0];
    assert!(
        report.occupancy.refused > 0,
        "a table that is too small: {report:?}"
    );
    for (other, other_report, other_figures, other_known) in &images[1..] {
        if other_known != known {
            return Err("other records".to_owned());
        }
        if (other.pixels(), other_report, other_figures) != (image.pixels(), report, figures) {
            return Err(format!("{other_report:?} and {report:?}"));
        }
    }
    Ok(report.split)
}

/// What path tracing has after so many samples a pixel.
fn truth(scene: &Scene, samples: u32) -> Film {
    let settings = scene.settings();
    let mut all = RenderOptions::new(settings.width, settings.height, Budget::Samples(samples));
    all.seed = 9;
    let tracer = PathTracer::new(scene, scene.emitters_by_power());
    render(&tracer, &all, &|_| (), &AtomicBool::new(false))
        .unwrap()
        .film
}

/// Look-ups that are not moved, and cells that contain their pixels.
fn unmoved(scene: &Scene, rule: Termination) -> CachedPathsOptions {
    let mut options = options(scene, rule);
    (options.jitter, options.points) = (false, PointSet::Independent);
    (options.cache.cells.cell, options.cache.cells.growth) = (0.7, 0.0);
    options
}

/// Squared bias, the median pixel's variance over its squared brightness, and path length of
/// frames.
fn judged(scene: &Scene, options: CachedPathsOptions, truth: &Film) -> [f64; 3] {
    let mut method = cached(scene, options);
    let (frames, [width, height]) = (48, method.size());
    let film = rendered(&mut method, frames, 1, 2);
    let (mut bias, mut variances) = (0.0, Vec::new());
    for y in 0..height {
        for x in 0..width {
            let (pixel, wanted) = (film.get(x, y).unwrap(), truth.get(x, y).unwrap());
            let [mean, true_mean] = [pixel, wanted].map(|pixel| pixel.mean()[1]);
            let [own, noise] = [pixel, wanted].map(|pixel| pixel.variance_of_mean().unwrap()[1]);
            bias += (mean - true_mean).powi(2) - own - noise;
            variances.push(own * f64::from(frames) / (true_mean * true_mean + 1e-6));
        }
    }
    variances.sort_unstable_by(f64::total_cmp);
    let figures = method.figures();
    let length = figures.iter().find(|(name, _)| *name == "path_length");
    let pixels = f64::from(width * height);
    [bias / pixels, variances[variances.len() / 2], length.unwrap().1]
}

/// The variance stays under each bound; as the bound rises, bias falls and paths get longer.
fn keeps_to_bounds(scene: &Scene, truth: &Film, thresholds: &[f32], guide: Option<GuidedPathsOptions>) {
    let mut last = [f64::INFINITY, 0.0, 0.0];
    for &threshold in thresholds {
        let rule = Termination::Variance {
            threshold,
            relative: true,
        };
        let mut options = unmoved(scene, rule);
        options.guide = guide;
        let found = judged(scene, options, truth);
        let [bias, variance, length] = found;
        println!("bound {threshold}: squared bias {bias:.3e}, variance {variance:.4}, {length:.2} edges");
        // What varies within a pixel before any path begins is not in the bound.
        assert!(
            variance < 1.25 * f64::from(threshold) + 0.01,
            "{threshold}: {variance}"
        );
        assert!(length > last[2], "{threshold}: {length} edges after {last:?}");
        assert!(
            bias < last[0] || bias.abs() < 2e-4,
            "{threshold}: {bias} after {last:?}"
        );
        last = found;
    }
}

/// The variance stays under its bound, bias falls and paths get longer as the bound rises, and in
/// the end there is none. In green light, nearly all of this scene's luminance; the median of 1,600
/// variances of 48 frames is within some per cent.
#[test]
fn variance_stays_under_its_bound() {
    let scene = cornell(40);
    let truth = truth(&scene, 512);
    keeps_to_bounds(&scene, &truth, &[0.01, 0.1, 0.5, 1e4], None);
    let green = |film: &Film| film.mean_image().mean()[1];
    let mut free = cached(&scene, options(&scene, Termination::variance(1e9)));
    let ratio = green(&rendered(&mut free, 48, 2, 2)) / green(&truth);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

/// The same with a guide that the passes train: the cache is of guided paths. Where nothing ends
/// early, the image is that of paths.
#[test]
fn guided_paths_keep_to_the_bound() {
    let scene = cornell(40);
    let truth = truth(&scene, 512);
    let guide = Some(GuidedPathsOptions::new(GuideKind::Quadtree));
    keeps_to_bounds(&scene, &truth, &[0.01, 0.1, 0.5], guide);
    let green = |film: &Film| film.mean_image().mean()[1];
    let mut free = options(&scene, Termination::variance(1e9));
    free.guide = guide;
    let mut method = cached(&scene, free);
    let ratio = green(&rendered(&mut method, 48, 2, 2)) / green(&truth);
    assert!(method.field().unwrap().mean_share() > 0.05, "nothing is guided");
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

/// A glossy floor has no records, as it reflects a lamp to a wall by direction: the wall's record
/// then has the light of paths. With means over directions it lost two fifths of it.
#[test]
fn glossy_light_is_not_lost() {
    let mut description = sized(builtin::glossy_bounce(), 24);
    (
        description.settings.max_depth,
        description.settings.roulette_depth,
    ) = (Some(48), 12);
    let scene = Scene::new(&description).unwrap();
    let truth = truth(&scene, 1024);
    let mut options = options(&scene, Termination::Fixed { depth: 1 });
    (options.cache.samples, options.passes) = (16, 64);
    let green = |film: &Film| film.mean_image().mean()[1];
    let ratio = green(&rendered(&mut cached(&scene, options), 8, 1, 2)) / green(&truth);
    println!("{ratio} of the light");
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

/// Two cells a scene are a cache that is wrong: paths that end there show it, and fixed ends at
/// later edges show it less.
#[test]
fn later_ends_hide_more() {
    let scene = cornell(24);
    let truth = truth(&scene, 512);
    let biases = [1, 2, 4].map(|depth| {
        let mut options = options(&scene, Termination::Fixed { depth });
        (options.cache.cells.cell, options.cache.cells.growth) = (1.9, 0.0);
        let film = rendered(&mut cached(&scene, options), 32, 1, 2);
        let pairs = film.mean_image();
        let truth = truth.mean_image();
        let errors = pairs.pixels().iter().zip(truth.pixels());
        let sum: f64 = errors.map(|(a, b)| f64::from(a[1] - b[1]).powi(2)).sum();
        sum / 576.0
    });
    assert!(
        biases[0] > 2.0 * biases[1] && biases[0] > 2.0 * biases[2],
        "{biases:?}"
    );
}

#[test]
fn impossible_options_are_refused() {
    let scene = cornell(24);
    let good = options(&scene, Termination::Fixed { depth: 2 });
    let refused = |options| CachedPaths::new(&scene, scene.emitters_by_power(), options).err();
    assert_eq!(
        refused(CachedPathsOptions {
            survival: 0.0,
            ..good
        }),
        Some(CachedPathsError::Survival(0.0))
    );
    let too_many = CachedPathsOptions {
        passes: u32::MAX,
        ..good
    };
    assert_eq!(refused(too_many), Some(CachedPathsError::Passes(u32::MAX)));
    let rule = Termination::Fixed { depth: 0 };
    assert!(matches!(
        refused(CachedPathsOptions { rule, ..good }),
        Some(CachedPathsError::Caching(_))
    ));
}
