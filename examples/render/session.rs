//! From arguments to a written image: everything that can be checked is, then the rendering, then the figures.

use crate::arguments::{Arguments, Device, Motion};
use crate::explain::explain;
use crate::failure::{Failure, one_line};
use crate::gpu::on_gpu;
use crate::motion::{MediaMotion, Numbered, render_sequence};
use crate::progress::Bar;
use crate::report::Report;
use lightshed::film::{Budget, ImageComparison, OutputTarget, RenderOptions, RgbImage, read_exr, render};
use lightshed::integrator::{self, CameraMotion, MethodError, MovingMedia, Stage, Started};
use lightshed::scene::glam::{Vec2, Vec3};
use lightshed::scene::{RenderSettings, Scene, SceneDescription, SceneFeatures, builtin, import};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Exit status after an interruption, as shells report a process ended by SIGINT.
const INTERRUPTED: u8 = 130;

/// Does what the command line asks.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    // The cheap checks come before a large scene is read.
    let target = arguments.out.as_ref().map(OutputTarget::prepare).transpose()?;
    let reference = arguments.reference.as_deref().map(read_reference).transpose()?;

    let setup = Instant::now();
    let (mut description, mut warnings) = describe(arguments)?;
    let settings = &mut description.settings;
    [settings.width, settings.height] = arguments.size.unwrap_or([settings.width, settings.height]);
    let capabilities = arguments.method.capabilities();
    settings.max_depth = arguments
        .method
        .max_depth(arguments.max_depth, settings.max_depth)
        .map_err(|error| Failure::because("--max-depth", &error))?;
    if !description.media.is_empty() && !capabilities.media {
        return Err(MethodError::Media(arguments.method.name()).into());
    }
    let RenderSettings {
        width,
        height,
        max_depth,
        samples_per_pixel,
        ..
    } = *settings;
    let budget = match arguments.seconds {
        Some(seconds) => Budget::Seconds(seconds),
        None => Budget::Samples(arguments.spp.unwrap_or(samples_per_pixel)),
    };
    let threads = match arguments.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads as usize,
    };
    let seed = arguments.seed;
    let options = RenderOptions {
        seed,
        threads,
        ..RenderOptions::new(width, height, budget)
    };
    options.check()?;

    if let Some((path, image)) = &reference
        && [image.width(), image.height()] != [width, height]
    {
        let (path, w, h) = (path.display(), image.width(), image.height());
        return Err(Failure::new(format_args!(
            "{path} has {w}x{h} pixels, the image would have {width}x{height}"
        )));
    }
    let media = media_motion(arguments, &description)?;
    if let (Some(media), Some(frame)) = (&media, arguments.frame) {
        description = media.at(&description, frame);
    }
    let scene = Scene::new(&description).map_err(|error| Failure::because(&arguments.scene, &error))?;
    if arguments.explain {
        let roulette_depth = scene.settings().roulette_depth;
        println!(
            "{}",
            explain(arguments, &SceneFeatures::of(&scene), max_depth, roulette_depth)
        );
        return Ok(ExitCode::SUCCESS);
    }
    let motion = match arguments.motion {
        Some(_) if !capabilities.camera_motion => {
            let method = arguments.method.name();
            return Err(Failure::new(format_args!(
                "--motion has no meaning with --method {method}"
            )));
        }
        Some(motion) => camera_motion(motion, &scene, &description)?,
        None => CameraMotion::STILL,
    };
    let moving = match (&media, arguments.frame, budget) {
        (Some(media), None, Budget::Samples(frames)) => {
            media.scenes(&arguments.scene, &description, frames)?
        }
        _ => Vec::new(),
    };
    drop(description);
    match scene.dropped_triangle_count() {
        0 => (),
        count => warnings.push(format!("{count} triangles of no area were left out")),
    }
    let target = match target {
        Some(target) => target,
        None => default_target(&arguments.scene)?,
    }
    .with_exposure(arguments.exposure);
    let before = |_: u32, place: Vec3| media.map_or(place, |media| media.before(place));
    let moves = integrator::Motion {
        camera: motion,
        media: (!moving.is_empty()).then_some(MovingMedia {
            scenes: &moving,
            before: &before,
        }),
    };
    let stage = Stage::new(&scene);
    let started = match arguments.device {
        Device::Cpu => Some(arguments.method.start(&stage, moves)?),
        Device::Gpu => None,
    };
    let setup_seconds = setup.elapsed().as_secs_f64();
    for warning in &warnings {
        eprintln!("warning: {}", one_line(warning));
    }

    let interruption = Interruption::catch()?;
    let bar = Bar::new(budget);
    let (observer, cancel) = (|progress: &_| bar.show(progress), &interruption.cancel);
    let sequence = arguments.sequence.then_some(Numbered {
        image: &target,
        exposure: arguments.exposure,
    });
    let (outcome, device) = match started {
        None => on_gpu(arguments, &scene, &options, &observer, cancel)
            .map(|(outcome, name, passes)| (outcome, Some((name, passes))))?,
        Some(Started::Samples(estimator)) => (render(&estimator, &options, &observer, cancel)?, None),
        Some(Started::Frames(mut method)) => {
            let outcome = render_sequence(&mut method, sequence, &options, &observer, cancel)?;
            (outcome, None)
        }
    };
    bar.finish();
    interruption.writing.store(true, Ordering::SeqCst);

    let report = Report {
        scene: arguments.scene.clone(),
        method: arguments.method.name(),
        max_depth,
        seed,
        threads,
        device,
        setup_seconds,
        warnings,
        mean: outcome.film.mean_image().mean(),
        outcome,
        output: None,
        comparison: None,
    };
    finish(report, &target, reference, arguments.json)
}

