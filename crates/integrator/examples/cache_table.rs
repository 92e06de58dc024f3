//! Paths that end in a cache by several rules, beside paths that do not: variance and bias of a
//! sample, length of paths, and what is left of both at equal processor time.
//!
//! ```text
//! cargo run --release -p lightshed-integrator --features studies --example cache_table -- \
//!     SCENE [SIDE[:EVERY]] [REFERENCE] [SAMPLES] [SURVIVAL] [RULE[+GUIDE][~CELLS][%LEVELS][^FACETS]]…
//! ```
//!
//! `SIDE²` pixels are judged. With `EVERY`, each is one of a square of `EVERY²` smaller pixels:
//! what such a small pixel sees hardly varies, so nearly all of its variance is of what the bounds
//! are about. `CELLS` scales the cells of the cache, which are halved up to `LEVELS` times. Glossy
//! surfaces have records in `FACETS²` directions.
//!
//! With `EVERY`, the points above a bound are told apart: those that keep it by the brightness that
//! the cache has there; of the others those where one edge varies by more than a fifth over what
//! the cache says (`P`); of the others those where the shares `α` of paths have that effect, as `α`
//! is that of a moved look-up: `E[α²] P` is above the bound though `P` is right in the mean; and
//! the rest. An absolute bound has no brightness.
//!
//! Errors are of luminance, over the squared luminance of the pixel in the reference, plus a
//! hundredth of the squared mean of the image; the mean over all pixels but the brightest and
//! darkest per cent. `above` is the share of pixels whose variance is more than 1.2 times the
//! bound. The reference has the last word on no more than its own noise, which is taken off.

use lightshed_caching::{CacheView, Facets, PathBudget, Prefixed, Refinement, Termination};
use lightshed_film::{FrameMethod, PixelEstimator, RayTally, SampleId, process_cpu_seconds};
use lightshed_integrator::{
    CacheEnding, CacheRule, CachedPaths, CachedPathsOptions, EndingVertex, GuidedPathsOptions, PathEnding,
    PathTracer, VertexEnding,
};
use lightshed_sampling::{CounterRng, parallel};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Rgb, Scene, builtin, import, luminance};
use lightshed_spatial::SurfaceSite;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Sums of points' luminances and their squares over so many samples.
struct Pixels {
    sums: Vec<[f64; 2]>,
    count: f64,
    seconds: f64,
}

/// The points of the image that are judged: a pixel in the middle of each square of `every²`.
#[derive(Clone, Copy)]
struct Points {
    side: u32,
    every: u32,
}

impl Pixels {
    fn new(estimator: &impl PixelEstimator, points: Points, samples: u32, seed: u64) -> Self {
        let Points { side, every } = points;
        let place = |number: u32| every * number + every / 2;
        let mut sums = vec![[0.0; 2]; (side * side) as usize];
        let start = process_cpu_seconds().unwrap_or_default();
        parallel::for_each(sums.chunks_mut(side as usize), |row, sums| {
            let mut ids = vec![SampleId::default(); sums.len()];
            let mut values = vec![Rgb::ZERO; sums.len()];
            for index in 0..samples {
                for (x, id) in (0..side).zip(&mut ids) {
                    let (x, y) = (place(x), place(row as u32));
                    *id = SampleId { x, y, index };
                }
                estimator.sample_many(&ids, seed, &mut values);
                for (sum, value) in sums.iter_mut().zip(&values) {
                    let value = f64::from(luminance(*value));
                    *sum = [sum[0] + value, sum[1] + value * value];
                }
            }
        });
        let seconds = process_cpu_seconds().unwrap_or_default() - start;
        let count = f64::from(samples);
        Self { sums, count, seconds }
    }

    fn mean(&self, pixel: usize) -> f64 {
        self.sums[pixel][0] / self.count
    }

    /// Of one sample.
    fn variance(&self, pixel: usize) -> f64 {
        let mean = self.mean(pixel);
        (self.sums[pixel][1] / self.count - mean * mean).max(0.0) * self.count / (self.count - 1.0)
    }

    fn image_mean(&self) -> f64 {
        (0..self.sums.len()).map(|pixel| self.mean(pixel)).sum::<f64>() / self.sums.len() as f64
    }
}

/// Mean over pixels without the lowest and highest per cent.
fn trimmed(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let kept = &values[values.len() / 100..values.len() - values.len() / 100];
    kept.iter().sum::<f64>() / kept.len() as f64
}

/// Relative variance of a sample, and relative squared bias.
fn errors(found: &Pixels, truth: &Pixels) -> [f64; 2] {
    let floor = 0.01 * truth.image_mean().powi(2);
    let over = |pixel: usize| truth.mean(pixel).powi(2) + floor;
    let pixels = 0..truth.sums.len();
    let variance = pixels.clone().map(|p| found.variance(p) / over(p));
    let bias = pixels.map(|p| {
        let noise = found.variance(p) / found.count + truth.variance(p) / truth.count;
        ((found.mean(p) - truth.mean(p)).powi(2) - noise) / over(p)
    });
    [trimmed(variance.collect()), trimmed(bias.collect())]
}

