//! Run time against error of direct light, for each way of choosing an emitter.
//!
//! ```sh
//! LIGHTSHED_SCENES=… LIGHTSHED_REFERENCES=… cargo bench --bench many_lights -- --scene many_lights_1000
//! ```
//!
//! Where there is no reference of direct light at this size, many samples of `open-bvh` are one.
//! `optimal` chooses in proportion to what each emitter would send if nothing were in the way,
//! which takes it far longer than is worth it: a bound of the error, not a method. The last column
//! is the product when the structure is built again for every 8 samples of a pixel, as lights that
//! move ask for.
//!
//! Each method takes the same number of emitter samples in every pixel, spread over camera rays as
//! the table says. Pixels that see an emitter are left out of the error. The product of mean
//! squared error and CPU-seconds does not depend on the number of samples as long as noise is all
//! the error there is: the less, the better the method.

use clap::Parser;
use lightshed::film::{
    Budget, PixelEstimator, RenderOptions, RgbImage, process_cpu_seconds, read_exr, render, render_frames,
    structural_similarity,
};
use lightshed::integrator::{
    CutTree, DirectLight, DirectLightOptions, LightChoosing, LightSelection, LightcutOptions, Lightcuts,
    PathTracer,
};
use lightshed::sampling::CounterRng;
use lightshed::scene::glam::Vec2;
use lightshed::scene::{EmitterSample, Rgb, Scene, SurfacePoint, import, luminance};
use std::fmt;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