/// The motion of media that the command line asks for, and whether frames can be written.
fn media_motion(
    arguments: &Arguments,
    description: &SceneDescription,
) -> Result<Option<MediaMotion>, Failure> {
    let method = &arguments.method;
    let capabilities = method.capabilities();
    let meaningless = |option: &str| {
        let method = method.name();
        Failure::new(format_args!("{option} has no meaning with --method {method}"))
    };
    if arguments.sequence && !capabilities.frames {
        return Err(meaningless("--sequence"));
    }
    if arguments.device == Device::Gpu && (arguments.sequence || arguments.media_motion.is_some()) {
        return Err(Failure::new(
            "--sequence and --media-motion have no meaning with --device gpu",
        ));
    }
    let Some(motion) = arguments.media_motion else {
        return Ok(None);
    };
    if !capabilities.media {
        return Err(meaningless("--media-motion"));
    }
    match (capabilities.frames, arguments.frame) {
        (true, Some(_)) => return Err(meaningless("--frame")),
        (true, None) if arguments.seconds.is_some() => {
            return Err(Failure::new(
                "--media-motion wants a number of frames, not --seconds",
            ));
        }
        (false, None) => {
            let method = method.name();
            return Err(Failure::new(format_args!(
                "--media-motion wants --frame with --method {method}, all of whose samples are of one frame"
            )));
        }
        _ => (),
    }
    MediaMotion::new(motion, description).map(Some)
}

/// The motion that the command line asks for: orbits go around what the middle of the image shows, along the image's vertical.
fn camera_motion(
    motion: Motion,
    scene: &Scene,
    description: &SceneDescription,
) -> Result<CameraMotion, Failure> {
    Ok(match motion {
        Motion::Translation(per_frame) => CameraMotion::translation(per_frame.into())?,
        Motion::Orbit(degrees) => {
            let RenderSettings { width, height, .. } = *scene.settings();
            let centre = Vec2::new(width as f32, height as f32) * 0.5;
            let middle = scene.intersect(&scene.camera().ray(centre, [0.5; 2]));
            let Some(middle) = middle else {
                return Err(Failure::new(
                    "the middle of the image shows nothing to orbit about",
                ));
            };
            let axis = description.camera.to_world.transform_vector3(Vec3::Y);
            CameraMotion::orbit(middle.position, axis, degrees.to_radians())?
        }
    })
}

