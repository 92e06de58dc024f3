//! Parts of an image: which samples, under which name, whether they are there already.

use crate::arguments::{Arguments, Device, Motion};
use crate::failure::Failure;
use crate::report::shard_json;
use lightshed::film::{
    Budget, ImageKey, OutputTarget, RenderOptions, RenderOutcome, ShardFile, ShardHeader, ShardPart,
};
use lightshed::integrator::{Method, MethodCapabilities};
use lightshed::sampling::PointSet;
use lightshed::scene::SceneDescription;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Refuses `--frames A..B` where there is nothing to see of it.
pub fn check_frames(arguments: &Arguments) -> Result<(), Failure> {
    let (method, capabilities) = (arguments.request.name(), arguments.method.capabilities());
    if capabilities.chain {
        return Err(Failure::new(format_args!(
            "--frames A..B has no meaning with --method {method}, whose frames follow from each other"
        )));
    }
    let moves = match capabilities.frames {
        true => capabilities.camera_motion && arguments.motion.is_some(),
        false => arguments.media_motion.is_some(),
    };
    if !moves {
        return Err(Failure::new(format_args!(
            "--frames A..B wants something that moves from frame to frame with --method {method}"
        )));
    }
    if arguments.sequence {
        return Err(Failure::new(
            "--frames A..B writes each frame: --sequence has no meaning with it",
        ));
    }
    if arguments.spp.is_some() && capabilities.frames {
        return Err(Failure::new(format_args!(
            "--spp has no meaning with --frames A..B and --method {method}"
        )));
    }
    Ok(())
}

/// Refuses shards where an image is no mean of independent samples or frames.
pub fn check_parts(arguments: &Arguments) -> Result<(), Failure> {
    let option = match (&arguments.shard, arguments.shards) {
        (Some(_), _) => "--shard",
        (None, Some(_)) => "--shards",
        (None, None) => return Ok(()),
    };
    if arguments.device == Device::Gpu {
        return Err(Failure::new(format_args!(
            "{option} has no meaning with --device gpu"
        )));
    }
    let moves = arguments.motion.is_some() || arguments.media_motion.is_some();
    let frames = arguments.method.capabilities().frames;
    if moves && frames && arguments.sequence_frames().is_none() {
        return Err(Failure::new(format_args!(
            "{option} divides samples of one view; with motion there is one of each: --frames A..B divides these"
        )));
    }
    if arguments.shard.is_some() && !has_extension(&arguments.out, "exr") {
        return Err(Failure::new("a shard is an OpenEXR file: --out must end in .exr"));
    }
    Ok(())
}

fn has_extension(path: &Option<PathBuf>, wanted: &str) -> bool {
    let extension = path.as_ref().map(|path| path.extension().unwrap_or_default());
    extension.is_none_or(|extension| extension.eq_ignore_ascii_case(wanted))
}

/// Where an image goes if nothing is said: `out/<scene>.png`, or `.exr` if it is rendered in parts.
pub fn default_out(arguments: &Arguments) -> PathBuf {
    let scene = Path::new(&arguments.scene)
        .file_stem()
        .unwrap_or("image".as_ref());
    let in_parts = arguments.shard.is_some() || arguments.submit.is_some();
    Path::new("out")
        .join(scene)
        .with_extension(if in_parts { "exr" } else { "png" })
}

/// The file of a frame or shard of the image at `path`: `image-0007.shard-02-of-16.exr`.
pub fn file_of(path: &Path, frame: Option<u32>, part: Option<ShardPart>) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    if let Some(frame) = frame {
        name.push(format!("-{frame:04}"));
    }
    if let Some(part) = part {
        let digits = (part.count() - 1).to_string().len();
        name.push(format!(".shard-{:0digits$}-of-{}", part.index(), part.count()));
    }
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// What all shards of the image have in common. The scene is that of the frame, its settings those
/// of the command line.
pub fn image_key(
    arguments: &Arguments,
    description: &SceneDescription,
    frame: Option<u32>,
    samples: u32,
) -> ImageKey {
    let settings = &description.settings;
    let depth = settings
        .max_depth
        .map_or("none".to_owned(), |depth| depth.to_string());
    let moving = |name: &str, motion: Option<Motion>| match motion {
        None => String::new(),
        Some(Motion::Translation([x, y, z])) => format!(", {name} translate:{x},{y},{z}"),
        Some(Motion::Orbit(degrees)) => format!(", {name} orbit:{degrees}"),
    };
    let chains = if arguments.method.capabilities().chain {
        ", a chain of frames each"
    } else {
        ""
    };
    ImageKey {
        scene: arguments.scene.clone(),
        scene_hash: description.fingerprint(),
        method: arguments.method.to_string(),
        options: format!(
            "lightshed {}, longest path {depth}{}{}{chains}",
            env!("CARGO_PKG_VERSION"),
            moving("motion", arguments.motion),
            moving("media motion", arguments.media_motion),
        ),
        seed: arguments.seed,
        independent: has_independent_samples(&arguments.method),
        frame: frame.or(arguments.frame),
        samples,
        size: [settings.width, settings.height],
    }
}

