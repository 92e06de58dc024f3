//! How a guide learns, frame by frame: the variance of a frame, what regions there are and which
//! share they give to the guide. At the end, what was gained at equal CPU time.
//!
//! Squared errors need no reference. Of a frame's two halves, a quarter of the squared difference
//! has the expectation of the frame's variance. The combination of all frames has the variance
//! `1 / Σ n_i²/V_i`, with `V_i` the sum of the variances of the `n_i` frames between two updates.
//! Plain paths get as many samples with the scene's own roulette. The gain is the ratio of both
//! products of variance and CPU time, training included.
//!
//! Rare samples hold most of some variances, and halves of few frames have not seen them. With
//! `seeds=4` the whole is rendered with four seeds, and the variance is that between the images:
//! what a user gets. It is given once more without the noisiest thousandth of the pixels.
//!
//! ```sh
//! cargo run --release -p lightshed-integrator --example guide_training -- \
//!     [scene] [cdq|sdtree|vmf|mcmm|mcmm-grid|places] [bits] [frames] [setting=value]…
//! ```

use lightshed_guiding::{Interpolation, QuadtreeGoal};
use lightshed_integrator::film::{FrameMethod, SampledFrames, process_cpu_seconds};
use lightshed_integrator::{
    AnyEmitters, GuideKind, GuidedPaths, GuidedPathsOptions, LightChoosing, LightSelection, PathTracer,
};
use lightshed_scene::glam::DVec3;
use lightshed_scene::{Rgb, Scene, builtin, import};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let argument =
        |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let name = argument(1, "lighthouse");
    let mut description = match builtin::by_name(&name) {
        Some(description) => description,
        None => import::load(Path::new(&name), &[])?.description,
    };
    (description.settings.width, description.settings.height) = (128, 128);
    let mut options = GuidedPathsOptions::new(argument(2, "cdq").parse::<GuideKind>()?);
    let (mut seed, mut seeds, mut table, mut lights) = (1, 1, true, LightChoosing::Power);
    options.quadtree.bits = argument(3, "64").parse()?;
    for setting in arguments.iter().skip(5) {
        let (name, value) = setting.split_once('=').ok_or("settings are name=value")?;
        match name {
            "split" => {
                options.field.split_above = value.parse()?;
                options.field.collapse_below = options.field.split_above / 2;
            }
            "share" => options.field.max_share = value.parse()?,
            "share-variance" => options.field.share_by_variance = value.parse()?,
            "depth" => description.settings.max_depth = Some(value.parse()?),
            "share-prior" => options.field.share_prior = value.parse()?,
            "prior" => options.quadtree.prior_samples = value.parse()?,
            "least" => options.quadtree.least_samples = value.parse()?,
            "eagerness" => options.quadtree.eagerness = value.parse()?,
            "goal" if value == "even" => options.quadtree.goal = QuadtreeGoal::EvenLoad,
            "goal" => {
                options.quadtree.goal = QuadtreeGoal::LeastVariance {
                    share: value.parse()?,
                }
            }
            "product" => options.quadtree.product = value.parse()?,
            "parallax" => options.quadtree.parallax = value.parse()?,
            "worth" => options.worth_depth = value.parse()?,
            "roulette" => options.roulette_depth = value.parse()?,
            "places" => options.places.places = value.parse()?,
            "angle" => options.places.prior_angle = value.parse()?,
            "place-decay" => options.places.decay = value.parse()?,
            "even" => options.places.even_share = value.parse()?,
            "exchanges" => options.places.exchanges = value.parse()?,
            "states" => options.states = value.parse()?,
            "memory" => options.memory = (value.parse::<f64>()? * f64::from(1 << 20)) as usize,
            "cells" => options.cells.cells = value.parse()?,
            "levels" => options.cells.levels = value.parse()?,
            "survival" => options.chains.survival = value.parse()?,
            "lights" if value == "none" => lights = LightChoosing::Unfound,
            "lights" => lights = value.parse()?,
            "table" => table = value.parse()?,
            "seed" => seed = value.parse()?,
            "seeds" => seeds = value.parse()?,
            "samples" => options.samples = value.parse()?,
            "every" => options.every_frame = value.parse()?,
            "borders" => options.field.interpolation = Interpolation::None,
            "decay" => options.vmf.decay = value.parse()?,
            "count" => options.vmf.prior_count = value.parse()?,
            "blend" if value == "none" => options.field.interpolation = Interpolation::None,
            "exploring" => options.exploring = value.parse()?,
            "within" => options.learn_within = value.parse()?,
            "training" => options.training = value.parse()?,
            "drop" => options.may_drop = value.parse()?,
            _ => return Err(format!("no setting {name}").into()),
        }
    }
    let scene = Scene::new(&description)?;
    let emitters = &match lights {
        // As `path` has them without options.
        LightChoosing::Power => AnyEmitters::Power(scene.emitters_by_power()),
        lights => AnyEmitters::Selection(Arc::new(LightSelection::trained(&scene, lights)?)),
    };
    if seeds > 1 {
        let frames = argument(4, "24").parse()?;
        println!("{name} {} {frames} frames:", options.kind.name());
        return compare_seeds(&scene, emitters, options, frames, seed..seed + seeds);
    }
    let mut method = GuidedPaths::new(&scene, emitters, options)?;
    let mut image = vec![Rgb::ZERO; 128 * 128];
    // Where the noise of later frames is.
    let mut blocks = [[0.0f64; 16]; 16];
    let frames: u32 = argument(4, "24").parse()?;
    // Of the frames since the last update: their number and the sum of their variances.
    // Of frames that train nothing: their number, CPU-seconds, rays and vertices.
    let (mut guided, mut plain_rays) = ([0.0f64; 4], 0.0);
    let (mut count, mut sum, mut certainty) = (0.0, 0.0, 0.0);
    let begin = process_cpu_seconds().unwrap_or(0.0);
    if table {
        println!("frame   variance   regions  share  seconds");
    }
    for frame in 0..frames {
        let start = std::time::Instant::now();
        let before = process_cpu_seconds().unwrap_or(0.0);
        let counts = method.render_frame(frame, seed, &mut image, &AtomicBool::new(false));
        let vertices = counts.map_or(0, |rays| rays.camera + rays.path);
        let rays = vertices + counts.map_or(0, |rays| rays.emitter);
        if frame == 0 {
            plain_rays = rays as f64;
        }
        if frame >= options.training {
            let frame = process_cpu_seconds().unwrap_or(0.0) - before;
            for (sum, more) in guided.iter_mut().zip([1.0, frame, rays as f64, vertices as f64]) {
                *sum += more;
            }
        }
        for (pixel, value) in image.iter().enumerate().filter(|_| frame >= 16) {
            blocks[pixel / 128 / 8][pixel % 128 / 8] += f64::from(value.length_squared());
        }
        (count, sum) = (count + 1.0, sum + method.last_variance());
        let next = frame + 1;
        let learns = options.every_frame || next.is_power_of_two() || next % options.learn_within == 0;
        if learns || next == frames {
            certainty += count * count / sum;
            (count, sum) = (0.0, 0.0);
        }
        let field = method.field();
        if !table {
            continue;
        }
        println!(
            "{frame:5} {:10.3e} {:9} {:6.3} {:8.3}{}",
            method.last_variance(),
            field.learnt_regions(),
            field.mean_share(),
            start.elapsed().as_secs_f64(),
            if method.is_dropped() { "  plain" } else { "" }
        );
    }
    let seconds = process_cpu_seconds().unwrap_or(0.0) - begin;
    let (plain, plain_seconds) = plain_frames(&scene, emitters, frames, options.samples, seed);
    println!(
        "{name} {} {} bits, {frames} frames: variance {plain:.3e} plain, {:.3e} combined; CPU-s {plain_seconds:.2} \
         plain, {seconds:.2}; gain {:.2}{}",
        options.kind.name(),
        options.quadtree.bits,
        1.0 / certainty,
        plain * plain_seconds * certainty / seconds,
        if method.is_dropped() { ", dropped" } else { "" }
    );
    let [trained, trained_seconds, rays, vertices] = guided;
    if trained > 0.0 && !method.is_dropped() {
        let of_plain = trained_seconds / trained / (plain_seconds / f64::from(frames));
        println!(
            "a trained frame: {:.2} of a plain one's rays, {of_plain:.2} of its time; a vertex costs {:.2} rays more",
            rays / trained / plain_rays,
            (of_plain * plain_rays - rays / trained) / (vertices / trained)
        );
    }
    if !table {
        return Ok(());
    }
    let total: f64 = blocks.iter().flatten().sum();
    println!("share of the noise by blocks of 8 x 8 pixels, per mille:");
    for row in blocks {
        println!(
            "{}",
            row.map(|block| format!("{:4.0}", 1000.0 * block / total))
                .concat()
        );
    }
    Ok(())
}