/// Writes the image, compares it and prints the figures.
fn finish(
    mut report: Report,
    target: &OutputTarget,
    reference: Option<(PathBuf, RgbImage)>,
    json: bool,
) -> Result<ExitCode, Failure> {
    let image = report.outcome.film.mean_image();
    if report.outcome.samples_per_pixel > 0 {
        target.write(&image)?;
        report.output = Some(target.path().to_owned());
        report.comparison = match reference {
            Some((path, reference)) => Some((path, ImageComparison::new(&image, &reference)?)),
            None => None,
        };
    }
    let non_finite = report.outcome.film.non_finite();
    if non_finite > 0 {
        eprintln!("warning: {non_finite} samples were not finite and were left out");
    }
    if json {
        println!("{}", report.json());
    } else {
        println!("{}", report.text());
    }
    if !report.outcome.interrupted {
        return Ok(ExitCode::SUCCESS);
    }
    match &report.output {
        Some(path) => eprintln!("interrupted; {} holds the passes done so far", path.display()),
        None => eprintln!("interrupted before the first pass was done; nothing was written"),
    }
    Ok(ExitCode::from(INTERRUPTED))
}

/// The scene's description and what its importer had to say.
fn describe(arguments: &Arguments) -> Result<(SceneDescription, Vec<String>), Failure> {
    let name = arguments.scene.as_str();
    if let Some(description) = builtin::by_name(name) {
        return match arguments.defines.first() {
            Some((key, _)) => Err(Failure::new(format_args!(
                "the built-in scene {name} has no parameter {key}"
            ))),
            None => Ok((description, Vec::new())),
        };
    }
    let path = Path::new(name);
    if !path.exists() {
        let known = builtin::NAMES.join(", ");
        return Err(Failure::new(format_args!(
            "{name} is no file and no built-in scene ({known})"
        )));
    }
    let loaded = import::load(path, &arguments.defines)?;
    Ok((
        loaded.description,
        loaded.warnings.iter().map(ToString::to_string).collect(),
    ))
}

fn read_reference(path: &Path) -> Result<(PathBuf, RgbImage), Failure> {
    match read_exr(path) {
        Ok(image) => Ok((path.to_owned(), image)),
        Err(error) => Err(Failure::because(path.display(), &error)),
    }
}

/// `out/<scene>.png`, in a folder made if need be.
fn default_target(scene: &str) -> Result<OutputTarget, Failure> {
    let folder = Path::new("out");
    std::fs::create_dir_all(folder).map_err(|e| Failure::because("cannot make the folder out", &e))?;
    let mut name = Path::new(scene)
        .file_stem()
        .unwrap_or("image".as_ref())
        .to_owned();
    name.push(".png");
    Ok(OutputTarget::prepare(folder.join(name))?)
}

/// What interruptions do: the first cancels the rendering, the second ends the program, and none ends it while the image
/// is being written. Before [`Interruption::catch`] the first ends the program.
struct Interruption {
    cancel: AtomicBool,
    writing: AtomicBool,
}

impl Interruption {
    fn catch() -> Result<Arc<Self>, Failure> {
        let interruption = Arc::new(Self {
            cancel: AtomicBool::new(false),
            writing: AtomicBool::new(false),
        });
        let caught = Arc::clone(&interruption);
        ctrlc::set_handler(move || {
            let again = caught.cancel.swap(true, Ordering::SeqCst);
            if again && !caught.writing.load(Ordering::SeqCst) {
                std::process::exit(i32::from(INTERRUPTED));
            }
        })?;
        Ok(interruption)
    }
}
