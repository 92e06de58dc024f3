//! Media: samples per CPU-second and variance of path tracing, by itself or beside Mitsuba 3's; and
//! error at equal time of reuse against path tracing.
//!
//! ```sh
//! cargo bench --features testkit --bench volumes
//! cargo bench --features testkit --bench volumes -- --compare python3
//! cargo bench --features testkit --bench volumes -- --race
//! cargo bench --features testkit --bench volumes -- --agree
//! ```
//!
//! The second form needs a Python with Mitsuba 3 in it, and the scene `blob_volume` in the folder
//! that the environment variable `LIGHTSHED_SCENES` names. The two renderers take turns, with
//! different seeds and the same number of threads; what counts is CPU-seconds of the process while
//! it renders.
//!
//! The third renders the built-in cloud, and where `LIGHTSHED_SCENES` has it that of Disney at a
//! sixteenth of its resolution, with single frames at the end of a warm-up, each of whose errors is
//! set against that of path tracing with as many samples as take the same CPU time. Errors are
//! measured against two long renderings at once, whose noise so has no share in them.
//!
//! The fourth sets means of `RestirVolume` against those of path tracing, in all scenes, until they
//! are known well.

#[path = "measure/agreement.rs"]
mod agreement;
#[path = "measure/turns.rs"]
mod turns;

use agreement::{Agreement, Reuse, agree};
use clap::Parser;
use lightshed::film::{Budget, FrameMethod, RenderOptions, process_cpu_seconds, render};
use lightshed::integrator::{
    CameraMotion, RestirVolume, RestirVolumeOptions, VolumePathTracer, VolumeTracking,
};
use lightshed::scene::{
    DensityDescription, PhaseDescription, Rgb, Scene, SceneDescription, builtin, import, luminance,
};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use turns::{Spread, Turns, summary};

#[derive(Parser)]
struct Options {
    #[command(flatten)]
    turns: Turns,
    /// Error at equal time instead of samples per CPU-second.
    #[arg(long)]
    race: bool,
    /// Width of the race's images in pixels; a third less high. One ray a pixel and frame wants
    /// pixels smaller than what is seen.
    #[arg(long, default_value_t = 480)]
    width: u32,
    /// Reservoirs of a pixel, if not as usual.
    #[arg(long)]
    reservoirs: Option<u32>,
    /// With this many reservoirs a pixel and no neighbours, whatever suits the scene.
    #[arg(long)]
    alone: Option<u32>,
    /// Most confidence of a pixel's history, in frames, if not as usual.
    #[arg(long)]
    cap: Option<f32>,
    /// Samples a pixel of each of the race's two references.
    #[arg(long, default_value_t = 64)]
    reference: u32,
    /// Means of images by reuse against path tracing instead of samples per CPU-second.
    #[arg(long)]
    agree: bool,
    /// Standard error in percent at which a mean is known well enough.
    #[arg(long, default_value_t = 0.07)]
    precision: f64,
    /// CPU time for all means together.
    #[arg(long, default_value_t = 3600.0)]
    seconds: f64,
    /// Options of reuse whose means are compared.
    #[arg(long, value_enum, default_value_t = Reuse::Usual)]
    reuse: Reuse,
    /// Where the comparison of means goes as JSON as well.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Only cases whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// Given by cargo; of no meaning here.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    if options.agree {
        let what = Agreement {
            precision: options.precision,
            seconds: options.seconds,
            reuse: options.reuse,
            only: &options.only,
            json: options.json.as_deref(),
        };
        agree(&what, disney_cloud()?)
    } else if options.race {
        race(&options)
    } else {
        throughput(&options)
    }
}

fn throughput(options: &Options) -> Result<(), Box<dyn Error>> {
    let folder = std::env::var_os("LIGHTSHED_SCENES").map(PathBuf::from);
    let mut mitsuba = options.turns.start_mitsuba()?;
    println!(
        "M samples per CPU-second, median of {} turns; mean; variance of a sample",
        options.turns.repeats
    );
    for max_depth in [2, 64] {
        let file = folder.as_ref().map(|folder| folder.join("blob_volume/scene.xml"));
        let Some(file) = file.filter(|path| path.is_file()) else {
            println!("blob_volume SKIPPED: set LIGHTSHED_SCENES to the folder with the scene");
            continue;
        };
        let description = import::load(&file, &[])?.description;
        let scene = Scene::new(&description)?;
        let tracer =
            VolumePathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(max_depth), u32::MAX);
        let other = mitsuba.as_mut().map(|mitsuba| (mitsuba, &*file));
        let turns = options.turns.take(&tracer, scene.settings(), max_depth, other)?;
        let [ours, theirs] = &turns;
        println!("blob_volume to depth {max_depth:<2}  lightshed {}", summary(ours));
        if !theirs.is_empty() {
            println!("                         mitsuba   {}", summary(theirs));
            println!("                         ratio     {}", Spread::of_ratios(&turns));
        }
    }
    Ok(())
}