/// Whether samples of different shards are independent of each other: not those of a point set,
/// unless each shard is a chain with a seed of its own.
fn has_independent_samples(method: &Method) -> bool {
    let of_points =
        method.entry().option("points").is_some() && method.values().points() != PointSet::Independent;
    method.capabilities().chain || !of_points
}

/// As much of a key as says which samples its shards have, for shards that are merged at once.
pub fn plain_key(options: &RenderOptions, samples: u32) -> ImageKey {
    ImageKey {
        scene: String::new(),
        scene_hash: 0,
        method: String::new(),
        options: String::new(),
        seed: options.seed,
        independent: true,
        frame: None,
        samples,
        size: [options.width, options.height],
    }
}

/// The header of a part that has samples.
pub fn header_of(key: ImageKey, part: ShardPart) -> Result<ShardHeader, Failure> {
    let header = ShardHeader::of_part(key, part);
    if header.first() == header.end() {
        let samples = header.image().samples;
        return Err(Failure::new(format_args!(
            "shard {part} of {samples} samples has none of them"
        )));
    }
    Ok(header)
}

/// What a shard asks of the render loop. Where frames follow from each other, a shard is a chain of
/// its own, from frame 0 on.
pub fn options_of(
    header: &ShardHeader,
    capabilities: MethodCapabilities,
    options: RenderOptions,
) -> RenderOptions {
    let (first, seed) = match capabilities.chain {
        true => (0, header.chain_seed()),
        false => (options.first + header.first(), options.seed),
    };
    RenderOptions {
        budget: Budget::Samples(header.end() - header.first()),
        first,
        seed,
        ..options
    }
}

/// Whether the shard is there already: the same samples of the same image, every bit as written.
pub fn is_done(header: &ShardHeader, target: &OutputTarget) -> bool {
    let file = ShardFile::open(target.path()).ok();
    file.is_some_and(|file| file.header() == header && file.read().is_ok())
}

/// Says that it is.
pub fn done_already(header: &ShardHeader, target: &OutputTarget, json: bool) -> String {
    let path = target.path();
    match json {
        true => json!({"skipped": true, "shard": shard_json(header), "output": path}).to_string(),
        false => format!("{} is there already: {}", header.name(), path.display()),
    }
}

/// Renders parts in their order and merges them in it, as `merge` does.
pub fn one_after_the_other(
    parts: &[RenderOptions],
    mut render: impl FnMut(&RenderOptions) -> Result<RenderOutcome, Failure>,
) -> Result<RenderOutcome, Failure> {
    let mut whole: Option<RenderOutcome> = None;
    for part in parts {
        let mut outcome = render(part)?;
        if let Some(before) = whole {
            let mut film = before.film;
            // An interrupted part would be another one.
            if !outcome.interrupted {
                film.merge(&outcome.film)?;
                outcome.samples_per_pixel += before.samples_per_pixel;
            } else {
                outcome.samples_per_pixel = before.samples_per_pixel;
            }
            outcome.film = film;
            outcome.seconds += before.seconds;
            outcome.cpu_seconds = outcome.cpu_seconds.zip(before.cpu_seconds).map(|(a, b)| a + b);
            outcome.rays = outcome.rays.zip(before.rays).map(|(mut rays, others)| {
                rays += others;
                rays
            });
        }
        let interrupted = outcome.interrupted;
        whole = Some(outcome);
        if interrupted {
            break;
        }
    }
    whole.ok_or_else(|| Failure::new("there are no shards"))
}
