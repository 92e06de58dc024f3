//! Run time against error of direct light, for each way of choosing an emitter.
//!
//! ```sh
//! LIGHTSHED_SCENES=… LIGHTSHED_REFERENCES=… cargo bench --bench many_lights -- --scene many_lights_1000
//! ```
//!
//! Each method takes the same number of emitter samples in every pixel, spread over camera rays as the table says. Pixels that
//! see an emitter are left out of the error. The product of mean squared error and CPU-seconds does not depend on the number of
//! samples as long as noise is all the error there is: the less, the better the method.

use clap::Parser;
use lightshed::integrator::{
    Budget, DirectLight, LightChoosing, LightSelection, PathTracer, PixelEstimator, RenderOptions, RgbImage,
    SelectedDirectLight, process_cpu_seconds, read_exr, render,
};
use lightshed::scene::{Scene, import};
use std::error::Error;
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
    /// Methods, all if none is named.
    #[arg(long, value_delimiter = ',')]
    lights: Vec<String>,
    /// Given by cargo; of no meaning here.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
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
    let reference = read_exr(references.join(format!("{}_d2.exr", options.scene)))?;
    let mask = references.join(format!("{}_d2_emitters.exr", options.scene));
    let sees_emitter = if mask.exists() {
        read_exr(mask)?
    } else {
        let estimator = PathTracer::with_depths(&scene, Some(1), 1);
        measure(&estimator, width, height, 512, 1000)?.0
    };
    let error = |image: &RgbImage| masked_error(image, &reference, &sees_emitter);

    println!(
        "{}, {width}x{height}, {} emitter samples a pixel",
        options.scene, options.samples
    );
    println!(
        "{:<14} {:>8} {:>6} {:>10} {:>9} {:>10}",
        "lights", "hits", "each", "MSE", "CPU s", "product"
    );
    let wanted = |name: &str| options.lights.is_empty() || options.lights.iter().any(|l| l == name);
    if wanted("default") {
        report("default", options.samples, 1, options.repeats, |turn| {
            let (image, seconds) = measure(&DirectLight::new(&scene), width, height, options.samples, turn)?;
            Ok((error(&image), seconds))
        })?;
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
            report(&name, hits, each, options.repeats, |turn| {
                let build = process_cpu_seconds().unwrap_or(f64::NAN);
                let selection = LightSelection::new(&scene, choosing)?;
                let build = process_cpu_seconds().unwrap_or(f64::NAN) - build;
                let estimator = SelectedDirectLight::new(&scene, selection, each, 1)?;
                let estimator = estimator.with_camera_strata(strata);
                let samples = hits / (strata * strata);
                let (image, seconds) = measure(&estimator, width, height, samples, turn)?;
                Ok((error(&image), build + seconds))
            })?;
        }
    }
    Ok(())
}

/// The mean image of `samples` a pixel, and CPU-seconds.
fn measure<E: PixelEstimator>(
    estimator: &E,
    width: u32,
    height: u32,
    samples: u32,
    seed: u64,
) -> Result<(RgbImage, f64), Box<dyn Error>> {
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

/// Prints the means over turns.
fn report(
    name: &str,
    hits: u32,
    each: u32,
    turns: u64,
    run: impl Fn(u64) -> Result<(f64, f64), Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let (mut error, mut seconds) = (0.0, f64::INFINITY);
    for turn in 0..turns {
        let (e, s) = run(turn)?;
        error += e / turns as f64;
        // What other processes take is never to the method's credit.
        seconds = s.min(seconds);
    }
    println!(
        "{name:<14} {hits:>8} {each:>6} {error:>10.3e} {seconds:>9.3} {:>10.3e}",
        error * seconds
    );
    Ok(())
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
