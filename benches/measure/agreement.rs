//! Whether volumetric reuse has the expectation of path tracing through media: means of images and
//! of their tiles, with standard errors that independent images tell.
//!
//! Pixels of a chain of frames are correlated, and so are its frames; chains of different seeds are
//! not. Each chain is therefore *one* value of every mean, and so is each image of path tracing.
//! CPU time goes to the case that is known least, and in it to the method by which a second lessens
//! the variance of the difference most.

use clap::ValueEnum;
use lightshed::film::{Budget, FrameMethod, RenderOptions, process_cpu_seconds, render};
use lightshed::integrator::{CameraMotion, RestirVolume, RestirVolumeOptions, VolumePathTracer};
use lightshed::scene::{PhaseDescription, Rgb, Scene, SceneDescription, builtin, luminance};
use lightshed::testkit::MeanTest;
use serde_json::{Value, json};
use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Which options of reuse are compared.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Reuse {
    /// What suits the scene.
    Usual,
    /// Reservoirs of a pixel without neighbours.
    Reservoirs,
    /// One reservoir, and neighbours.
    Neighbours,
}

/// What is compared and how well.
pub struct Agreement<'a> {
    /// Standard error of a mean's relative difference in any channel, in percent, at which a case
    /// is done.
    pub precision: f64,
    /// CPU time for all cases together.
    pub seconds: f64,
    pub reuse: Reuse,
    /// Only cases whose name contains this.
    pub only: &'a str,
    /// Where figures go as JSON as well.
    pub json: Option<&'a Path>,
}

/// Frames of a chain, and before those that count. What reuse does wrong in a frame it does again
/// in every later one.
const FRAMES: u32 = 12;
const WARM_UP: u32 = 6;

/// Least length of connected edges in pixels, which here are as wide as ten of a usual image.
const CONNECTION_PIXELS: f32 = 1.5;

/// Samples a pixel of one image of path tracing.
const SAMPLES: u32 = 32;

/// Edge of a tile in pixels.
const TILE: usize = 8;

/// CPU time of a case's turn.
const TURN_SECONDS: f64 = 4.0;

/// Three channels and luminance.
const CHANNELS: usize = 4;

/// Means of tiles and, last, of the whole, over images; and what the images cost.
struct Images {
    parts: Vec<[MeanTest; CHANNELS]>,
    seconds: f64,
}

impl Images {
    fn new(size: [u32; 2]) -> Self {
        Self {
            parts: vec![[MeanTest::new(); CHANNELS]; tiles(size) + 1],
            seconds: 0.0,
        }
    }

    fn push(&mut self, [width, height]: [u32; 2], image: &[Rgb]) {
        let whole = self.parts.len() - 1;
        let mut sums = vec![([0.0; CHANNELS], 0.0); whole + 1];
        let (width, height) = (width as usize, height as usize);
        for (index, value) in image.iter().enumerate().take(width * height) {
            let tile = index / width / TILE * width.div_ceil(TILE) + index % width / TILE;
            let [r, g, b] = value.to_array();
            for part in [tile, whole] {
                let (sums, count) = &mut sums[part];
                *count += 1.0;
                for (sum, value) in sums.iter_mut().zip([r, g, b, luminance(*value)]) {
                    *sum += f64::from(value);
                }
            }
        }
        for (part, (sums, count)) in self.parts.iter_mut().zip(sums) {
            for (mean, sum) in part.iter_mut().zip(sums) {
                mean.push(sum / count);
            }
        }
    }

    fn whole(&self) -> &[MeanTest; CHANNELS] {
        &self.parts[self.parts.len() - 1]
    }

    fn count(&self) -> u64 {
        self.whole()[0].count()
    }

    /// What a second more lessens the variance of the mean by; infinite as long as that is not
    /// known.
    fn worth(&self) -> f64 {
        let count = self.count();
        if count < 20 {
            return 1.0 / count as f64 * f64::MAX;
        }
        let variance: f64 = self
            .whole()
            .iter()
            .map(|mean| mean.standard_error().powi(2))
            .sum();
        variance / self.seconds
    }
}

fn tiles([width, height]: [u32; 2]) -> usize {
    (width as usize).div_ceil(TILE) * (height as usize).div_ceil(TILE)
}

struct Case<'a> {
    name: &'a str,
    scene: &'a Scene,
    scatterings: u32,
    method: RestirVolume<'a>,
    reused: Images,
    traced: Images,
}

/// A relative difference in percent.
struct Difference {
    percent: f64,
    standard_error: f64,
}