#[derive(Parser)]
struct Options {
    /// Folder of the scene in LIGHTSHED_SCENES.
    #[arg(long, default_value = "many_lights_1000")]
    scene: String,
    /// Image size.
    #[arg(long, default_value = "256x256")]
    size: String,
    /// Emitter samples in every pixel.
    #[arg(long, default_value_t = 64)]
    samples: u32,
    /// Emitter samples at each camera ray's hit.
    #[arg(long, value_delimiter = ',', default_value = "1,4,16")]
    per_hit: Vec<u32>,
    /// Parts of a pixel along each side.
    #[arg(long, value_delimiter = ',', default_value = "1,4")]
    strata: Vec<u32>,
    /// Turns of each method.
    #[arg(long, default_value_t = 3)]
    repeats: u64,
    /// Samples a pixel of a reference that has to be made.
    #[arg(long, default_value_t = 16384)]
    reference: u32,
    /// Methods, all if none is named.
    #[arg(long, value_delimiter = ',')]
    lights: Vec<String>,
    /// Given by cargo; of no meaning here.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = Options::parse();
    let folder = |name| std::env::var_os(name).map(PathBuf::from);
    let (Some(scenes), Some(references)) = (folder("LIGHTSHED_SCENES"), folder("LIGHTSHED_REFERENCES"))
    else {
        println!("SKIPPED: LIGHTSHED_SCENES or LIGHTSHED_REFERENCES is not set");
        return Ok(());
    };
    let (width, height) = options
        .size
        .split_once('x')
        .ok_or("a size is of the form 256x256")?;
    let (width, height) = (width.parse()?, height.parse()?);
    let mut description = import::load(scenes.join(&options.scene).join("scene.xml"), &[])?.description;
    (description.settings.width, description.settings.height) = (width, height);
    let scene = Scene::new(&description)?;
    let file = references.join(format!("{}_d2.exr", options.scene));
    let found = file.exists().then(|| read_exr(file)).transpose()?;
    let found = found.filter(|image| (image.width(), image.height()) == (width, height));
    let reference = match found {
        Some(image) => image,
        None => {
            let selection = LightSelection::new(&scene, LightChoosing::OpenBvh)?;
            let estimator = DirectLight::new(
                &scene,
                selection,
                DirectLightOptions {
                    emitter_samples: 8,
                    bsdf_samples: 1,
                    bsdf_samples_where_diffuse: false,
                    camera_strata: 4,
                },
            )?;
            measure(&estimator, width, height, options.reference.div_ceil(128), 4242)?.0
        }
    };
    let mask = references.join(format!("{}_d2_emitters.exr", options.scene));
    let mask = mask.exists().then(|| read_exr(mask)).transpose()?;
    let mask = mask.filter(|image| (image.width(), image.height()) == (width, height));
    let sees_emitter = match mask {
        Some(mask) => mask,
        None => {
            measure(
                &PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), 1),
                width,
                height,
                512,
                1000,
            )?
            .0
        }
    };
    let error = |image: &RgbImage| -> Result<Error, Box<dyn std::error::Error>> {
        Ok(Error {
            squared: masked_error(image, &reference, &sees_emitter),
            similarity: structural_similarity(image, &reference)?,
        })
    };

    let wanted = |name: &str| options.lights.is_empty() || options.lights.iter().any(|l| l == name);
    let mut entries: Vec<Entry> = Vec::new();
    if wanted("default") {
        entries.push(Entry::new("default", options.samples, 1, |turn| {
            let (image, seconds) = measure(
                &DirectLight::new(&scene, scene.emitters_by_power(), DirectLightOptions::default()).unwrap(),
                width,
                height,
                options.samples,
                turn,
            )?;
            Ok((error(&image)?, seconds, 0.0))
        }));
    }
    if wanted("optimal") {
        entries.push(Entry::new("optimal", options.samples, 1, |turn| {
            let (image, seconds) = measure(&Optimal::new(&scene), width, height, options.samples, turn)?;
            Ok((error(&image)?, seconds, 0.0))
        }));
    }
    for tree in [
        CutTree::Perfect,
        CutTree::CurveBvh,
        CutTree::Bvh,
        CutTree::AgglomerativeBvh,
    ] {
        for (subtrees, interleaving) in [(8, 1), (16, 1), (32, 2)] {
            if !wanted("lightcuts") {
                break;
            }
            let settings = LightcutOptions {
                subtrees,
                interleaving,
                tree,
                ..LightcutOptions::default()
            };
            let each = subtrees / (interleaving * interleaving);
            let frames = options.samples.div_ceil(each);
            let name = format!("lightcuts {tree:?} {subtrees}/{}", interleaving * interleaving);
            let (scene, error) = (&scene, &error);
            entries.push(Entry::new(name, frames, each, move |turn| {
                let build = process_cpu_seconds().unwrap_or(f64::NAN);
                let mut method = Lightcuts::new(scene, settings)?;
                let build = process_cpu_seconds().unwrap_or(f64::NAN) - build;
                let options = RenderOptions {
                    seed: turn,
                    threads: 1,
                    ..RenderOptions::new(width, height, Budget::Samples(frames))
                };
                let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false))?;
                let seconds = outcome.cpu_seconds.unwrap_or(outcome.seconds);
                Ok((error(&outcome.film.mean_image())?, seconds, build))
            }));
        }
    }
    for choosing in LightChoosing::ALL.into_iter().filter(|c| wanted(c.name())) {
        for (&each, &strata) in options
            .per_hit
            .iter()
            .flat_map(|e| options.strata.iter().map(move |s| (e, s)))
        {
            let hits = options.samples.div_ceil(each);
            if strata * strata > hits {
                continue;
            }
            let name = format!("{} {strata}x{strata}", choosing.name());
            let (scene, error) = (&scene, &error);
            entries.push(Entry::new(name, hits, each, move |turn| {
                let build = process_cpu_seconds().unwrap_or(f64::NAN);
                let selection = LightSelection::trained(scene, choosing)?;
                let build = process_cpu_seconds().unwrap_or(f64::NAN) - build;
                let estimator = DirectLight::new(
                    scene,
                    selection,
                    DirectLightOptions {
                        emitter_samples: each,
                        bsdf_samples: 1,
                        bsdf_samples_where_diffuse: false,
                        camera_strata: strata,
                    },
                )?;
                let samples = hits / (strata * strata);
                let (image, seconds) = measure(&estimator, width, height, samples, turn)?;
                Ok((error(&image)?, seconds, build))
            }));
        }
    }
    // One turn of each after the other, so that a busy machine treats all alike.
    for turn in 0..options.repeats {
        for entry in &mut entries {
            entry.take_turn(turn)?;
        }
    }
    println!(
        "{}, {width}x{height}, {} emitter samples a pixel",
        options.scene, options.samples
    );
    println!(
        "{:<28} {:>8} {:>6} {:>10} {:>6} {:>9} {:>9} {:>10} {:>10}",
        "lights", "hits", "each", "MSE", "SSIM", "CPU s", "build s", "product", "moving"
    );
    for entry in &entries {
        println!("{entry}");
    }
    Ok(())
}

/// What a turn gives: how far the image is from the reference, CPU-seconds, and those of building.
type Turn = Result<(Error, f64, f64), Box<dyn std::error::Error>>;

/// A method in the race.
struct Entry<'a> {
    name: String,
    hits: u32,
    each: u32,
    run: Box<dyn Fn(u64) -> Turn + 'a>,
    turns: u64,
    squared: f64,
    similarity: f64,
    seconds: f64,
    build: f64,
}

impl<'a> Entry<'a> {
    fn new(name: impl Into<String>, hits: u32, each: u32, run: impl Fn(u64) -> Turn + 'a) -> Self {
        Self {
            name: name.into(),
            hits,
            each,
            run: Box::new(run),
            turns: 0,
            squared: 0.0,
            similarity: 0.0,
            seconds: f64::INFINITY,
            build: f64::INFINITY,
        }
    }

