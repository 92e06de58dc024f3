//! From arguments to a written image: everything that can be checked is, then the rendering, then the figures.

use crate::arguments::{Arguments, Device, Mapping, Method, Motion};
use crate::explain::explain;
use crate::failure::{Failure, one_line};
use crate::gpu::on_gpu;
use crate::motion::{MediaMotion, Numbered, render_sequence};
use crate::progress::Bar;
use crate::report::Report;
use crate::vpl;
use lightshed::film::{
    Budget, ImageComparison, OutputTarget, Progress, RenderOptions, RenderOutcome, RgbImage, read_exr, render,
};
use lightshed::integrator::{
    CameraMotion, DirectLight, LightSelection, PathMapping, PathReuse, PathTracer, RestirDi,
    RestirDiSettings, RestirGi, RestirPt, RestirPtOptions, RestirVolume, RestirVolumeOptions, SceneWorld,
    SelectedDirectLight, SelectedPathTracer, VolumePathTracer, VolumeTracking,
};
use lightshed::scene::glam::{Vec2, Vec3};
use lightshed::scene::{RenderSettings, Scene, SceneDescription, SceneFeatures, builtin, import};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Exit status after an interruption, as shells report a process ended by SIGINT.
const INTERRUPTED: u8 = 130;

/// Longest path, in edges, of direct light: camera, surface, emitter.
const DIRECT_DEPTH: u32 = 2;

/// Samples of emitters at a point unless told otherwise.
pub const LIGHT_SAMPLES: u32 = 8;