/// A median, and the share of points whose variance is more than a fifth above a bound.
fn kept(found: &Pixels, truth: &Pixels, bound: f64) -> [f64; 2] {
    let floor = 0.01 * truth.image_mean().powi(2);
    let relative = |p: usize| found.variance(p) / (truth.mean(p).powi(2) + floor);
    let mut values: Vec<f64> = (0..truth.sums.len()).map(relative).collect();
    values.sort_unstable_by(f64::total_cmp);
    let above = values.iter().filter(|value| **value > 1.2 * bound).count();
    [values[values.len() / 2], above as f64 / values.len() as f64]
}

/// What the cache says at the first vertex, in place of the image.
struct Said<'c, F> {
    cache: CacheView<'c>,
    eye: Vec3,
    what: F,
}

impl<F: Fn(&Prefixed) -> f32 + Sync> PathEnding for Said<'_, F> {
    type Path = ();

    fn at(&self, (): &mut (), vertex: &EndingVertex) -> VertexEnding {
        let EndingVertex { id, seed, .. } = *vertex;
        let u = CounterRng::new(!seed, id.y << 16 | id.x, id.index).next_2d();
        let site = SurfaceSite::new(vertex.position, vertex.normal)
            .with_eye_distance(vertex.position.distance(self.eye));
        let cached = self.cache.query_jittered(&site, u).copied().unwrap_or_default();
        let value = (self.what)(&Prefixed::new(vertex.throughput, &cached));
        VertexEnding {
            radiance: Rgb::splat(value),
            goes_on: 0.0,
        }
    }
}

/// What is known of the points whose variances are held to a bound.
struct Known<'p> {
    found: &'p Pixels,
    truth: &'p Pixels,
    /// Squared brightness that the cache has, the variance that it says of an edge, the squared
    /// share of the path that continues.
    said: [Pixels; 3],
    /// Paths that end after one edge.
    edge: Pixels,
    is_relative: bool,
}

