//! Path tracing of direct light with emitters chosen by a light BVH and by a light cache, at equal
//! CPU time with training.
//!
//! ```sh
//! LIGHTSHED_SCENES=… cargo bench --bench light_cache -- --scenes warehouse,oacmpctf3
//! ```
//!
//! Samples are independent once the cache is trained, so a mean of n samples has an MSE of
//! `σ²/n`, with `σ²` the variance of a sample: no reference is needed. In `T` CPU-seconds, of
//! which training takes `t` and a sample of every pixel `c`, it is `σ² c / (T − t)`. The gain
//! is the ratio of two of these. Emitters in view and the pixels beside them are left out, and left
//! in in the last column. Methods take turns.

use clap::Parser;
use lightshed::film::{Budget, Film, PixelEstimator, RenderOptions, RgbImage, process_cpu_seconds, render};
use lightshed::integrator::{LightChoosing, LightSelection, PathTracer};
use lightshed::scene::{
    FloatTexture, Material, Microfacet, Rgb, Roughness, Scene, SceneDescription, builtin, import,
};
use std::error::Error;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

#[derive(Parser)]
struct Options {
    /// Built-in scenes, or folders in LIGHTSHED_SCENES.
    #[arg(long, value_delimiter = ',', default_value = "warehouse,many-lights")]
    scenes: Vec<String>,
    /// Side of the image in pixels.
    #[arg(long, default_value_t = 256)]
    size: u32,
    /// Samples a pixel from which variances are taken.
    #[arg(long, default_value_t = 64)]
    samples: u32,
    /// CPU-seconds that each method has.
    #[arg(long, default_value_t = 30.0)]
    seconds: f64,
    /// Ways of choosing; the first is what the others are compared with.
    #[arg(long, value_delimiter = ',', default_value = "bvh,power,open-bvh,vlc")]
    lights: Vec<LightChoosing>,
    /// Gives all diffuse surfaces a coat of this roughness `α`.
    #[arg(long)]
    plastic: Option<f32>,
    /// Makes all diffuse surfaces metal of this roughness `α`.
    #[arg(long)]
    metal: Option<f32>,
    /// Given by cargo; of no meaning here.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Turns of each method.
const TURNS: u64 = 4;

/// What was found of a method.
#[derive(Default)]
struct Found {
    film: Option<Film>,
    /// CPU-seconds of training, and of a sample of every pixel.
    training: f64,
    sample: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    println!(
        "{:<18} {:<10} {:>10} {:>10} {:>9} {:>7} {:>9}",
        "scene", "lights", "variance", "s/sample", "training", "gain", "all pixels"
    );
    for name in &options.scenes {
        let Some(mut description) = load(name)? else {
            println!("{name}: SKIPPED, LIGHTSHED_SCENES is not set");
            continue;
        };
        (description.settings.width, description.settings.height) = (options.size, options.size);
        description.settings.max_depth = Some(2);
        for material in &mut description.materials {
            polish(material, &options);
        }
        let scene = Scene::new(&description)?;
        let seen = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), 1);
        let seen = run(&seen, options.size, 256, 1000)?.0.mean_image();
        let mut found: Vec<Found> = options.lights.iter().map(|_| Found::default()).collect();
        for turn in 0..TURNS {
            for (&choosing, found) in options.lights.iter().zip(&mut found) {
                take_turn(&scene, choosing, &options, turn, found)?;
            }
        }
        let mut base = None;
        for (choosing, found) in options.lights.iter().zip(&found) {
            let film = found.film.as_ref().ok_or("no turn was taken")?;
            let variances = film.variance_of_mean().ok_or("too few samples")?;
            let [few, all] = [Some(&seen), None].map(|seen| mean_variance(&variances, seen));
            let samples = (options.seconds - found.training) / found.sample;
            let errors = [few, all].map(|variance| variance * film_samples(&options) / samples);
            let [first, first_of_all] = *base.get_or_insert(errors);
            println!(
                "{name:<18} {:<10} {:>10.3e} {:>10.4} {:>9.3} {:>7.2} {:>9.2}",
                choosing.name(),
                few * film_samples(&options),
                found.sample,
                found.training,
                first / errors[0],
                first_of_all / errors[1],
            );
        }
    }
    Ok(())
}

