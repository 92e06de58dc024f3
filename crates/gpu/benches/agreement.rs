//! Do methods on a GPU have the expectation of those of the CPU? Differences of image means, to
//! hundredths of a per cent.
//!
//! ```text
//! cargo bench -p lightshed-gpu --bench agreement -- \
//!     [SCENE/METHOD…] [--seconds N] [--error PERCENT] [--seed N]
//! ```
//!
//! Each row is a method in a scene at 64×64. A chain is four frames of the device with a seed of
//! its own, and as many samples of the CPU's method with the same seed, or more of a method with
//! the same expectation where that is cheaper. Differences of the two means are independent from
//! chain to chain, so their spread gives the error, whatever pixels and frames have in common;
//! where both take the same random numbers the difference is nearly all rounding. Where they do
//! not, both leave out what camera rays see of emitters, which are the same rays for the same
//! seeds: lamps at the edges of pixels would be most of the noise. And `walks` is the path tracing
//! by which `restir-pt` finds its candidates, by the library with the device's random numbers: what
//! differs is what reuse makes of them. Rows end when the standard error of each channel is below
//! `--error`, or after `--seconds` of processor time. Tiles of 8×8 pixels are scored likewise.
//!
//! Fails if a channel or a tile is off by more than chance allows (10⁻⁴ a row). Says SKIPPED
//! without an adapter.

use lightshed_film::{FrameMethod, PixelEstimator, process_cpu_seconds};
use lightshed_gpu::{
    Gpu, GpuDirectLight, GpuError, GpuLightcuts, GpuMethod, GpuPathTracer, GpuRestirDi, GpuRestirPt,
    GpuRestirSuffix, GpuRestirVolume, GpuScene, GpuVolumePathTracer,
};
use lightshed_integrator::{
    CameraMotion, DirectLight, DirectLightOptions, LightChoosing, LightSelection, LightcutOptions, Lightcuts,
    PathMapping, PathTracer, RestirDiSettings, RestirPtOptions, RestirVolume, RestirVolumeOptions,
    SceneWorld, VolumePathTracer,
};
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Rgb, Scene, builtin};
use lightshed_shift::{Connectability, Finding, PathDomain, TreeTracer};
use lightshed_testkit::{ImageMoments, MeanTest, TileOptions, compare_tiles};
use std::sync::atomic::AtomicBool;
use std::time::SystemTime;

type Failure = Box<dyn std::error::Error>;

/// Width and height of the images.
const SIDE: u32 = 64;
/// Width and height of a tile.
const TILE: u32 = 8;
const TILES: u32 = (SIDE / TILE) * (SIDE / TILE);
/// Frames of a chain.
const FRAMES: u32 = 4;
/// Fewest chains from which errors are estimated.
const FEWEST: u64 = 24;
/// Chance that a row without a fault fails, half of it by the channels.
const SIGNIFICANCE: f64 = 1e-4;
/// Largest score of a tile: among 192 one is beyond with a chance of 4·10⁻⁵.
const WORST_TILE: f64 = 5.2;

/// Scene, method on the device, and the CPU's method that it is held to.
const ROWS: [(&str, &str, &str); 31] = [
    ("cornell", "path", "path"),
    ("cornell", "direct", "direct"),
    ("cornell", "direct-tree", "direct-tree"),
    ("cornell", "lightcuts", "lightcuts"),
    ("cornell", "restir-di", "direct"),
    ("cornell", "restir-di-tree", "direct"),
    ("cornell", "restir-pt", "walks"),
    ("cornell", "restir-suffix", "path"),
    ("cornell-glossy", "path", "path"),
    ("cornell-glossy", "direct", "direct"),
    ("cornell-glossy", "direct-tree", "direct-tree"),
    ("cornell-glossy", "lightcuts", "lightcuts"),
    ("cornell-glossy", "restir-di", "direct"),
    ("cornell-glossy", "restir-di-tree", "direct"),
    ("cornell-glossy", "restir-pt", "walks"),
    ("cornell-glossy", "restir-suffix", "path"),
    ("many-lights", "path", "path"),
    ("many-lights", "direct", "direct"),
    ("many-lights", "direct-tree", "direct-tree"),
    ("many-lights", "lightcuts", "lightcuts"),
    ("many-lights", "restir-di", "direct-tree"),
    ("many-lights", "restir-di-tree", "direct-tree"),
    ("many-lights", "restir-pt", "walks"),
    ("many-lights", "restir-suffix", "path"),
    ("smoke-in-cornell", "volpath", "volpath"),
    ("smoke-in-cornell", "volpath-once", "volpath-once"),
    ("smoke-in-cornell", "restir-volume", "restir-volume"),
    ("cloud", "volpath", "volpath"),
    ("cloud", "volpath-once", "volpath-once"),
    ("cloud", "restir-volume", "restir-volume"),
    ("cloud", "restir-volume", "volpath-once"),
];

