//! From arguments to a written image: everything that can be checked is, then the rendering, then
//! the figures.

use crate::arguments::{Arguments, Device, Motion};
use crate::chosen::choose;
use crate::emptiness::{black, empty};
use crate::error_chain::chain;
use crate::explain::explain;
use crate::failure::{Failure, one_line};
use crate::gpu::on_gpu;
use crate::interruption::{INTERRUPTED, Interruption};
use crate::motion::{MediaMotion, Numbered, render_sequence};
use crate::progress::Bar;
use crate::rendered::Rendered;
use crate::report::{Report, Took};
use crate::shards::{
    check_frames, check_parts, default_out, done_already, file_of, header_of, image_key, is_done,
    one_after_the_other, options_of, plain_key,
};
use crate::streams::{complain, say};
use crate::submit::{Work, submit};
use lightshed::film::{
    Budget, ImageComparison, ImageFormat, OutputTarget, RenderOptions, RenderOutcome, RgbImage, ShardPart,
    process_cpu_seconds, read_exr, render, render_shard,
};
use lightshed::integrator::{self, CameraMotion, MethodError, MethodRequest, MovingMedia, Stage, Started};
use lightshed::scene::glam::{Vec2, Vec3};
use lightshed::scene::import::ImportError;
use lightshed::scene::{RenderSettings, Scene, SceneDescription, builtin, import};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// What a second is taken for where work is planned by the number of paths.
const PATHS_PER_SECOND: f64 = 1e6;