impl<'a> Case<'a> {
    fn new(name: &'a str, scene: &'a Scene, scatterings: u32, reuse: Reuse) -> Result<Self, Box<dyn Error>> {
        let usual = RestirVolumeOptions::of_scene(scene, Some(scatterings + 1));
        let mut options = match reuse {
            Reuse::Usual => usual,
            Reuse::Reservoirs => RestirVolumeOptions::new(scatterings),
            Reuse::Neighbours => RestirVolumeOptions::new(scatterings).with_neighbours(),
        };
        (options.radius_pixels, options.connection_pixels) = (usual.radius_pixels, CONNECTION_PIXELS);
        let size = [scene.settings().width, scene.settings().height];
        Ok(Self {
            name,
            scene,
            scatterings,
            method: RestirVolume::new(scene, options, CameraMotion::STILL)?,
            reused: Images::new(size),
            traced: Images::new(size),
        })
    }

    fn size(&self) -> [u32; 2] {
        [self.scene.settings().width, self.scene.settings().height]
    }

    /// The mean of the frames of one more chain; the first forgets the chain before.
    fn chain(&mut self) -> Result<(), Box<dyn Error>> {
        let started = cpu_seconds()?;
        let size = self.size();
        let pixels = size[0] as usize * size[1] as usize;
        let (mut frame_image, mut mean) = (vec![Rgb::ZERO; pixels], vec![Rgb::ZERO; pixels]);
        for frame in 0..FRAMES {
            self.method
                .render_frame(
                    frame,
                    self.reused.count(),
                    &mut frame_image,
                    &AtomicBool::new(false),
                )
                .ok_or("cancelled")?;
            if frame >= WARM_UP {
                for (mean, &value) in mean.iter_mut().zip(&frame_image) {
                    *mean += value / (FRAMES - WARM_UP) as f32;
                }
            }
        }
        self.reused.push(size, &mean);
        self.reused.seconds += cpu_seconds()? - started;
        Ok(())
    }

    /// One more image of path tracing.
    fn trace(&mut self) -> Result<(), Box<dyn Error>> {
        let started = cpu_seconds()?;
        let size = self.size();
        let tracer = VolumePathTracer::new(self.scene, self.scene.emitters_by_power())
            .with_depths(Some(self.scatterings + 1), u32::MAX);
        let options = RenderOptions {
            seed: (1 << 40) + self.traced.count(),
            threads: 1,
            ..RenderOptions::new(size[0], size[1], Budget::Samples(SAMPLES))
        };
        let film = render(&tracer, &options, &|_| (), &AtomicBool::new(false))?
            .film
            .mean_image();
        let image: Vec<Rgb> = (0..size[0] * size[1])
            .map(|index| Rgb::from(film.get(index % size[0], index / size[0]).unwrap_or_default()))
            .collect();
        self.traced.push(size, &image);
        self.traced.seconds += cpu_seconds()? - started;
        Ok(())
    }

    /// Works for a turn.
    fn turn(&mut self) -> Result<(), Box<dyn Error>> {
        let started = self.seconds();
        while self.seconds() - started < TURN_SECONDS {
            if self.reused.worth() > self.traced.worth() {
                self.chain()?;
            } else {
                self.trace()?;
            }
        }
        Ok(())
    }

    fn seconds(&self) -> f64 {
        self.reused.seconds + self.traced.seconds
    }

    /// By channel, and of luminance.
    fn differences(&self) -> [Difference; CHANNELS] {
        core::array::from_fn(|channel| {
            let (ours, truth) = (&self.reused.whole()[channel], &self.traced.whole()[channel]);
            Difference {
                percent: 100.0 * (ours.mean() / truth.mean() - 1.0),
                standard_error: 100.0 * ours.standard_error().hypot(truth.standard_error()) / truth.mean(),
            }
        })
    }

    fn error(&self) -> f64 {
        if self.reused.count().min(self.traced.count()) < 20 {
            return f64::INFINITY;
        }
        self.differences()
            .iter()
            .map(|d| d.standard_error)
            .fold(0.0, f64::max)
    }

    /// Scores of the tiles by channel.
    fn tile_scores(&self) -> Vec<f64> {
        let mut scores = Vec::new();
        for tile in 0..tiles(self.size()) {
            for (ours, truth) in self.reused.parts[tile]
                .iter()
                .zip(&self.traced.parts[tile])
                .take(3)
            {
                let error = ours.standard_error().hypot(truth.standard_error());
                let difference = ours.mean() - truth.mean();
                // Where nothing but a constant is seen, both are it up to rounding.
                let rounding = 1e-5 * truth.mean().abs();
                scores.push(if difference.abs() <= rounding {
                    0.0
                } else {
                    difference / error
                });
            }
        }
        scores
    }