struct Limits {
    /// Of processor time.
    seconds: f64,
    /// Of each channel, relatively.
    error: f64,
    /// Of the first chain.
    seed: u64,
}

fn main() -> Result<(), Failure> {
    let mut limits = Limits {
        seconds: 60.0,
        error: 2.5e-4,
        seed: 1,
    };
    let mut asked = Vec::new();
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench");
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--seconds" => limits.seconds = value(arguments.next())?,
            "--seed" => limits.seed = value(arguments.next())? as u64,
            "--error" => limits.error = value(arguments.next())? / 100.0,
            _ => asked.push(argument),
        }
    }
    let gpu = match Gpu::new() {
        Ok(gpu) => gpu,
        Err(error) => {
            println!("SKIPPED: {error}");
            return Ok(());
        }
    };
    println!(
        "{}, {SIDE}x{SIDE}, chains of {FRAMES} frames\n",
        gpu.description()
    );
    println!(
        "| scene | on the device | on the CPU | chains | red (%) | green (%) | blue (%) | worst of {} tiles |",
        3 * TILES
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut off = Vec::new();
    for (scene, device, host) in ROWS {
        let name = format!("{scene}/{device}");
        if !(asked.is_empty() || asked.iter().any(|part| name.contains(part.as_str()))) {
            continue;
        }
        if !row(&gpu, scene, device, host, &limits)? {
            off.push(name);
        }
    }
    if off.is_empty() {
        Ok(())
    } else {
        Err(format!("not alike: {}", off.join(", ")).into())
    }
}

/// Processor time so far; where the system does not tell, the time since a clock's beginning.
fn seconds() -> f64 {
    process_cpu_seconds().unwrap_or_else(|| {
        let since = SystemTime::UNIX_EPOCH.elapsed();
        since.map_or(0.0, |time| time.as_secs_f64())
    })
}

fn value(argument: Option<String>) -> Result<f64, Failure> {
    let number: f64 = argument.ok_or("a number is missing")?.parse()?;
    if number > 0.0 && number < 1e6 {
        Ok(number)
    } else {
        Err(format!("{number} is out of range").into())
    }
}

/// Sums of tiles over the frames of a chain, channels interleaved.
#[derive(Clone)]
struct Chain {
    tiles: Vec<f64>,
}

impl Chain {
    fn new() -> Self {
        Self {
            tiles: vec![0.0; 3 * TILES as usize],
        }
    }

    /// Adds one image of `images`.
    fn add(&mut self, images: u32, image: impl Iterator<Item = [f32; 3]>) {
        let share = 1.0 / f64::from(images * TILE * TILE);
        for (pixel, value) in (0..).zip(image) {
            let tile = pixel / SIDE / TILE * (SIDE / TILE) + pixel % SIDE / TILE;
            for (c, value) in value.into_iter().enumerate() {
                self.tiles[3 * tile as usize + c] += share * f64::from(value);
            }
        }
    }

    fn add_chain(&mut self, other: &Self) {
        for (value, other) in self.tiles.iter_mut().zip(&other.tiles) {
            *value += other;
        }
    }

    fn subtract(&mut self, other: &Self) {
        for (value, other) in self.tiles.iter_mut().zip(&other.tiles) {
            *value -= other;
        }
    }

    fn channel(&self, c: usize) -> f64 {
        self.tiles.iter().skip(c).step_by(3).sum::<f64>() / f64::from(TILES)
    }
}

/// So many samples of each pixel.
fn chain(samples: u32, seed: u64, sample: &dyn Fn(u32, u32, u32, u64) -> Rgb) -> Chain {
    let mut chain = Chain::new();
    for index in 0..samples {
        let pixels = (0..SIDE * SIDE).map(|i| sample(i % SIDE, i / SIDE, index, seed));
        chain.add(samples, pixels.map(|value| value.to_array()));
    }
    chain
}