/// Does what the command line asks.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let Some(frames) = arguments.sequence_frames() else {
        return one(arguments, None);
    };
    check_frames(arguments)?;
    if arguments.submit.is_some() {
        // The first frame tells what can be known to fail.
        return one(arguments, Some(frames.start));
    }
    for frame in frames {
        let exit = one(arguments, Some(frame))?;
        if exit != ExitCode::SUCCESS {
            return Ok(exit);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Renders an image or a part of it: all there is, or a frame of a sequence.
fn one(arguments: &Arguments, frame: Option<u32>) -> Result<ExitCode, Failure> {
    // The cheap checks come before a large scene is read.
    check_parts(arguments)?;
    let parts: Vec<Option<ShardPart>> = match &arguments.shard {
        Some(parts) => parts.iter().map(Some).collect(),
        None => vec![None],
    };
    // What holds for one part's file does for the others.
    let target = arguments.out.as_deref();
    let target = target
        .map(|out| OutputTarget::prepare(file_of(out, frame, parts[0])))
        .transpose()?;
    let is_exr = |target: &OutputTarget| target.format() == ImageFormat::Exr;
    if arguments.exposure != 0.0 && target.as_ref().is_some_and(is_exr) {
        return Err(Failure::new(
            "--exposure has no meaning for an OpenEXR image, which keeps its values",
        ));
    }
    let is_timed = matches!(arguments.request, MethodRequest::Auto(_)) && arguments.seconds.is_some();
    if arguments.adaptive && !is_timed {
        return Err(Failure::new(
            "--adaptive is for --method auto with --seconds, and has no meaning otherwise",
        ));
    }
    let reference = arguments.reference.as_deref().map(read_reference).transpose()?;
    // Frames of samples show one moment; others have their own number.
    let moment = arguments
        .frame
        .or(frame.filter(|_| !arguments.method.capabilities().frames));

    let setup = Instant::now();
    let (mut reading, described) = Took::time(|| describe(arguments));
    let (mut description, mut warnings) = described?;
    // What the method is, is settled on the way.
    let arguments = &mut arguments.clone();
    if let MethodRequest::Auto(auto) = &arguments.request {
        arguments.method = auto.plainest(!description.media.is_empty())?;
    }
    let settings = &mut description.settings;
    [settings.width, settings.height] = arguments.size.unwrap_or([settings.width, settings.height]);
    let capabilities = arguments.method.capabilities();
    settings.max_depth = arguments
        .method
        .max_depth(arguments.max_depth, settings.max_depth)
        .map_err(|error| Failure::because("--max-depth", &error))?;
    // How much to spend on trees follows from it.
    let pixels = f64::from(settings.width) * f64::from(settings.height);
    settings.samples_per_pixel = match (arguments.spp, arguments.seconds) {
        (Some(samples), _) => samples,
        (None, Some(seconds)) => (seconds * PATHS_PER_SECOND / pixels).ceil() as u32,
        (None, None) => settings.samples_per_pixel,
    };
    if !description.media.is_empty() && !capabilities.media {
        return Err(MethodError::Media(arguments.request.name()).into());
    }
    let RenderSettings {
        width,
        height,
        max_depth,
        samples_per_pixel,
        ..
    } = *settings;
    let mut samples = match frame {
        Some(_) if capabilities.frames => 1,
        _ => arguments.samples().unwrap_or(samples_per_pixel),
    };
    let budget = match arguments.seconds {
        Some(seconds) => Budget::Seconds(seconds),
        None => Budget::Samples(samples),
    };
    let threads = match arguments.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads as usize,
    };
    let seed = arguments.seed;
    let mut options = RenderOptions {
        first: frame.filter(|_| capabilities.frames).unwrap_or(0),
        seed,
        threads,
        whole: arguments.shard.is_some(),
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
    let media = media_motion(arguments, moment, &description)?;
    if let (Some(media), Some(frame)) = (&media, moment) {
        description = media.at(&description, frame);
    }
    let (mut building, scene) = Took::time(|| Scene::new(&description));
    let mut scene = scene.map_err(|error| Failure::because(&arguments.scene, &error))?;
    // What each task of a job spends before it renders.
    let reading_seconds = process_cpu_seconds();
    let chosen = choose(arguments, &mut scene, &options, frame)?;
    let whole = arguments.samples().unwrap_or(samples);
    if let Some(chosen) = &chosen {
        arguments.method = chosen.choice.method.clone();
        match &mut options.budget {
            Budget::Seconds(budget) => *budget = (*budget - chosen.seconds).max(f64::MIN_POSITIVE),
            Budget::Samples(budget) => {
                samples = chosen.samples(arguments, samples);
                *budget = samples;
            }
        }
        if chosen.interrupted {
            complain("interrupted before the first pass was done; nothing was written");
            return Ok(ExitCode::from(INTERRUPTED));
        }
    }
    let (arguments, capabilities) = (&*arguments, arguments.method.capabilities());
    if arguments.explain {
        let roulette_depth = scene.settings().roulette_depth;
        let choice = chosen.as_ref().map(|chosen| &chosen.choice);
        say(explain(arguments, choice, &scene, max_depth, roulette_depth))?;
        return Ok(ExitCode::SUCCESS);
    }
    let motion = match arguments.motion {
        Some(_) if !capabilities.camera_motion => {
            let method = arguments.request.name();
            return Err(Failure::new(format_args!(
                "--motion has no meaning with --method {method}"
            )));
        }
        Some(motion) => camera_motion(motion, &scene, &description)?,
        None => CameraMotion::STILL,
    };
    if let Some(scheduler) = arguments.submit {
        let paths = pixels * f64::from(samples);
        let work = Work {
            reading: reading_seconds.unwrap_or_default(),
            rendering: paths / PATHS_PER_SECOND,
        };
        submit(arguments, scheduler, samples, work)?;
        return Ok(ExitCode::SUCCESS);
    }
    let moving = match (&media, moment, budget) {
        (Some(media), None, Budget::Samples(frames)) => {
            media.scenes(&arguments.scene, &description, frames)?
        }
        _ => Vec::new(),
    };
    let key = image_key(arguments, &description, frame, samples);
    let runs = ShardPart::all(arguments.shards.unwrap_or(0)).map(|part| {
        let header = header_of(plain_key(&options, samples), part)?;
        Ok(options_of(&header, capabilities, options))
    });
    let runs: Vec<RenderOptions> = runs.collect::<Result<_, Failure>>()?;
    drop(description);
    match scene.dropped_triangle_count() {
        0 => (),
        count => warnings.push(format!("{count} triangles of no area were left out")),
    }
    // What is to be done: a file, and which part of the image it is for.
    let mut files = Vec::new();
    for (place, &part) in parts.iter().enumerate() {
        let target = match (&target, &arguments.out) {
            (Some(target), _) if place == 0 => target.clone(),
            (_, Some(out)) => OutputTarget::prepare(file_of(out, frame, part))?,
            (_, None) => default_target(arguments, frame, part)?,
        };
        let header = part.map(|part| header_of(key.clone(), part)).transpose()?;
        match header {
            Some(header) if !arguments.again && is_done(&header, &target) => {
                say(done_already(&header, &target, arguments.json))?;
            }
            header => files.push((target.with_exposure(arguments.exposure), header)),
        }
    }
    if files.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    let before = |_: u32, place: Vec3| media.map_or(place, |media| media.before(place));
    let moves = integrator::Motion {
        camera: motion,
        media: (!moving.is_empty()).then_some(MovingMedia {
            scenes: &moving,
            before: &before,
        }),
    };
    warnings.extend(empty(&scene).map(str::to_owned));
    let choice = chosen.as_ref().map(|chosen| &chosen.choice);
    let stage = Stage::new(&scene)
        .for_samples(choice.map_or(whole, |choice| choice.frames_of_stage(whole)))
        .with_lights(choice.map(|choice| choice.lights.clone()).unwrap_or_default());
    let start = Instant::now();
    let mut started = match arguments.device {
        Device::Cpu => Some(arguments.method.start(&stage, moves)?),
        Device::Gpu => None,
    };
    // Trees and pilots that the method needs are a part of its time.
    if let Budget::Seconds(budget) = &mut options.budget {
        *budget = (*budget - start.elapsed().as_secs_f64()).max(f64::MIN_POSITIVE);
    }
    let mut pilot = chosen.as_ref();
    let pilot_seconds = chosen.as_ref().map_or(0.0, |chosen| chosen.seconds);
    let mut setup_seconds = setup.elapsed().as_secs_f64() - pilot_seconds;
    for warning in &warnings {
        complain(format_args!("warning: {}", one_line(warning)));
    }

    for (target, header) in files {
        let interruption = Interruption::catch()?;
        let bar = Bar::new(budget);
        let (observer, cancel) = (|progress: &_| bar.show(progress), &interruption.cancel);
        // A shard of samples needs no film, unless an image is to be compared.
        let mut into_file = None;
        if let (Some(Started::Samples(estimator)), Some(header), None) = (&started, &header, &reference) {
            let options = options_of(header, capabilities, options);
            let shard = render_shard(estimator, header, &options, &target, &observer, cancel)?;
            into_file = Some(Rendered::by_file(shard, header));
        }
        let sequence = arguments.sequence.then_some(Numbered {
            image: &target,
            exposure: arguments.exposure,
        });
        let mut figures = Vec::new();
        let mut render_some = |options: &RenderOptions| -> Result<RenderOutcome, Failure> {
            let method = match started.take() {
                Some(method) => method,
                None => arguments.method.start(&stage, moves)?,
            };
            Ok(match method {
                Started::Samples(estimator) => {
                    let outcome = render(&estimator, options, &observer, cancel)?;
                    // Frames may follow from each other, samples do not.
                    started = Some(Started::Samples(estimator));
                    outcome
                }
                Started::Frames(mut method) => {
                    let outcome = render_sequence(&mut method, sequence, options, &observer, cancel)?;
                    figures = method.figures();
                    outcome
                }
            })
        };
        let (mut rendered, device) = match (into_file, arguments.device) {
            (Some(rendered), _) => (rendered, None),
            (None, Device::Gpu) => {
                let (outcome, name, passes) = on_gpu(arguments, &scene, &options, &observer, cancel)?;
                (Rendered::by_film(outcome, header.as_ref())?, Some((name, passes)))
            }
            (None, Device::Cpu) => {
                let outcome = match (&header, runs.as_slice()) {
                    (Some(header), _) => render_some(&options_of(header, capabilities, options))?,
                    (None, []) => render_some(&options)?,
                    (None, runs) => one_after_the_other(runs, render_some)?,
                };
                (Rendered::by_film(outcome, header.as_ref())?, None)
            }
        };
        bar.finish();
        interruption.writing.store(true, Ordering::SeqCst);

        // The pilot is a part of the first.
        if let Some(chosen) = pilot.take() {
            chosen.count(&mut rendered);
        }
        let mut warnings = warnings.clone();
        if rendered.samples_per_pixel > 0
            && let Some(warning) = black(&scene, rendered.totals.mean)
        {
            complain(format_args!("warning: {warning}"));
            warnings.push(warning);
        }
        let report = Report {
            scene: arguments.scene.clone(),
            method: arguments.method.name(),
            max_depth,
            seed,
            threads,
            device,
            // Those of the first alone.
            setup_seconds: std::mem::take(&mut setup_seconds),
            reading: std::mem::take(&mut reading),
            building: std::mem::take(&mut building),
            warnings,
            size: [width, height],
            rendered,
            output: None,
            comparison: None,
            shard: header,
            figures,
            choice: chosen.as_ref().map(|chosen| chosen.choice.clone()),
        };
        let exit = finish(report, &target, reference.as_ref(), arguments.json)?;
        if exit != ExitCode::SUCCESS {
            return Ok(exit);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The motion of media that the command line asks for, and whether frames can be written.
fn media_motion(
    arguments: &Arguments,
    moment: Option<u32>,
    description: &SceneDescription,
) -> Result<Option<MediaMotion>, Failure> {
    let (method, capabilities) = (&arguments.request, arguments.method.capabilities());
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
    match (capabilities.frames, moment) {
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

/// The motion that the command line asks for: orbits go around what the middle of the image shows,
/// along the image's vertical.
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
    reference: Option<&(PathBuf, RgbImage)>,
    json: bool,
) -> Result<ExitCode, Failure> {
    if report.rendered.write(target)? {
        report.output = Some(target.path().to_owned());
        if let (Some((path, reference)), Some(film)) = (reference, report.rendered.film()) {
            let image = film.mean_image();
            report.comparison = Some((path.clone(), ImageComparison::new(&image, reference)?));
        }
    }
    let non_finite = report.rendered.totals.non_finite;
    if non_finite > 0 {
        complain(format_args!(
            "warning: {non_finite} samples were not finite and were left out"
        ));
    }
    if json {
        say(report.json())?;
    } else {
        say(report.text())?;
    }
    if !report.rendered.interrupted {
        return Ok(ExitCode::SUCCESS);
    }
    match &report.output {
        Some(path) => complain(format_args!(
            "interrupted; {} holds the passes done so far",
            path.display()
        )),
        None if report.shard.is_some() => {
            complain("interrupted; a shard is whole or not there: nothing was written")
        }
        None => complain("interrupted before the first pass was done; nothing was written"),
    }
    Ok(ExitCode::from(INTERRUPTED))
}

/// The scene's description and what its importer had to say.
fn describe(arguments: &Arguments) -> Result<(SceneDescription, Vec<String>), Failure> {
    let name = arguments.scene.as_str();
    if let Some(description) = builtin::by_name(name) {
        if let Some((key, _)) = arguments.defines.first() {
            return Err(Failure::new(format_args!(
                "the built-in scene {name} has no parameter {key}"
            )));
        }
        if !arguments.allowed_folders.is_empty() || !arguments.load_limits.is_empty() {
            return Err(Failure::new(format_args!(
                "--allow-folder and --load-limit have no meaning with the built-in scene {name}"
            )));
        }
        return Ok((description, Vec::new()));
    }
    let path = Path::new(name);
    if !path.exists() {
        let known = builtin::NAMES.join(", ");
        return Err(Failure::new(format_args!(
            "{name} is no file and no built-in scene ({known})"
        )));
    }
    if let Some(folder) = arguments.allowed_folders.iter().find(|folder| !folder.is_dir()) {
        return Err(Failure::new(format_args!(
            "--allow-folder {}: there is no such folder",
            folder.display()
        )));
    }
    let loaded = import::load_with(path, &arguments.defines, &arguments.limits());
    let mut loaded = loaded.map_err(|error| not_loaded(&error))?;
    if let Some(size) = arguments.size {
        loaded.resize(size);
    }
    Ok((
        loaded.description,
        loaded.warnings.iter().map(ToString::to_string).collect(),
    ))
}

/// Why a scene was not loaded, and the option that would let it.
fn not_loaded(error: &ImportError) -> Failure {
    let option = match error.innermost() {
        ImportError::OverBudget { resource, .. } => {
            format!("; --load-limit {}=N raises it", resource.name())
        }
        ImportError::Outside { .. } => "; --allow-folder FOLDER allows more of them".to_owned(),
        _ => String::new(),
    };
    Failure::new(format_args!("{}{option}", chain(error)))
}

fn read_reference(path: &Path) -> Result<(PathBuf, RgbImage), Failure> {
    // A pipe would be waited for.
    if path.exists() && !path.is_file() {
        return Err(Failure::new(format_args!(
            "{} is not a regular file",
            path.display()
        )));
    }
    match read_exr(path) {
        Ok(image) => Ok((path.to_owned(), image)),
        Err(error) => Err(Failure::because(path.display(), &error)),
    }
}

/// `out/<scene>.png`, or a file numbered after it, in a folder made if need be.
fn default_target(
    arguments: &Arguments,
    frame: Option<u32>,
    part: Option<ShardPart>,
) -> Result<OutputTarget, Failure> {
    let path = default_out(arguments);
    let folder = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(|e| Failure::because("cannot make the folder out", &e))?;
    Ok(OutputTarget::prepare(file_of(&path, frame, part))?)
}
