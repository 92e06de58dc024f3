//! What guides gain in media: variance times CPU time of plain paths over that of paths whose
//! directions, flights or both are guided, training included. The variance is that between images
//! of different seeds, so no reference is needed.
//!
//! ```sh
//! cargo run --release -p lightshed-integrator --features studies --example guide_volume -- \
//!     [scene|fog|shaft|beacon] [cdq|vmf|…] [frames] [seeds] [setting=value]…
//! ```

use lightshed_integrator::film::{FrameMethod, SampledFrames, process_cpu_seconds};
use lightshed_integrator::{GuideKind, GuidedPaths, GuidedPathsOptions, VolumePathTracer, VolumeTracking};
use lightshed_sampling::PointSet;
use lightshed_scene::glam::{DVec3, Vec3};
use lightshed_scene::volume::FlightGuiding;
use lightshed_scene::{
    ColorTexture, DensityDescription, EmitterDescription, Material, MediumDescription, PhaseDescription, Rgb,
    Scene, SceneDescription, builtin, import,
};
use std::path::Path;
use std::sync::atomic::AtomicBool;

const SIDE: u32 = 64;

/// Fog in all of the Cornell box: thin before the lamp; around a narrow beam in a dark box; or
/// thick.
fn foggy(name: &str) -> Option<SceneDescription> {
    let mut scene = builtin::cornell();
    let (extinction, albedo) = match name {
        "fog" => (0.15, 0.7),
        "shaft" => (0.05, 0.9),
        "beacon" => (1.0, 0.5),
        _ => return None,
    };
    if name == "shaft" {
        scene.shapes.retain(|shape| shape.emission.is_none());
        for material in &mut scene.materials {
            *material = Material::Diffuse {
                reflectance: ColorTexture::Constant(Rgb::splat(0.05)),
            };
        }
        scene.emitters.push(EmitterDescription::Spot {
            position: Vec3::new(-0.9, 0.9, 0.3),
            direction: Vec3::new(0.8, -0.6, 0.0),
            intensity: Rgb::splat(20.0),
            beam_width: 0.08,
            cutoff_angle: 0.1,
        });
    }
    scene.media.push(MediumDescription {
        name: "fog".to_owned(),
        density: DensityDescription::Homogeneous,
        extinction: Rgb::splat(extinction),
        albedo: Rgb::splat(albedo),
        albedo_grids: Vec::new(),
        phase: PhaseDescription::HenyeyGreenstein { g: 0.3 },
        emission: None,
    });
    scene.camera_medium = Some(0);
    Some(scene)
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
        let pixels = (SIDE * SIDE) as usize;
        Self {
            sums: vec![DVec3::ZERO; pixels],
            squares: vec![0.0; pixels],
            count: 0.0,
            seconds: 0.0,
        }
    }

    /// Renders one more: the mean of the frames of a method.
    fn add(&mut self, method: &mut impl FrameMethod, frames: u32, seed: u64) {
        let begin = process_cpu_seconds().unwrap_or(0.0);
        let mut image = vec![Rgb::ZERO; self.sums.len()];
        let mut mean = vec![DVec3::ZERO; self.sums.len()];
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

    /// Variance of an image: of all pixels, and without the noisiest hundredth.
    fn variances(&self) -> [f64; 2] {
        let variance =
            |(sum, square): (&DVec3, &f64)| (square - sum.length_squared() / self.count) / (self.count - 1.0);
        let mut variances: Vec<f64> = self.sums.iter().zip(&self.squares).map(variance).collect();
        variances.sort_by(f64::total_cmp);
        let usual = &variances[..variances.len() - variances.len() / 100];
        [variances.iter().sum(), usual.iter().sum()]
    }

    fn mean(&self) -> f64 {
        self.sums.iter().map(|sum| sum.element_sum()).sum::<f64>()
            / (3.0 * self.count * self.sums.len() as f64)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let argument =
        |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let name = argument(1, "fog");
    let mut description = match foggy(&name).or_else(|| builtin::by_name(&name)) {
        Some(description) => description,
        None => import::load(Path::new(&name), &[])?.description,
    };
    let mut options = GuidedPathsOptions::new(argument(2, "vmf").parse::<GuideKind>()?);
    (options.volume, options.may_drop) = (Some(VolumeTracking::Delta), false);
    let (frames, seeds) = (argument(3, "64").parse()?, argument(4, "4").parse()?);
    let (mut candidates, mut defence) = (4, 0.1);
    for setting in arguments.iter().skip(5) {
        let (name, value) = setting.split_once('=').ok_or("settings are name=value")?;
        match name {
            "depth" => description.settings.max_depth = Some(value.parse()?),
            "candidates" => candidates = value.parse()?,
            "defence" => defence = value.parse()?,
            "split" => {
                options.field.split_above = value.parse()?;
                options.field.collapse_below = options.field.split_above / 2;
            }
            "training" => options.training = value.parse()?,
            "worth" => options.worth_depth = value.parse()?,
            "drop" => options.may_drop = value.parse()?,
            _ => return Err(format!("no setting {name}").into()),
        }
    }
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    let scene = Scene::new(&description)?;
    let emitters = scene.emitters_by_power();
    let flights = Some(FlightGuiding::new(candidates, defence)?);
    let mut images = [(); 4].map(|()| Images::new());
    for seed in 0..seeds {
        let tracer = VolumePathTracer::new(&scene, emitters).with_points(PointSet::Sobol);
        images[0].add(
            &mut SampledFrames::new(tracer, [SIDE; 2], options.samples),
            frames,
            seed,
        );
        let mut guided = |image: usize, options| {
            let method = GuidedPaths::new(&scene, emitters, options);
            method.map(|mut method| images[image].add(&mut method, frames, seed))
        };
        let without = |mut options: GuidedPathsOptions| {
            (options.field.max_share, options.field.min_share) = (0.0, 0.0);
            options
        };
        guided(1, options)?;
        guided(2, without(GuidedPathsOptions { flights, ..options }))?;
        guided(3, GuidedPathsOptions { flights, ..options })?;
    }
    let [plain, plain_usual] = images[0].variances();
    println!("{name}, {} seeds of {frames} frames", images[0].count);
    for (label, image) in ["plain", "directions", "flights", "both"].iter().zip(&images) {
        let [variance, usual] = image.variances();
        let cost = image.seconds / images[0].seconds;
        println!(
            "  {label:10}: mean {:.5}, variance {variance:.3e}, CPU-s {:.2}; gain {:.2}, without the noisiest hundredth {:.2}",
            image.mean(),
            image.seconds / image.count,
            plain / variance / cost,
            plain_usual / usual / cost,
        );
    }
    Ok(())
}