/// Means of what chains gave.
struct Statistics {
    channels: [MeanTest; 3],
    tiles: Vec<MeanTest>,
}

impl Statistics {
    fn new() -> Self {
        Self {
            channels: [MeanTest::new(); 3],
            tiles: vec![MeanTest::new(); 3 * TILES as usize],
        }
    }

    fn push(&mut self, chain: &Chain) {
        for (c, mean) in self.channels.iter_mut().enumerate() {
            mean.push(chain.channel(c));
        }
        for (mean, value) in self.tiles.iter_mut().zip(&chain.tiles) {
            mean.push(*value);
        }
    }
}

/// Chains of a method until the error is small enough or time is over; prints the row and says
/// whether the two are alike.
fn row(gpu: &Gpu, name: &str, device: &str, host: &str, limits: &Limits) -> Result<bool, Failure> {
    let mut description = builtin::by_name(name).ok_or("it is built in")?;
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    if device == "restir-volume" || device == "direct" || device == "volpath-once" {
        description.settings.max_depth = Some(2);
    }
    let scene = Scene::new(&description)?;
    let on_device = if description.media.is_empty() {
        GpuScene::new(gpu, &scene)?
    } else {
        GpuScene::with_medium(gpu, &scene)?
    };
    let mut of_device = device_method(gpu, &on_device, &scene, device)?;
    let mut of_host = Host::new(&scene, host, device == host)?;
    // What camera rays see of emitters.
    let seen = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
    let has_media = !description.media.is_empty();
    let seen = move |x, y, index, seed| {
        if has_media {
            Rgb::ZERO
        } else {
            seen.sample(x, y, index, seed)
        }
    };
    let [mut differences, mut truth] = [Statistics::new(), Statistics::new()];
    let start = seconds();
    let mut chains = 0;
    while chains < FEWEST
        || (seconds() - start < limits.seconds && !is_fine(&differences, &truth, limits.error))
    {
        let seed = limits.seed + chains;
        let mut found = Chain::new();
        for frame in 0..FRAMES {
            let (image, _) = of_device.frame(frame, seed)?;
            found.add(FRAMES, image.into_iter());
        }
        let mut expected = of_host.chain(seed)?;
        let mut whole = expected.clone();
        if host == "walks" {
            whole.add_chain(&chain(FRAMES, seed, &seen));
        }
        truth.push(&whole);
        if host == "walks" {
            found.subtract(&chain(FRAMES, seed, &seen));
        } else if device != host {
            found.subtract(&chain(FRAMES, seed, &seen));
            expected.subtract(&chain(of_host.samples, seed + of_host.offset, &seen));
        }
        found.subtract(&expected);
        differences.push(&found);
        chains += 1;
    }
    report(name, device, host, &differences, &truth)
}

fn is_fine(differences: &Statistics, truth: &Statistics, error: f64) -> bool {
    let mut channels = differences.channels.iter().zip(&truth.channels);
    channels.all(|(difference, truth)| difference.standard_error() <= error * truth.mean())
}

fn report(
    name: &str,
    device: &str,
    host: &str,
    differences: &Statistics,
    truth: &Statistics,
) -> Result<bool, Failure> {
    let chains = differences.channels[0].count();
    let [red, green, blue] = core::array::from_fn(|c| {
        let percent = 100.0 / truth.channels[c].mean();
        let difference = &differences.channels[c];
        format!(
            "{:+.3} ± {:.3}",
            percent * difference.mean(),
            percent * difference.standard_error()
        )
    });
    let expected: Vec<f64> = truth.tiles.iter().map(MeanTest::mean).collect();
    let found: Vec<f64> = truth
        .tiles
        .iter()
        .zip(&differences.tiles)
        .map(|(truth, difference)| truth.mean() + difference.mean())
        .collect();
    let variances: Vec<f64> = differences
        .tiles
        .iter()
        .map(|difference| difference.standard_error().powi(2))
        .collect();
    let moments = |mean, variance_of_mean| ImageMoments {
        width: (SIDE / TILE) as usize,
        channels: 3,
        mean,
        variance_of_mean,
        samples_per_pixel: chains,
    };
    let options = TileOptions {
        tile_size: 1,
        significance: SIGNIFICANCE,
        // Rounding, where both sides take the same random numbers.
        relative_tolerance: 1e-5,
    };
    let tiles = compare_tiles(&moments(&found, &variances), &moments(&expected, &[]), &options)?;
    let worst = tiles.worst().map_or(0.0, |tile| tile.z);
    println!("| {name} | {device} | {host} | {chains} | {red} | {green} | {blue} | {worst:+.1} |");
    // Neighbouring tiles have paths in common, so whole images are judged by their chains, and
    // tiles by the worst of them alone.
    let rounding = |c: usize| 1e-5 * truth.channels[c].mean();
    let channels = (0..3).all(|c| {
        let difference = &differences.channels[c];
        difference.mean().abs() <= rounding(c) || difference.test_against(0.0, SIGNIFICANCE / 6.0).is_ok()
    });
    Ok(channels && worst.abs() <= WORST_TILE)
}