impl Known<'_> {
    /// Shares of the points that are more than a fifth above a bound: those that keep it by the
    /// cache's brightness, those whose variance the cache underestimates, those whose paths
    /// continue by shares that vary, the rest.
    fn reasons(&self, bound: f64) -> [f64; 4] {
        let [squares, claimed, shares] = &self.said;
        let floor = 0.01 * self.truth.image_mean().powi(2);
        let most = |squared: f64| match self.is_relative {
            true => 1.2 * bound * (squared + floor),
            false => 1.2 * bound,
        };
        let mut found = [0.0; 4];
        for p in 0..self.truth.sums.len() {
            let (variance, edge) = (self.found.variance(p), self.edge.variance(p));
            if variance <= most(self.truth.mean(p).powi(2)) {
                continue;
            }
            let reason = if variance <= most(squares.mean(p)) {
                0
            } else if edge > 1.2 * claimed.mean(p) {
                1
            } else if shares.mean(p) * edge > most(squares.mean(p)) {
                2
            } else {
                3
            };
            found[reason] += 1.0 / self.truth.sums.len() as f64;
        }
        found
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let argument =
        |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let name = argument(1, "door-gap");
    let mut description = match builtin::by_name(&name) {
        Some(description) => description,
        None => import::load(Path::new(&name), &[])?.description,
    };
    let size = argument(2, "64");
    let (side, every) = size.split_once(':').unwrap_or((&size, "1"));
    let points = Points {
        side: side.parse()?,
        every: every.parse()?,
    };
    // Caches stand for paths without end.
    (
        description.settings.max_depth,
        description.settings.roulette_depth,
    ) = (Some(64), 8);
    let mut with_side = |side: u32| {
        (description.settings.width, description.settings.height) = (side, side);
        Scene::new(&description)
    };
    // What the camera of the caches' passes sees, and the scene whose pixels are the points.
    let (seen, scene) = (with_side(points.side)?, with_side(points.side * points.every)?);
    let plain = PathTracer::new(&scene, scene.emitters_by_power());
    let truth = Pixels::new(&plain, points, argument(3, "1024").parse()?, 77);
    let samples: u32 = argument(4, "64").parse()?;
    let path = Pixels::new(&plain, points, samples, 1);
    let survival: f32 = argument(5, "1").parse()?;
    println!("{name}, {size} points, {samples} samples, survival {survival}\n");
    println!(
        "| rule | variance | median | above | squared bias | mean | edges | CPU-s a sample | the passes' | records | error at the time of 1 | 4 | 16 samples of paths |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let time = path.seconds / path.count;
    let row = |rule: &str, found: &Pixels, [edges, records, passes]: [f64; 3]| {
        let [variance, bias] = errors(found, &truth);
        let bound = rule.strip_prefix("variance@").and_then(|rest| {
            let end = rest.find(['+', '~', '%', '^']).unwrap_or(rest.len());
            rest[..end].parse().ok()
        });
        let [median, above] = kept(found, &truth, bound.unwrap_or(f64::NAN));
        let cost = found.seconds / found.count;
        let at = |samples: f64| variance * cost / (samples * time) + bias.max(0.0);
        println!(
            "| {rule} | {variance:.4} | {median:.4} | {above:.3} | {bias:.5} | {:.3} | {edges:.2} | {cost:.4} | {passes:.2} | {records} | {:.4} | {:.4} | {:.4} |",
            found.image_mean() / truth.image_mean(),
            at(1.0),
            at(4.0),
            at(16.0),
        );
    };
    row("none", &path, [f64::NAN, 0.0, 0.0]);
    let given: Vec<String> = arguments.iter().skip(6).cloned().collect();
    let usual = [
        "fixed@1",
        "fixed@2",
        "spread@0.01",
        "spread@100",
        "variance@0.01",
        "variance@0.1",
        "variance@1",
        "variance@10",
        "mse@1",
        "mse@100",
    ];
    let rules = match given.is_empty() {
        true => usual.map(str::to_owned).to_vec(),
        false => given,
    };
    for rule in rules {
        let (ends, facets) = rule.split_once('^').unwrap_or((&rule, "0"));
        let (ends, refined) = ends.split_once('%').unwrap_or((ends, "0"));
        let (ends, cells) = ends.split_once('~').unwrap_or((ends, "1"));
        let (ends, guide) = match ends.split_once('+') {
            Some((ends, guide)) => (ends, Some(GuidedPathsOptions::new(guide.parse()?))),
            None => (ends, None),
        };
        let mut options = CachedPathsOptions::new(ends.parse::<CacheRule>()?.0, &seen);
        let cells: f32 = cells.parse()?;
        options.cache.cells.cell *= cells;
        options.cache.cells.growth *= cells;
        options.facets = Facets::new(facets.parse()?).ok();
        options.cache.refinement = match refined.parse()? {
            0 => None,
            levels => Some(Refinement {
                levels,
                ..Refinement::default()
            }),
        };
        options.guide = guide;
        options.survival = survival;
        options.visible_emission = false;
        let mut method = CachedPaths::new(&seen, seen.emitters_by_power(), options)?;
        // The passes come with the first frame, which costs little beside them.
        let start = process_cpu_seconds().unwrap_or_default();
        let mut frame = vec![Rgb::ZERO; (points.side * points.side) as usize];
        method.render_frame(0, 2, &mut frame, &AtomicBool::new(false));
        let passes = process_cpu_seconds().unwrap_or_default() - start;
        let mut rays = RayTally::default();
        let ending = CacheEnding {
            cache: method.cache().view(),
            rule: options.rule,
            eye: scene.camera().ray(Vec2::splat(0.5), [0.5; 2]).origin,
            jitter: options.jitter,
            facets: options.facets,
            survival,
            rays: &rays,
        };
        let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_ending(ending);
        let found = match (method.field(), options.guide) {
            (Some(field), Some(guide)) => {
                let roulette = scene.settings().roulette_depth.max(guide.roulette_depth);
                let tracer = tracer.with_depths(scene.settings().max_depth, roulette);
                Pixels::new(&tracer.with_guide(field), points, samples, 1)
            }
            _ => Pixels::new(&tracer, points, samples, 1),
        };
        let bound = ends
            .strip_prefix("variance")
            .and_then(|rest| rest.split_once('@'))
            .map(|(_, bound)| bound.parse::<f64>());
        if let (Some(Ok(bound)), true) = (bound, points.every > 1) {
            let rule = options.rule;
            let tracer = || PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(64), 8);
            let said = |what: &(dyn Fn(&Prefixed) -> f32 + Sync)| {
                let (cache, eye) = (ending.cache, ending.eye);
                Pixels::new(&tracer().with_ending(Said { cache, eye, what }), points, 64, 3)
            };
            let unused = RayTally::default();
            let one_edge = CacheEnding {
                rule: Termination::Fixed { depth: 2 },
                rays: &unused,
                ..ending
            };
            let known = Known {
                found: &found,
                truth: &truth,
                said: [
                    said(&|at| at.brightness * at.brightness),
                    said(&|at| at.variance),
                    said(&|at| PathBudget::default().share(&rule, 1, at).powi(2)),
                ],
                edge: Pixels::new(&tracer().with_ending(one_edge), points, samples, 4),
                is_relative: ends.starts_with("variance@"),
            };
            let [bright, variance, shares, rest] = known.reasons(bound);
            println!(
                "above by brightness {bright:.3}, by local variance {variance:.3}, by shares {shares:.3}, else {rest:.3}"
            );
        }
        let edges = rays.take().path as f64 / (found.sums.len() as f64 * found.count);
        let figures = method.figures();
        let records = figures.iter().find(|(other, _)| *other == "cache_records");
        row(&rule, &found, [edges, records.unwrap().1, passes]);
    }
    Ok(())
}
