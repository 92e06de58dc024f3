//! Paths that end in a cache by several rules, beside paths that do not: variance and bias of a
//! sample, length of paths, and what is left of both at equal processor time.
//!
//! ```text
//! cargo run --release -p lightshed-integrator --example cache_table -- \
//!     SCENE [SIDE] [REFERENCE] [SAMPLES] [SURVIVAL] [RULE[+GUIDE]]…
//! ```
//!
//! Errors are of luminance, over the squared luminance of the pixel in the reference, plus a
//! hundredth of the squared mean of the image; the mean over all pixels but the brightest and
//! darkest per cent. The reference has the last word on no more than its own noise, which is taken
//! off.

use lightshed_film::{FrameMethod, SampledFrames, process_cpu_seconds};
use lightshed_integrator::{CacheRule, CachedPaths, CachedPathsOptions, GuidedPathsOptions, PathTracer};
use lightshed_scene::{EmittersByPower, Rgb, Scene, builtin, import, luminance};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Sums of pixels' luminances and their squares over so many samples.
struct Pixels {
    sums: Vec<[f64; 2]>,
    count: f64,
    seconds: f64,
}

impl Pixels {
    fn new(method: &mut dyn FrameMethod, samples: u32, seed: u64) -> Self {
        let [width, height] = method.size();
        let mut image = vec![Rgb::ZERO; width as usize * height as usize];
        let mut sums = vec![[0.0; 2]; image.len()];
        let mut seconds = 0.0;
        for frame in 0..samples {
            let start = process_cpu_seconds().unwrap_or_default();
            method.render_frame(frame, seed, &mut image, &AtomicBool::new(false));
            seconds += process_cpu_seconds().unwrap_or_default() - start;
            for (sum, value) in sums.iter_mut().zip(&image) {
                let value = f64::from(luminance(*value));
                *sum = [sum[0] + value, sum[1] + value * value];
            }
        }
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

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let argument =
        |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let name = argument(1, "door-gap");
    let mut description = match builtin::by_name(&name) {
        Some(description) => description,
        None => import::load(Path::new(&name), &[])?.description,
    };
    let side: u32 = argument(2, "64").parse()?;
    (description.settings.width, description.settings.height) = (side, side);
    // Caches stand for paths without end.
    (
        description.settings.max_depth,
        description.settings.roulette_depth,
    ) = (Some(64), 8);
    let scene = Scene::new(&description)?;
    let sampler = || -> EmittersByPower<'_> { scene.emitters_by_power() };
    let plain = || SampledFrames::new(PathTracer::new(&scene, sampler()), [side; 2], 1);
    let truth = Pixels::new(&mut plain(), argument(3, "1024").parse()?, 77);
    let samples: u32 = argument(4, "64").parse()?;
    let path = Pixels::new(&mut plain(), samples, 1);
    let survival: f32 = argument(5, "1").parse()?;
    println!("{name}, {side} x {side}, {samples} samples, survival {survival}\n");
    println!(
        "| rule | variance | squared bias | mean | edges | CPU-s a sample | the passes' | records | error at the time of 1 | 4 | 16 samples of paths |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let time = path.seconds / path.count;
    let row = |rule: &str, found: &Pixels, [edges, records, passes]: [f64; 3]| {
        let [variance, bias] = errors(found, &truth);
        let cost = found.seconds / found.count;
        let at = |samples: f64| variance * cost / (samples * time) + bias.max(0.0);
        println!(
            "| {rule} | {variance:.4} | {bias:.5} | {:.3} | {edges:.2} | {cost:.4} | {passes:.2} | {records} | {:.4} | {:.4} | {:.4} |",
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
        let (ends, guide) = match rule.split_once('+') {
            Some((ends, guide)) => (ends, Some(GuidedPathsOptions::new(guide.parse()?))),
            None => (rule.as_str(), None),
        };
        let mut options = CachedPathsOptions::new(ends.parse::<CacheRule>()?.0, &scene);
        options.guide = guide;
        (options.survival, options.points) = (survival, lightshed_sampling::PointSet::Independent);
        options.visible_emission = false;
        let mut method = CachedPaths::new(&scene, sampler(), options)?;
        // The passes come with the first frame.
        let filled = Pixels::new(&mut method, 1, 2).seconds;
        let found = Pixels::new(&mut method, samples, 1);
        let figures = method.figures();
        let figure = |name: &str| figures.iter().find(|(other, _)| *other == name).unwrap().1;
        let passes = (filled - found.seconds / found.count).max(0.0);
        row(
            &rule,
            &found,
            [figure("path_length"), figure("cache_records"), passes],
        );
    }
    Ok(())
}