fn device_method<'a>(
    gpu: &'a Gpu,
    on_device: &'a GpuScene,
    scene: &Scene,
    name: &str,
) -> Result<Box<dyn GpuMethod + 'a>, GpuError> {
    Ok(match name {
        "path" | "direct" => Box::new(GpuPathTracer::new(gpu, on_device)?),
        "direct-tree" => Box::new(GpuDirectLight::new(gpu, on_device, 1, 1)?),
        "lightcuts" => Box::new(GpuLightcuts::new(gpu, on_device, LightcutOptions::default())?),
        "restir-di" => Box::new(GpuRestirDi::new(gpu, on_device)?),
        "restir-di-tree" => Box::new(GpuRestirDi::with_tree(
            gpu,
            on_device,
            RestirDiSettings::UNBIASED,
        )?),
        "restir-pt" => Box::new(GpuRestirPt::new(gpu, on_device)?),
        "restir-suffix" => {
            // Behind the camera ray of a path.
            let mut options = GpuRestirSuffix::real_time(PathMapping::Hybrid);
            (options.suffixes.direct_samples, options.camera_rays) = (0, 1);
            Box::new(GpuRestirSuffix::with_options(gpu, on_device, options)?)
        }
        "restir-volume" => {
            let options = RestirVolumeOptions::of_scene(scene, Some(2)).with_neighbours();
            Box::new(GpuRestirVolume::new(gpu, on_device, options)?)
        }
        _ => Box::new(GpuVolumePathTracer::new(gpu, on_device)?),
    })
}

/// The CPU's side of a row.
struct Host<'a> {
    kind: HostKind<'a>,
    /// Samples of each pixel and chain; more where random numbers differ anyway.
    samples: u32,
    /// Added to the seeds, so that samples are independent where they are not the device's.
    offset: u64,
}

