//! What there is to say, as text or as JSON.

use lightshed::film::{Film, ImageKey, MissingSamples, ShardPart, ShardSet};
use serde_json::{Value, json};
use std::path::Path;

/// An image that has been merged and written.
pub struct Merged<'a> {
    set: &'a ShardSet,
    film: &'a Film,
    path: &'a Path,
}

impl<'a> Merged<'a> {
    pub fn new(set: &'a ShardSet, film: &'a Film, path: &'a Path) -> Self {
        Self { set, film, path }
    }

    pub fn text(&self, as_json: bool) -> String {
        let (files, samples) = (self.set.files().len(), self.set.samples());
        let missing = self.set.missing();
        let mean = self.film.mean_image().mean();
        if as_json {
            return json!({
                "image": key_json(self.set.image()),
                "shards": files,
                "samples": samples,
                "missing": missing.as_ref().map(missing_json),
                "mean_rgb": mean,
                "non_finite_samples": self.film.non_finite(),
                "output": self.path,
            })
            .to_string();
        }
        let mut text = format!("{}: {files} shards, {samples} samples", named(self.set.image()));
        if let Some(missing) = missing {
            text += &format!("; {missing}");
        }
        let non_finite = self.film.non_finite();
        if non_finite > 0 {
            text += &format!("; {non_finite} samples were not finite and were left out");
        }
        text + &format!(
            "\nmean {:.5} {:.5} {:.5}\nwrote {}",
            mean[0],
            mean[1],
            mean[2],
            self.path.display()
        )
    }
}

/// What is there of each image.
pub fn status<'a>(sets: impl Iterator<Item = &'a ShardSet>, as_json: bool) -> String {
    let rows: Vec<(Value, String)> = sets
        .map(|set| {
            let (image, files, samples) = (set.image(), set.files().len(), set.samples());
            let missing = set.missing();
            let value = json!({
                "image": key_json(image),
                "shards": files,
                "samples": samples,
                "missing": missing.as_ref().map(missing_json),
            });
            let percent = 100.0 * f64::from(samples) / f64::from(image.samples);
            let rest = missing.map_or("complete".to_owned(), |missing| missing.to_string());
            let text = format!(
                "{}: {files} shards, {samples} of {} samples ({percent:.0} %), {rest}",
                named(image),
                image.samples
            );
            (value, text)
        })
        .collect();
    match as_json {
        true => Value::Array(rows.into_iter().map(|(value, _)| value).collect()).to_string(),
        false => rows
            .into_iter()
            .map(|(_, text)| text)
            .collect::<Vec<_>>()
            .join("\n"),
    }
}

fn named(image: &ImageKey) -> String {
    let frame = image
        .frame
        .map_or(String::new(), |frame| format!(", frame {frame}"));
    format!("{} by {}, seed {}{frame}", image.scene, image.method, image.seed)
}

fn key_json(image: &ImageKey) -> Value {
    json!({
        "scene": image.scene,
        "scene_hash": format!("{:016x}", image.scene_hash),
        "method": image.method,
        "options": image.options,
        "seed": image.seed,
        "independent": image.independent,
        "frame": image.frame,
        "samples": image.samples,
        "size": image.size,
    })
}

fn missing_json(missing: &MissingSamples) -> Value {
    let ranges: Vec<[u32; 2]> = missing
        .samples
        .iter()
        .map(|range| [range.start, range.end])
        .collect();
    let parts: Vec<String> = missing.parts.iter().map(ShardPart::to_string).collect();
    json!({"samples": ranges, "parts": parts})
}