    fn take_turn(&mut self, turn: u64) -> Result<(), Box<dyn std::error::Error>> {
        let (error, seconds, build) = (self.run)(turn)?;
        self.turns += 1;
        self.squared += error.squared;
        self.similarity += error.similarity;
        // What other processes take is never to a method's credit.
        self.seconds = self.seconds.min(seconds);
        self.build = self.build.min(build);
        Ok(())
    }
}

impl fmt::Display for Entry<'_> {
    /// Means over turns.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            hits,
            each,
            seconds,
            build,
            ..
        } = self;
        let error = self.squared / self.turns as f64;
        let similarity = self.similarity / self.turns as f64;
        let frames = f64::from(hits * each) / 8.0;
        write!(
            f,
            "{name:<28} {hits:>8} {each:>6} {error:>10.3e} {similarity:>6.3} {seconds:>9.3} {build:>9.4} {:>10.3e} {:>10.3e}",
            error * (seconds + build),
            error * (seconds + frames * build)
        )
    }
}

/// How far an image is from the reference.
struct Error {
    /// Mean squared error of pixels that see no emitter.
    squared: f64,
    /// SSIM of the whole image.
    similarity: f64,
}

/// The mean image of `samples` a pixel, and CPU-seconds.
fn measure<E: PixelEstimator>(
    estimator: &E,
    width: u32,
    height: u32,
    samples: u32,
    seed: u64,
) -> Result<(RgbImage, f64), Box<dyn std::error::Error>> {
    let options = RenderOptions {
        seed,
        threads: 1,
        ..RenderOptions::new(width, height, Budget::Samples(samples))
    };
    let outcome = render(estimator, &options, &|_| (), &AtomicBool::new(false))?;
    Ok((
        outcome.film.mean_image(),
        outcome.cpu_seconds.unwrap_or(outcome.seconds),
    ))
}

/// Chooses among all finite emitters in proportion to what the middle of each would send to the
/// point, unshadowed.
struct Optimal<'a> {
    scene: &'a Scene,
}

impl<'a> Optimal<'a> {
    fn new(scene: &'a Scene) -> Self {
        Self { scene }
    }
}

impl PixelEstimator for Optimal<'_> {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let (scene, emitters) = (self.scene, self.scene.emitters());
        let mut rng = CounterRng::new(seed, y << 16 | x, sample_index);
        let place = Vec2::new(x as f32, y as f32) + Vec2::from(rng.next_2d());
        let ray = scene.camera().ray(place, [0.5; 2]);
        let Some(point) = scene.intersect(&ray) else {
            return Rgb::ZERO;
        };
        let mut value = match point.emitter {
            SurfacePoint::NO_EMITTER => Rgb::ZERO,
            _ => emitters.radiance(&point, ray.direction),
        };
        let bsdf = scene.bsdf(&point);
        let wo = point.shading.to_local(-ray.direction);
        let scattered = |direction| bsdf.evaluate(wo, point.shading.to_local(direction)).value;
        let sends = |index: u32| {
            let sample = emitters.sample_on(point.position, index, [1.0 / 3.0; 2]);
            let bright = |s: EmitterSample| luminance(s.weight * scattered(s.direction));
            f64::from(sample.map_or(0.0, bright))
        };
        let weights: Vec<f64> = (0..emitters.finite_count() as u32).map(sends).collect();
        let sum: f64 = weights.iter().sum();
        // What only a part of an emitter sends is not lost.
        let floor = 1e-3 * sum.max(1e-12) / weights.len().max(1) as f64;
        let total = sum + floor * weights.len() as f64;
        let (mut u, mut chosen) = (f64::from(rng.next_f32()) * total, 0);
        while chosen + 1 < weights.len() && u >= weights[chosen] + floor {
            u -= weights[chosen] + floor;
            chosen += 1;
        }
        let probability = ((weights[chosen] + floor) / total) as f32;
        let u = rng.next_2d();
        if let Some(sample) = emitters.sample_on(point.position, chosen as u32, u)
            && let Some(sample) = sample.chosen_with(probability)
            && !scene.occluded(&sample.shadow_ray(&point))
        {
            value += scattered(sample.direction) * sample.weight;
        }
        value
    }
}

/// Mean squared error over channels of the pixels where `mask` is black.
fn masked_error(image: &RgbImage, reference: &RgbImage, mask: &RgbImage) -> f64 {
    let (mut sum, mut count) = (0.0, 0u32);
    for y in 0..image.height() {
        for x in 0..image.width() {
            let (Some(a), Some(b)) = (image.get(x, y), reference.get(x, y)) else {
                continue;
            };
            if mask.get(x, y) != Some([0.0; 3]) {
                continue;
            }
            for channel in 0..3 {
                sum += (f64::from(a[channel]) - f64::from(b[channel])).powi(2);
                count += 1;
            }
        }
    }
    sum / f64::from(count.max(1))
}