enum HostKind<'a> {
    Walks(Box<Walks<'a>>),
    Samples(Box<dyn Fn(u32, u32, u32, u64) -> Rgb + 'a>),
    Frames(Box<dyn FrameMethod + 'a>),
}

impl<'a> Host<'a> {
    fn new(scene: &'a Scene, name: &str, is_twin: bool) -> Result<Self, Failure> {
        fn of<'a>(estimator: impl PixelEstimator + 'a) -> HostKind<'a> {
            HostKind::Samples(Box::new(move |x, y, index, seed| {
                estimator.sample(x, y, index, seed)
            }))
        }
        let (kind, more) = match name {
            "path" => (of(PathTracer::new(scene, scene.emitters_by_power())), 8),
            // With the device's random numbers, or else with several samples of emitters.
            "direct" if is_twin => (of(PathTracer::new(scene, scene.emitters_by_power())), 1),
            "direct" => (
                of(DirectLight::new(
                    scene,
                    scene.emitters_by_power(),
                    DirectLightOptions::samples(4, 1),
                )?),
                4,
            ),
            "direct-tree" => {
                let selection = LightSelection::new(scene, LightChoosing::Tree)?;
                let samples = if is_twin { 1 } else { 8 };
                (
                    of(DirectLight::new(
                        scene,
                        selection,
                        DirectLightOptions {
                            emitter_samples: samples,
                            bsdf_samples: 1,
                            bsdf_samples_where_diffuse: false,
                            ..DirectLightOptions::default()
                        },
                    )?),
                    8,
                )
            }
            "lightcuts" => {
                let method = Lightcuts::new(scene, LightcutOptions::default())?;
                (HostKind::Frames(Box::new(method)), 1)
            }
            "restir-volume" => {
                let options = RestirVolumeOptions::of_scene(scene, Some(2));
                let method = RestirVolume::new(scene, options, CameraMotion::STILL)?;
                (HostKind::Frames(Box::new(method)), 1)
            }
            "walks" => (HostKind::Walks(Box::new(Walks::new(scene)?)), 1),
            _ => (of(VolumePathTracer::new(scene, scene.emitters_by_power())), 32),
        };
        let has_numbers = is_twin || name == "walks";
        Ok(Self {
            kind,
            samples: if has_numbers { FRAMES } else { more * FRAMES },
            offset: if has_numbers { 0 } else { 1 << 32 },
        })
    }

    fn chain(&mut self, seed: u64) -> Result<Chain, Failure> {
        let seed = seed + self.offset;
        let method = match &mut self.kind {
            HostKind::Samples(sample) => return Ok(chain(self.samples, seed, &**sample)),
            HostKind::Walks(walks) => return Ok(walks.chain(seed)),
            HostKind::Frames(method) => method,
        };
        let mut chain = Chain::new();
        for index in 0..self.samples {
            let mut image = vec![Rgb::ZERO; (SIDE * SIDE) as usize];
            let finished = method.render_frame(index, seed, &mut image, &AtomicBool::new(false));
            finished.ok_or("nobody cancels")?;
            chain.add(self.samples, image.iter().map(|value| value.to_array()));
        }
        Ok(chain)
    }
}

/// The trees of paths from which `restir-pt` resamples on the device, one a pixel and frame.
struct Walks<'a> {
    world: SceneWorld<'a>,
    rules: Connectability,
    max_length: u32,
    tracer: TreeTracer<SceneWorld<'a>>,
}

/// Where the device's random numbers for a tree begin, in words.
const SEEDS: u32 = 4 * 0x100000;

impl<'a> Walks<'a> {
    fn new(scene: &'a Scene) -> Result<Self, Failure> {
        let rules = RestirPtOptions::real_time(PathMapping::Hybrid).thresholds(scene.extent(), false)?;
        Ok(Self {
            world: SceneWorld::new(scene, scene.emitters_by_power()),
            rules,
            max_length: scene.settings().max_depth.unwrap_or(126).min(126),
            tracer: TreeTracer::new(scene.settings().roulette_depth),
        })
    }

    /// What the trees give, with the shares that their frames have in a chain: the frame before is
    /// worth as many as it is of.
    fn chain(&mut self, seed: u64) -> Chain {
        let mut chain = Chain::new();
        for frame in 0..FRAMES {
            let share: f32 = (frame..FRAMES).map(|last| 1.0 / (last + 1) as f32).sum();
            let image: Vec<_> = (0..SIDE * SIDE)
                .map(|i| (self.sample(i % SIDE, i / SIDE, frame, seed) * share).to_array())
                .collect();
            chain.add(FRAMES, image.into_iter());
        }
        chain
    }

    /// Light that the first surface scatters.
    fn sample(&mut self, x: u32, y: u32, frame: u32, seed: u64) -> Rgb {
        let scene = self.world.scene();
        let mut rng = CounterRng::new(seed, y << 16 | x, frame);
        let place = Vec2::new(x as f32, y as f32) + Vec2::from(rng.next_2d());
        let ray = scene.camera().ray(place, [0.5; 2]);
        let Some(hit) = scene.accelerator().intersect(&ray) else {
            return Rgb::ZERO;
        };
        let first = self.world.arrive(&ray, &hit);
        let domain = PathDomain::behind(&self.world, first, -ray.direction, self.rules, self.max_length);
        rng.set_dimension(SEEDS);
        let mut sum = Rgb::ZERO;
        self.tracer.trace(
            &[(&domain, PathSeed::draw(&mut rng))],
            |_, finding| match finding {
                Finding::Seen(radiance) => sum += radiance,
                Finding::Path(sample, weight) => sum += sample.contribution() * weight.value() as f32,
            },
        );
        sum
    }
}