    fn figures(&self) -> Value {
        let differences = self.differences();
        let of = |value: fn(&Difference) -> f64| differences.iter().map(value).collect::<Vec<_>>();
        json!({
            "case": self.name,
            "percent": of(|d| d.percent),
            "standard_error": of(|d| d.standard_error),
            "tile_scores": self.tile_scores(),
            "chains": self.reused.count(),
            "images": self.traced.count(),
            "seconds": [self.reused.seconds, self.traced.seconds],
        })
    }

    fn line(&self) -> String {
        let scores = self.tile_scores();
        let worst = scores.iter().fold(0.0f64, |worst, score| worst.max(score.abs()));
        let mean_square = scores.iter().map(|score| score * score).sum::<f64>() / scores.len() as f64;
        let [r, g, b, y] = self
            .differences()
            .map(|d| format!("{:+.3} ± {:.3}", d.percent, d.standard_error));
        format!(
            "{:<30} | {r} | {g} | {b} | {y} | {worst:.1} ({mean_square:.2}) | {} | {}",
            self.name,
            self.reused.count(),
            self.traced.count()
        )
    }
}

fn cpu_seconds() -> Result<f64, Box<dyn Error>> {
    Ok(process_cpu_seconds().ok_or("this platform does not tell a process its CPU time")?)
}

/// A scene in small, from near enough that little but the medium is in view.
fn near(mut description: SceneDescription, fov_x: f32) -> SceneDescription {
    (description.settings.width, description.settings.height) = (24, 16);
    description.camera.fov_x = fov_x;
    description
}

/// The matrix: scenes by asymmetry by scattering vertices.
pub fn agree(what: &Agreement<'_>, disney: Option<SceneDescription>) -> Result<(), Box<dyn Error>> {
    let mut scenes = vec![
        ("fire", near(builtin::fire(), 0.35)),
        ("smoke-in-cornell", near(builtin::smoke_in_cornell(), 0.4)),
        ("cloud", near(builtin::cloud(), 0.45)),
    ];
    match disney {
        Some(scene) => scenes.push(("disney_cloud", near(scene, 0.45))),
        None => println!("disney_cloud SKIPPED: set LIGHTSHED_SCENES to the folder with the scene"),
    }
    let mut names = Vec::new();
    for (name, description) in scenes {
        for g in [0.0, 0.8] {
            let mut description = description.clone();
            description.media[0].phase = PhaseDescription::HenyeyGreenstein { g };
            for scatterings in [1, 3, 7] {
                let name = format!("{name}, g = {g}, K = {scatterings}");
                if name.contains(what.only) {
                    names.push((name, Scene::new(&description)?, scatterings));
                }
            }
        }
    }
    let cases: Result<Vec<Case<'_>>, _> = names
        .iter()
        .map(|(name, scene, scatterings)| Case::new(name, scene, *scatterings, what.reuse))
        .collect();
    let mut cases = cases?;
    let mut turns = 0;
    loop {
        let unknown = cases.iter_mut().filter(|case| !(case.error() <= what.precision));
        let Some(case) = unknown.max_by(|a, b| a.error().total_cmp(&b.error())) else {
            break;
        };
        if case.error() == f64::INFINITY {
            while case.error() == f64::INFINITY {
                case.chain()?;
                case.trace()?;
            }
        } else {
            case.turn()?;
        }
        turns += 1;
        let spent: f64 = cases.iter().map(Case::seconds).sum();
        if turns % 8 == 0 {
            eprintln!("{spent:.0} s");
            write_json(what, &cases)?;
        }
        if spent > what.seconds {
            break;
        }
    }
    write_json(what, &cases)?;
    println!("case | R, % | G | B | luminance | worst tile's score (mean square) | chains | images");
    for case in cases.iter().filter(|case| case.error().is_finite()) {
        println!("{}", case.line());
    }
    Ok(())
}

fn write_json(what: &Agreement<'_>, cases: &[Case<'_>]) -> Result<(), Box<dyn Error>> {
    if let Some(path) = what.json {
        let figures: Vec<Value> = cases
            .iter()
            .filter(|case| case.error().is_finite())
            .map(Case::figures)
            .collect();
        std::fs::write(path, serde_json::to_string_pretty(&figures)?)?;
    }
    Ok(())
}