/// Density, asymmetry and scattering vertices of the race.
const DENSITIES: [f32; 3] = [0.2, 1.0, 3.0];
const ASYMMETRIES: [f32; 2] = [0.0, 0.8];
const SCATTERINGS: [u32; 3] = [1, 3, 7];

fn race(options: &Options) -> Result<(), Box<dyn Error>> {
    println!(
        "error of a frame after {WARM_UP} others: CPU time, MSE, and the mean of the frames against the references'; path tracing at the same time: samples and MSE; ratios of MSE, of its \
         luminance, and of means over {BLOCK}×{BLOCK} pixels"
    );
    let mut clouds = vec![("cloud", builtin::cloud())];
    match disney_cloud()? {
        Some(description) => clouds.push(("disney", description)),
        None => println!("disney SKIPPED: set LIGHTSHED_SCENES to the folder with disney_cloud"),
    }
    for (name, cloud) in &clouds {
        for density in DENSITIES {
            for g in ASYMMETRIES {
                for scatterings in SCATTERINGS {
                    let name = format!("{name} x {density}, g = {g}, K = {scatterings}");
                    if !name.contains(&options.only) {
                        continue;
                    }
                    let mut description = cloud.clone();
                    (description.settings.width, description.settings.height) =
                        (options.width, options.width * 2 / 3);
                    description.media[0].extinction *= density;
                    description.media[0].phase = PhaseDescription::HenyeyGreenstein { g };
                    println!("{name:<28} {}", lap(&description, scatterings, options)?);
                }
            }
        }
    }
    Ok(())
}

/// Walt Disney Animation Studios' cloud in place of the built-in one, stretched into its box.
fn disney_cloud() -> Result<Option<SceneDescription>, Box<dyn Error>> {
    let Some(folder) = std::env::var_os("LIGHTSHED_SCENES") else {
        return Ok(None);
    };
    let file = Path::new(&folder).join("disney_cloud/density_126x86x154_f32.raw");
    if !file.is_file() {
        return Ok(None);
    }
    let mut description = builtin::cloud();
    let DensityDescription::Grid(grid) = &mut description.media[0].density else {
        return Err("the built-in cloud is no grid".into());
    };
    grid.resolution = [126, 86, 154];
    grid.values = (std::fs::read(&file)?.as_chunks().0.iter())
        .map(|&bytes| f32::from_le_bytes(bytes))
        .collect();
    Ok(Some(description))
}

/// Frames before those that count.
const WARM_UP: u32 = 8;