fn film_samples(options: &Options) -> f64 {
    f64::from(options.samples.div_ceil(TURNS as u32)) * TURNS as f64
}

fn load(name: &str) -> Result<Option<SceneDescription>, Box<dyn Error>> {
    if let Some(description) = builtin::by_name(name) {
        return Ok(Some(description));
    }
    let Some(folder) = std::env::var_os("LIGHTSHED_SCENES").map(PathBuf::from) else {
        return Ok(None);
    };
    Ok(Some(
        import::load(folder.join(name).join("scene.xml"), &[])?.description,
    ))
}

/// Makes a diffuse surface glossy.
fn polish(material: &mut Material, options: &Options) {
    match material {
        Material::TwoSided { front, .. } => polish(front, options),
        Material::Diffuse { reflectance } => {
            let reflectance = reflectance.clone();
            if let Some(alpha) = options.metal {
                *material = Material::MetallicRoughness {
                    base_color: reflectance,
                    metallic: FloatTexture::Constant(1.0),
                    roughness: FloatTexture::Constant(alpha.sqrt()),
                    transmission: FloatTexture::Constant(0.0),
                    ior: 1.5,
                };
            } else if let Some(alpha) = options.plastic {
                *material = Material::Plastic {
                    eta: 1.5,
                    diffuse_reflectance: reflectance,
                    specular_reflectance: Rgb::ONE.into(),
                    nonlinear: false,
                    roughness: Some(Roughness {
                        distribution: Microfacet::Ggx,
                        alpha_u: FloatTexture::Constant(alpha),
                        alpha_v: FloatTexture::Constant(alpha),
                    }),
                };
            }
        }
        _ => {}
    }
}

fn take_turn(
    scene: &Scene,
    choosing: LightChoosing,
    options: &Options,
    turn: u64,
    found: &mut Found,
) -> Result<(), Box<dyn Error>> {
    let clock = || process_cpu_seconds().unwrap_or(f64::NAN);
    let before = clock();
    let selection = LightSelection::trained(scene, choosing)?;
    let training = clock() - before;
    let samples = options.samples.div_ceil(TURNS as u32);
    let tracer = PathTracer::new(scene, &selection).with_depths(Some(2), 1000);
    let (film, seconds) = run(&tracer, options.size, samples, turn)?;
    let sample = seconds / f64::from(samples);
    // What other processes take is to no method's credit or blame.
    let least = |old: f64, new: f64| if turn == 0 { new } else { old.min(new) };
    found.training = least(found.training, training);
    found.sample = least(found.sample, sample);
    match &mut found.film {
        Some(all) => all.merge(&film)?,
        none => *none = Some(film),
    }
    Ok(())
}

/// Mean over channels and pixels of the variances of means; without pixels of `seen` that are not
/// black, and those beside them.
fn mean_variance(variances: &RgbImage, seen: Option<&RgbImage>) -> f64 {
    let (width, height) = (variances.width(), variances.height());
    let is_dark = |x: u32, y: u32| {
        let near = |at: u32, size: u32| at.saturating_sub(1)..(at + 2).min(size);
        seen.is_none_or(|seen| {
            near(y, height).all(|y| near(x, width).all(|x| seen.get(x, y) == Some([0.0; 3])))
        })
    };
    let (mut sum, mut count) = (0.0, 0.0);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        if is_dark(x, y) {
            sum += variances
                .get(x, y)
                .map_or(0.0, |v| v.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0);
            count += 1.0;
        }
    }
    sum / f64::max(count, 1.0)
}

fn run(
    estimator: &dyn PixelEstimator,
    size: u32,
    samples: u32,
    seed: u64,
) -> Result<(Film, f64), Box<dyn Error>> {
    let options = RenderOptions {
        seed,
        threads: 1,
        ..RenderOptions::new(size, size, Budget::Samples(samples))
    };
    let outcome = render(&estimator, &options, &|_| (), &AtomicBool::new(false))?;
    Ok((outcome.film, outcome.cpu_seconds.unwrap_or(outcome.seconds)))
}
