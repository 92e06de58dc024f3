//! What a rendering gave, as text or as one JSON object.

use crate::chosen::choice_json;
use crate::rendered::Rendered;
use lightshed::film::{ImageComparison, ShardHeader, process_cpu_seconds};
use lightshed::integrator::Choice;
use lightshed_lanes::LaneChoice;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// How long a part of the work took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Took {
    /// Wall time.
    pub seconds: f64,
    /// Processor time of all threads, where it is known.
    pub cpu_seconds: Option<f64>,
}

impl Took {
    /// Does the work, and times it.
    pub fn time<T>(work: impl FnOnce() -> T) -> (Self, T) {
        let (start, cpu_start) = (Instant::now(), process_cpu_seconds());
        let result = work();
        let took = Self {
            seconds: start.elapsed().as_secs_f64(),
            cpu_seconds: process_cpu_seconds()
                .zip(cpu_start)
                .map(|(end, start)| end - start),
        };
        (took, result)
    }
}

/// All figures of a finished rendering.
pub struct Report {
    /// Name or path of the scene.
    pub scene: String,
    /// Name of the method.
    pub method: &'static str,
    /// Longest path in edges; `None` without a limit.
    pub max_depth: Option<u32>,
    /// The seed.
    pub seed: u64,
    /// Number of threads.
    pub threads: usize,
    /// The GPU, where there was one, and seconds that the kernels of each name ran by its clock.
    pub device: Option<(String, BTreeMap<String, f64>)>,
    /// Seconds until rendering began: reading and building, and what the method prepares.
    pub setup_seconds: f64,
    /// Of that, reading the scene's files.
    pub reading: Took,
    /// Of that, building the scene and its trees.
    pub building: Took,
    /// What the importer had to say.
    pub warnings: Vec<String>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples and times.
    pub rendered: Rendered,
    /// Where the image is; `None` if there was nothing to write.
    pub output: Option<PathBuf>,
    /// The reference and how far from it the image is.
    pub comparison: Option<(PathBuf, ImageComparison)>,
    /// Which shard it is; `None` for an image.
    pub shard: Option<ShardHeader>,
    /// Figures that are the method's own, by name.
    pub figures: Vec<(&'static str, f64)>,
    /// How the method was chosen, if it was not given.
    pub choice: Option<Choice>,
}

impl Report {
    /// Paths traced.
    fn paths(&self) -> f64 {
        (self.rendered.totals.samples + self.rendered.totals.non_finite) as f64
    }

    /// Rays by kind for each sample of a pixel; `null` where the method does not count them.
    fn rays_per_sample(&self) -> Value {
        let Some(rays) = self.rendered.rays else {
            return Value::Null;
        };
        let [width, height] = self.size.map(f64::from);
        let samples = width * height * f64::from(self.rendered.samples_per_pixel);
        let kinds = rays.by_name().into_iter();
        kinds
            .map(|(kind, count)| (kind.to_owned(), json!(rate(count as f64, samples))))
            .collect()
    }

    /// One JSON object. Figures that are not defined are `null`.
    pub fn json(&self) -> Value {
        let [width, height] = self.size;
        let comparison = self.comparison.as_ref().map(|(path, comparison)| {
            json!({
                "path": path,
                "mse": comparison.mse,
                "relative_mse": comparison.relative_mse,
                "mape": comparison.mape,
                "ssim": comparison.ssim,
                "flip": comparison.flip,
                "relative_mean": comparison.relative_mean,
            })
        });
        json!({
            "scene": self.scene,
            "method": self.method,
            "choice": self.choice.as_ref().map(choice_json),
            "width": width,
            "height": height,
            "spp": self.rendered.samples_per_pixel,
            "max_depth": self.max_depth,
            "seed": self.seed,
            "threads": self.threads,
            "lanes": LaneChoice::best().name(),
            "device": self.device.as_ref().map(|(name, _)| name),
            "pass_seconds": self.device.as_ref().map(|(_, passes)| passes),
            "setup_seconds": self.setup_seconds,
            "reading_seconds": self.reading.seconds,
            "reading_cpu_seconds": self.reading.cpu_seconds,
            "building_seconds": self.building.seconds,
            "building_cpu_seconds": self.building.cpu_seconds,
            "seconds": self.rendered.seconds,
            "cpu_seconds": self.rendered.cpu_seconds,
            "paths_per_second": rate(self.paths(), self.rendered.seconds),
            "paths_per_cpu_second": self.rendered.cpu_seconds.and_then(|seconds| rate(self.paths(), seconds)),
            "rays_per_sample": self.rays_per_sample(),
            "figures": self.figures.iter().map(|&(name, value)| (name.to_owned(), json!(value))).collect::<Value>(),
            "mean_rgb": self.rendered.totals.mean,
            "non_finite_samples": self.rendered.totals.non_finite,
            "interrupted": self.rendered.interrupted,
            "warnings": self.warnings,
            "shard": self.shard.as_ref().map(shard_json),
            "output": self.output,
            "reference": comparison,
        })
    }

    /// A few lines for a reader.
    pub fn text(&self) -> String {
        let ([width, height], spp) = (self.size, self.rendered.samples_per_pixel);
        let mut text = format!(
            "{}: {width}x{height} pixels, {spp} samples each, {}",
            self.scene, self.method
        );
        if let Some(choice) = &self.choice {
            text += &format!(" ({}: {})", choice.method, choice.why);
        }
        text += &format!("\n{:.2} s", self.rendered.seconds);
        if let Some((name, _)) = &self.device {
            text += &format!(" on {name}");
        }
        if let Some(cpu) = self.rendered.cpu_seconds {
            text += &format!(" ({cpu:.2} CPU-seconds)");
        }
        if let Some(rate) = rate(self.paths(), self.rendered.seconds) {
            text += &format!(", {:.3} million paths a second", rate * 1e-6);
        }
        let [r, g, b] = self.rendered.totals.mean;
        text += &format!("\nmean {r:.5} {g:.5} {b:.5}");
        if let Some((path, comparison)) = &self.comparison {
            text += &format!("\nagainst {}:", path.display());
            text += &format!(
                " MSE {:.4e}, relative MSE {:.4e}",
                comparison.mse, comparison.relative_mse
            );
            for (name, value) in [
                ("MAPE", comparison.mape),
                ("SSIM", comparison.ssim),
                ("FLIP", comparison.flip),
            ] {
                if let Some(value) = value {
                    text += &format!(", {name} {value:.4}");
                }
            }
            let deviations = comparison.relative_mean.map(|deviation| match deviation {
                Some(deviation) => format!("{:+.3} %", 100.0 * deviation),
                None => "undefined".to_owned(),
            });
            text += &format!(", mean {}", deviations.join(" "));
        }
        for (name, value) in &self.figures {
            text += &format!("\n{} {value:.4}", name.replace('_', " "));
        }
        if let Some(shard) = &self.shard {
            text += &format!("\n{} of {}", shard.name(), shard.image().samples);
        }
        if let Some(output) = &self.output {
            text += &format!("\nwrote {}", output.display());
        }
        text
    }
}

/// Which part of an image a shard is.
pub fn shard_json(shard: &ShardHeader) -> Value {
    json!({
        "part": shard.part().to_string(),
        "first": shard.first(),
        "end": shard.end(),
        "samples": shard.image().samples,
        "frame": shard.image().frame,
    })
}

/// Paths in a time; `None` in no measurable one.
fn rate(paths: f64, seconds: f64) -> Option<f64> {
    (seconds > 0.0).then(|| paths / seconds)
}