fn lap(
    description: &SceneDescription,
    scatterings: u32,
    options: &Options,
) -> Result<String, Box<dyn Error>> {
    let scene = Scene::new(description)?;
    let settings = description.settings;
    let pixels = settings.width as usize * settings.height as usize;
    let tracer =
        VolumePathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(scatterings + 1), u32::MAX);
    let size = [settings.width, settings.height];
    let reference = [
        image(&tracer, size, options.reference, 1 << 20)?.0,
        image(&tracer, size, options.reference, 1 << 21)?.0,
    ];
    let mut parameters = RestirVolumeOptions::of_scene(&scene, Some(scatterings + 1));
    parameters.reservoirs = options.reservoirs.unwrap_or(parameters.reservoirs);
    if let Some(reservoirs) = options.alone {
        parameters = RestirVolumeOptions::new(scatterings);
        parameters.reservoirs = reservoirs;
    }
    parameters.still_confidence_cap = options.cap.unwrap_or(parameters.still_confidence_cap);
    let mut method = RestirVolume::new(&scene, parameters, CameraMotion::STILL)?;
    let (mut error, mut seconds, mut brightness) = ([0.0; 3], 0.0, 0.0);
    let mut frame_image = vec![Rgb::ZERO; pixels];
    for frame in 0..WARM_UP + options.turns.repeats {
        let before = process_cpu_seconds().ok_or("no CPU time")?;
        method
            .render_frame(frame, 7, &mut frame_image, &AtomicBool::new(false))
            .ok_or("cancelled")?;
        if frame >= WARM_UP {
            seconds += process_cpu_seconds().ok_or("no CPU time")? - before;
            brightness += mean_of(&frame_image);
            for (sum, error) in error.iter_mut().zip(errors(&frame_image, &reference, size)) {
                *sum += error;
            }
        }
    }
    let frames = f64::from(options.turns.repeats);
    let (error, seconds) = (error.map(|sum| sum / frames), seconds / frames);
    let truth = 0.5 * (mean_of(&reference[0]) + mean_of(&reference[1]));
    let mut line = format!(
        "reuse {seconds:.3} s {:.3e} mean {:+.2} %",
        error[0],
        100.0 * (brightness / frames / truth - 1.0)
    );
    for (name, tracking) in [
        ("volpath", VolumeTracking::Delta),
        ("decomposition", VolumeTracking::Decomposition),
    ] {
        let tracer = VolumePathTracer::new(&scene, scene.emitters_by_power())
            .with_depths(Some(scatterings + 1), u32::MAX)
            .with_tracking(tracking);
        let samples = 8;
        let (path_traced, spent) = image(&tracer, size, samples, 3)?;
        // The error of independent samples is theirs over their number.
        let equal = f64::from(samples) * seconds / spent;
        let theirs = errors(&path_traced, &reference, size).map(|error| error * f64::from(samples) / equal);
        line += &format!(
            "   {name} {equal:.1} spp {:.3e} ratio {:.2} (luminance {:.2}, blocks {:.2})",
            theirs[0],
            theirs[0] / error[0],
            theirs[1] / error[1],
            theirs[2] / error[2],
        );
    }
    Ok(line)
}

/// An image and the CPU time it took.
fn image(
    tracer: &VolumePathTracer<'_>,
    [width, height]: [u32; 2],
    samples: u32,
    seed: u64,
) -> Result<(Vec<Rgb>, f64), Box<dyn Error>> {
    let options = RenderOptions {
        seed,
        ..RenderOptions::new(width, height, Budget::Samples(samples))
    };
    let outcome = render(tracer, &options, &|_| (), &AtomicBool::new(false))?;
    let mean = outcome.film.mean_image();
    let mut values = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        values.extend((0..width).map(|x| Rgb::from(mean.get(x, y).unwrap_or_default())));
    }
    Ok((values, outcome.cpu_seconds.ok_or("no CPU time")?))
}

/// What of an image an error is taken of.
type View = fn(&[Rgb], [u32; 2]) -> Vec<Rgb>;

/// Pixels of a block along each axis: noise that neighbours share does not average out in it.
const BLOCK: usize = 4;

/// Mean squared errors of an image, of its luminance, and of its means over blocks, against two
/// independent references: `(x − a)(x − b)` has the expectation of the squared error, whatever
/// their noise.
fn errors(image: &[Rgb], reference: &[Vec<Rgb>; 2], size: [u32; 2]) -> [f64; 3] {
    let views: [View; 3] = [|image, _| image.to_vec(), |image, _| grey(image), blocks];
    views.map(|view| {
        let [image, a, b] = [image, &reference[0][..], &reference[1][..]].map(|image| view(image, size));
        let products = image
            .iter()
            .zip(&a)
            .zip(&b)
            .map(|((x, a), b)| f64::from((*x - *a).dot(*x - *b)) / 3.0);
        products.sum::<f64>() / image.len() as f64
    })
}

/// Mean luminance.
fn mean_of(image: &[Rgb]) -> f64 {
    image
        .iter()
        .map(|&value| f64::from(luminance(value)))
        .sum::<f64>()
        / image.len() as f64
}

/// Luminance in all channels.
fn grey(image: &[Rgb]) -> Vec<Rgb> {
    image.iter().map(|&value| Rgb::splat(luminance(value))).collect()
}

/// Means over whole blocks.
fn blocks(image: &[Rgb], [width, height]: [u32; 2]) -> Vec<Rgb> {
    let (width, height) = (width as usize, height as usize);
    let mut means = Vec::with_capacity(image.len() / (BLOCK * BLOCK));
    for top in (0..height / BLOCK).map(|row| row * BLOCK) {
        for left in (0..width / BLOCK).map(|column| column * BLOCK) {
            let rows = (top..top + BLOCK).map(|y| y * width + left);
            let sum: Rgb = rows.flat_map(|start| &image[start..start + BLOCK]).sum();
            means.push(sum / (BLOCK * BLOCK) as f32);
        }
    }
    means
}