/// Variance of the mean of so many frames of plain paths, summed over pixels and channels, and the
/// CPU-seconds that they took.
fn plain_frames(
    scene: &Scene,
    emitters: &AnyEmitters<'_>,
    frames: u32,
    samples: u32,
    seed: u64,
) -> (f64, f64) {
    let tracer = PathTracer::new(scene, emitters).with_points(lightshed_sampling::PointSet::Sobol);
    let mut halves = SampledFrames::new(tracer, [128; 2], samples / 2);
    let mut images = [vec![Rgb::ZERO; 128 * 128], vec![Rgb::ZERO; 128 * 128]];
    let (mut variance, begin) = (0.0, process_cpu_seconds().unwrap_or(0.0));
    for frame in 0..frames {
        for (half, image) in (0..).zip(&mut images) {
            halves.render_frame(2 * frame + half, seed, image, &AtomicBool::new(false));
        }
        let pairs = images[0].iter().zip(&images[1]);
        variance += pairs
            .map(|(a, b)| 0.25 * (a.as_dvec3() - b.as_dvec3()).length_squared())
            .sum::<f64>();
    }
    let count = f64::from(frames);
    (
        variance / (count * count),
        process_cpu_seconds().unwrap_or(0.0) - begin,
    )
}

/// Sums of images of several seeds, and the CPU-seconds that they took.
struct Images {
    sums: Vec<DVec3>,
    squares: Vec<f64>,
    count: f64,
    seconds: f64,
}