/// Does what the command line asks.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    // The cheap checks come before a large scene is read.
    let target = arguments.out.as_ref().map(OutputTarget::prepare).transpose()?;
    let reference = arguments.reference.as_deref().map(read_reference).transpose()?;

    let setup = Instant::now();
    let (mut description, mut warnings) = describe(arguments)?;
    let settings = &mut description.settings;
    [settings.width, settings.height] = arguments.size.unwrap_or([settings.width, settings.height]);
    settings.max_depth = match arguments.max_depth {
        None if arguments.method.is_direct() => Some(DIRECT_DEPTH),
        Some(_) if arguments.method.is_direct() => {
            let method = arguments.method.name();
            return Err(Failure::new(format_args!(
                "--max-depth has no meaning with --method {method}"
            )));
        }
        max_depth if arguments.method.is_vpl() => Some(vpl::depth(max_depth)?),
        max_depth => max_depth.or(settings.max_depth),
    };
    if arguments.lights.is_some() && !arguments.method.chooses_lights() {
        let method = arguments.method.name();
        return Err(Failure::new(format_args!(
            "--lights has no meaning with --method {method}"
        )));
    }
    if !description.media.is_empty() && !arguments.method.has_media() {
        let method = arguments.method.name();
        return Err(Failure::new(format_args!(
            "the scene has participating media, of which --method {method} knows nothing; use --method volpath"
        )));
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
        Some(_) if !arguments.method.has_motion() => {
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
    let selection = arguments
        .lights
        .map(|choosing| LightSelection::new(&scene, choosing))
        .transpose()?;
    let setup_seconds = setup.elapsed().as_secs_f64();
    for warning in &warnings {
        eprintln!("warning: {}", one_line(warning));
    }

    let interruption = Interruption::catch()?;
    let bar = Bar::new(budget);
    let (observer, cancel) = (|progress: &_| bar.show(progress), &interruption.cancel);
    let (outcome, device) = match arguments.device {
        Device::Gpu => on_gpu(arguments, &scene, &options, &observer, cancel)
            .map(|(outcome, name, passes)| (outcome, Some((name, passes))))?,
        Device::Cpu => {
            let how = Frames {
                camera: motion,
                media: media
                    .filter(|_| !moving.is_empty())
                    .map(|media| (media, &moving[..])),
                sequence: arguments.sequence.then_some(Numbered {
                    image: &target,
                    exposure: arguments.exposure,
                }),
            };
            let outcome = on_cpu(
                arguments, &scene, selection, how, max_depth, &options, &observer, cancel,
            )?;
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

/// What changes from frame to frame, and where frames go.
struct Frames<'a> {
    camera: CameraMotion,
    /// The motion of media, and the scene in each frame.
    media: Option<(MediaMotion, &'a [Scene])>,
    sequence: Option<Numbered<'a>>,
}

/// The motion of media that the command line asks for, and whether frames can be written.
fn media_motion(
    arguments: &Arguments,
    description: &SceneDescription,
) -> Result<Option<MediaMotion>, Failure> {
    let method = arguments.method;
    let meaningless = |option: &str| {
        let method = method.name();
        Failure::new(format_args!("{option} has no meaning with --method {method}"))
    };
    if arguments.sequence && !method.makes_frames() {
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
    if !method.has_media() {
        return Err(meaningless("--media-motion"));
    }
    match (method.makes_frames(), arguments.frame) {
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

/// Renders with the threads of this process.
#[expect(clippy::too_many_arguments, reason = "they are what the command line says")]
fn on_cpu(
    arguments: &Arguments,
    scene: &Scene,
    selection: Option<LightSelection>,
    Frames {
        camera: motion,
        media,
        sequence,
    }: Frames<'_>,
    max_depth: Option<u32>,
    options: &RenderOptions,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<RenderOutcome, Failure> {
    // Each arm is compiled for its estimator, so that its loop holds no indirect call.
    let outcome = match arguments.method {
        Method::Path => match selection {
            None => Ok(render(&PathTracer::new(scene), options, observer, cancel)?),
            Some(selection) => {
                let roulette_depth = scene.settings().roulette_depth;
                let estimator = SelectedPathTracer::new(scene, selection, max_depth, roulette_depth);
                Ok(render(&estimator, options, observer, cancel)?)
            }
        },
        Method::Volpath | Method::VolpathDecomposition => {
            let tracking = match arguments.method {
                Method::Volpath => VolumeTracking::Delta,
                _ => VolumeTracking::Decomposition,
            };
            let tracer = VolumePathTracer::new(scene).with_tracking(tracking);
            Ok(render(&tracer, options, observer, cancel)?)
        }
        Method::RestirVolume => {
            let mut parameters = RestirVolumeOptions::of_scene(scene, max_depth);
            if media.is_some() || !motion.is_still() {
                parameters = parameters.under_motion(scene);
            }
            match media {
                None => {
                    let mut method = RestirVolume::new(scene, parameters, motion)?;
                    render_sequence(&mut method, sequence, options, observer, cancel)
                }
                Some((media, scenes)) => {
                    let flow = |_: u32, place: Vec3| media.before(place);
                    let mut method = RestirVolume::animated(scenes, &flow, parameters, motion)?;
                    render_sequence(&mut method, sequence, options, observer, cancel)
                }
            }
        }
        Method::Direct => match selection {
            None => Ok(render(&DirectLight::new(scene), options, observer, cancel)?),
            Some(selection) => {
                let samples = arguments.light_samples.unwrap_or(LIGHT_SAMPLES);
                let estimator = SelectedDirectLight::new(scene, selection, samples, 1)?;
                Ok(render(&estimator, options, observer, cancel)?)
            }
        },
        Method::Lightcuts => {
            let mut method = arguments.lightcuts.method(scene)?;
            render_sequence(&mut method, sequence, options, observer, cancel)
        }
        Method::PathReuse => render_sequence(&mut PathReuse::new(scene), sequence, options, observer, cancel),
        Method::RestirDi | Method::RestirDiBiased => {
            let settings = match arguments.method {
                Method::RestirDi => RestirDiSettings::UNBIASED,
                _ => RestirDiSettings::BIASED,
            };
            match &selection {
                None => {
                    let mut method = RestirDi::with_settings(scene, settings)?.with_motion(motion);
                    render_sequence(&mut method, sequence, options, observer, cancel)
                }
                Some(selection) => {
                    let method = RestirDi::with_sampler(scene, selection, settings)?;
                    render_sequence(
                        &mut method.with_motion(motion),
                        sequence,
                        options,
                        observer,
                        cancel,
                    )
                }
            }
        }
        Method::RestirGi => {
            let mut method = RestirGi::new(scene).with_motion(motion);
            render_sequence(&mut method, sequence, options, observer, cancel)
        }
        Method::RestirPt | Method::RestirPtOffline => {
            let mapping = match arguments.shift {
                Mapping::Hybrid => PathMapping::Hybrid,
                Mapping::Reconnection => PathMapping::Reconnection,
            };
            let parameters = match arguments.method {
                Method::RestirPt => RestirPtOptions::real_time(mapping),
                _ => RestirPtOptions::offline(mapping),
            };
            let world = SceneWorld::new(scene);
            let mut method = RestirPt::new(&world, parameters, motion)?;
            render_sequence(&mut method, sequence, options, observer, cancel)
        }
        Method::VplGrid => {
            let mut method = arguments.vpl.grid(scene, max_depth.unwrap_or_default())?;
            render_sequence(&mut method, sequence, options, observer, cancel)
        }
        Method::VplBrute => {
            let mut method = arguments.vpl.brute(scene, max_depth.unwrap_or_default())?;
            render_sequence(&mut method, sequence, options, observer, cancel)
        }
    }?;
    Ok(outcome)
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