impl Images {
    fn new() -> Self {
        Self {
            sums: vec![DVec3::ZERO; 128 * 128],
            squares: vec![0.0; 128 * 128],
            count: 0.0,
            seconds: 0.0,
        }
    }

    /// Renders one more: the mean of the frames of a method.
    fn add(&mut self, method: &mut impl FrameMethod, frames: u32, seed: u64) {
        let begin = process_cpu_seconds().unwrap_or(0.0);
        let mut image = vec![Rgb::ZERO; 128 * 128];
        let mut mean = vec![DVec3::ZERO; 128 * 128];
        for frame in 0..frames {
            method.render_frame(frame, seed, &mut image, &AtomicBool::new(false));
            for (mean, value) in mean.iter_mut().zip(&image) {
                *mean += value.as_dvec3() / f64::from(frames);
            }
        }
        self.seconds += process_cpu_seconds().unwrap_or(0.0) - begin;
        for ((sum, square), mean) in self.sums.iter_mut().zip(&mut self.squares).zip(mean) {
            *sum += mean;
            *square += mean.length_squared();
        }
        self.count += 1.0;
    }

    /// Variance of an image times its CPU time: of all pixels, and without the noisiest thousandth.
    fn costs(&self) -> [f64; 2] {
        let variance =
            |(sum, square): (&DVec3, &f64)| (square - sum.length_squared() / self.count) / (self.count - 1.0);
        let mut variances: Vec<f64> = self.sums.iter().zip(&self.squares).map(variance).collect();
        variances.sort_by(f64::total_cmp);
        let usual = &variances[..variances.len() - variances.len() / 1000];
        [variances.iter().sum::<f64>(), usual.iter().sum()].map(|sum| sum * self.seconds / self.count)
    }
}

/// Prints what a guide gains over plain paths, by the variance between images of these seeds.
fn compare_seeds(
    scene: &Scene,
    emitters: &AnyEmitters<'_>,
    options: GuidedPathsOptions,
    frames: u32,
    seeds: std::ops::Range<u64>,
) -> Result<(), Box<dyn std::error::Error>> {
    let (mut plain, mut guided) = (Images::new(), Images::new());
    let mut dropped = 0;
    for seed in seeds {
        let tracer = PathTracer::new(scene, emitters).with_points(lightshed_sampling::PointSet::Sobol);
        let mut frames_of_paths = SampledFrames::new(tracer, [128; 2], options.samples);
        plain.add(&mut frames_of_paths, frames, seed);
        let mut method = GuidedPaths::new(scene, emitters, options)?;
        guided.add(&mut method, frames, seed);
        dropped += u32::from(method.is_dropped());
        let [whole, usual] = [0, 1].map(|i| plain.costs()[i] / guided.costs()[i]);
        println!(
            "  {} seeds: gain {whole:.2}, of usual pixels {usual:.2}; variance x CPU-s {:.3e} plain, {:.3e}; \
             CPU-s {:.2} plain, {:.2}; dropped {dropped}",
            plain.count,
            plain.costs()[0],
            guided.costs()[0],
            plain.seconds / plain.count,
            guided.seconds / guided.count,
        );
    }
    Ok(())
}
