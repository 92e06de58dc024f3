//! The command line.

use crate::failure::one_line;
use crate::streams::complain;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Command, CommandFactory, FromArgMatches, Parser, ValueEnum};
use lightshed::film::{MAX_THREADS, ShardPart, ShardPartError};
use lightshed::integrator::{Auto, METHODS, Method, MethodOption, MethodRequest};
use lightshed::scene::import::LoadLimits;
use std::ffi::OsString;
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;

/// Renders a scene and compares the image with a reference.
#[derive(Clone, Debug, Parser)]
#[command(name = "render")]
pub struct Arguments {
    /// A built-in scene or a file: Mitsuba 3 (.xml), glTF 2.0 (.gltf, .glb), pbrt-v4 (.pbrt), or a
    /// mesh alone (.ply, .obj).
    #[arg(default_value = "cornell")]
    pub scene: String,

    /// How light is found. Of methods that make whole frames, samples are frames.
    #[arg(long = "method", value_parser = method_names(), default_value = Auto::NAME)]
    pub request: MethodRequest,

    /// The method itself: of `auto` the plainest one until the scene is known.
    #[arg(skip = Method::default())]
    pub method: Method,

    /// Where to render; a GPU needs the feature `gpu`.
    #[arg(long, value_enum, default_value_t = Device::Cpu)]
    pub device: Device,

    /// Samples in every pixel, or frames of methods that make whole frames; of a method that a
    /// pilot chose, as many as cost what this number of samples of the plainest one costs. The
    /// scene's own number if neither this nor --seconds is given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "seconds")]
    pub spp: Option<u32>,

    /// Frames A to B - 1 of a sequence, each an image of its own, numbered: image-0007.png; of
    /// methods whose frames are independent. A single number N is the same as --spp N.
    #[arg(long, value_name = "A..B", value_parser = frames, conflicts_with_all = ["seconds", "frame"])]
    pub frames: Option<Frames>,

    /// Renders the I-th of N parts of the samples, counted from 0, into a file of statistics beside
    /// the image's place (image.shard-I-of-N.exr), which the program `merge` makes the image of. A
    /// file that is there and whole is kept. A..B/N are parts A to B - 1, one after the other, with
    /// the scene read once.
    #[arg(long, value_name = "I/N", value_parser = parts, conflicts_with_all = ["seconds", "sequence", "shards"])]
    pub shard: Option<Parts>,

    /// Renders N shards one after the other and merges them: the same bits as from N processes and
    /// `merge`.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with_all = ["seconds", "sequence"])]
    pub shards: Option<u32>,

    /// Renders a shard again though its file is there and whole.
    #[arg(long, requires = "shard")]
    pub again: bool,

    /// Renders nothing, but writes a folder with what a scheduler needs to render --shards N of
    /// each of --frames.
    #[arg(long, value_enum, value_name = "SYSTEM")]
    pub submit: Option<Scheduler>,

    /// Shards that a task of --submit renders one after the other, with the scene read once
    /// [default: 1, or as many as keep reading the scene below 1 % of a task while the job has 64
    /// tasks]
    #[arg(long, value_name = "K", requires = "submit", value_parser = clap::value_parser!(u32).range(1..))]
    pub per_task: Option<u32>,

    /// The folder that --submit writes [default: beside the image, its name with .job]
    #[arg(long, value_name = "FOLDER", requires = "submit")]
    pub job: Option<PathBuf>,

    /// Wall time to render for instead of a number of samples, with what the method makes ready.
    #[arg(long, value_name = "S", value_parser = positive_seconds)]
    pub seconds: Option<f64>,

    /// Lets --method auto take the time of its pilot for the cost of methods, in place of counts:
    /// the choice then depends on the machine.
    #[arg(long, requires = "seconds")]
    pub adaptive: bool,

    /// Image size instead of the scene's own; the horizontal field of view stays, unless the file
    /// has no camera and a wider image would cut off what it shows.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,

    /// Images of different seeds are independent.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Longest path in edges instead of the scene's own: 1 shows emitters only, 2 direct light.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub max_depth: Option<u32>,

    /// Number of threads, 0 for one on every processor; the image does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=MAX_THREADS as i64))]
    pub threads: u32,

    /// Image to write, .exr (linear) or .png (sRGB) [default: out/<scene>.png]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,

    /// Brightens a PNG by this many stops.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = stops, allow_negative_numbers = true)]
    pub exposure: f32,

    /// OpenEXR image of the same size to compare with.
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,

    /// Moves the camera from frame to frame: translate:X,Y,Z (in the scene's units) or
    /// orbit:DEGREES (about what is in the middle of the image). The image is the last frame.
    #[arg(long, value_name = "MOTION", value_parser = motion, allow_hyphen_values = true)]
    pub motion: Option<Motion>,

    /// Moves the media, and what bounds them alone, in the same way: translate:X,Y,Z or
    /// orbit:DEGREES (about the image's vertical through their middle). The image is the last
    /// frame.
    #[arg(long, value_name = "MOTION", value_parser = motion, allow_hyphen_values = true)]
    pub media_motion: Option<Motion>,

    /// Which frame of --media-motion to render, with methods whose samples show one and the same.
    #[arg(long, value_name = "N", requires = "media_motion")]
    pub frame: Option<u32>,

    /// Also writes each frame as it is made, numbered: image-0000.png and so on.
    #[arg(long)]
    pub sequence: bool,

    /// Says what the method would do for the scene and what it would leave out, and renders
    /// nothing.
    #[arg(long)]
    pub explain: bool,

    /// Prints one JSON object instead of text.
    #[arg(long)]
    pub json: bool,

    /// Sets a parameter ($key) of a Mitsuba scene.
    #[arg(long = "define", value_name = "KEY=VALUE", value_parser = definition)]
    pub defines: Vec<(String, String)>,

    /// Lets the scene's files lie in this folder too, or beneath it; may be given several times.
    /// Without, they lie beside the scene's file or beneath its folder.
    #[arg(long = "allow-folder", value_name = "FOLDER")]
    pub allowed_folders: Vec<PathBuf>,

    /// Sets a limit of reading a scene's files: bytes (of files and images), vertices (and
    /// triangles), nodes, includes, depth or seconds; inf is no limit.
    #[arg(long = "load-limit", value_name = "NAME=N", value_parser = load_limit)]
    pub load_limits: Vec<(String, f64)>,

    /// All arguments as they were given, without the program's name.
    #[arg(skip)]
    pub words: Vec<OsString>,
}

/// What --frames asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frames {
    /// So many samples.
    Count(u32),
    /// These of a sequence.
    Range(Range<u32>),
}

/// What --shard asks for: neighbouring parts, at least one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parts {
    numbers: Range<u32>,
    count: u32,
}

impl Parts {
    /// Each of them.
    pub fn iter(&self) -> impl Iterator<Item = ShardPart> {
        let count = self.count;
        // The numbers have been checked.
        self.numbers
            .clone()
            .filter_map(move |number| ShardPart::new(number, count).ok())
    }
}

/// For whom --submit writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scheduler {
    /// A job array of Slurm.
    Slurm,
    /// Tasks of Ray.
    Ray,
    /// A template of Open Job Description.
    Openjd,
}

impl Arguments {
    /// Limits of reading the scene's files.
    pub fn limits(&self) -> LoadLimits {
        let mut limits = LoadLimits {
            folders: self.allowed_folders.clone(),
            ..LoadLimits::default()
        };
        for (name, value) in &self.load_limits {
            // The names have been checked.
            let _known = limits.set(name, *value);
        }
        limits
    }

    /// Samples or frames that are asked for, by either name.
    pub fn samples(&self) -> Option<u32> {
        match self.frames {
            Some(Frames::Count(frames)) => Some(frames),
            _ => self.spp,
        }
    }

    /// Frames of a sequence that are asked for.
    pub fn sequence_frames(&self) -> Option<Range<u32>> {
        match &self.frames {
            Some(Frames::Range(frames)) => Some(frames.clone()),
            _ => None,
        }
    }
}

/// Where an image is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Device {
    /// Threads of this process.
    Cpu,
    /// The first adapter that wgpu finds, or the one that WGPU_ADAPTER_NAME names.
    Gpu,
}

/// A camera's motion from each frame to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// By a vector.
    Translation([f32; 3]),
    /// About the middle of the image, by an angle in degrees.
    Orbit(f32),
}

/// All methods, with what they do.
fn method_names() -> impl TypedValueParser<Value = MethodRequest> {
    let auto = PossibleValue::new(Auto::NAME).help(
        "Whichever has least error for its cost, by a look at the scene and a short pilot; path or volpath where frames move and on devices",
    );
    let names = METHODS
        .iter()
        .map(|entry| PossibleValue::new(entry.name).help(entry.help));
    PossibleValuesParser::new([auto].into_iter().chain(names)).try_map(|name| name.parse::<MethodRequest>())
}

/// Options that some methods take, each once.
fn method_options() -> Vec<&'static MethodOption> {
    let mut options: Vec<&MethodOption> = Vec::new();
    for option in METHODS.iter().flat_map(|entry| entry.options) {
        if options.iter().all(|other| other.name != option.name) {
            options.push(option);
        }
    }
    options
}

/// The command with the options of all methods.
fn command() -> Command {
    method_options()
        .into_iter()
        .fold(Arguments::command(), |command, option| {
            let takers = METHODS.iter().filter(|entry| entry.option(option.name).is_some());
            let takers: Vec<&str> = takers.map(|entry| entry.name).collect();
            let default = match (option.value, option.default) {
                (Some(_), default) if !default.is_empty() => format!(" [default: {default}]"),
                _ => String::new(),
            };
            let help = format!("{}{default} ({})", option.help, takers.join(", "));
            let argument = Arg::new(option.name)
                .long(option.name)
                .help(help)
                .help_heading("Options of some methods");
            command.arg(match option.value {
                None => argument.action(ArgAction::SetTrue),
                Some(value) => argument
                    .value_name(value)
                    .value_parser(|text: &str| (option.check)(text).map(|()| text.to_owned())),
            })
        })
}

/// The arguments, with the options of the method set.
fn from_matches(matches: &ArgMatches) -> Result<Arguments, clap::Error> {
    let mut arguments = Arguments::from_arg_matches(matches)?;
    if arguments.spp.is_some() && matches!(arguments.frames, Some(Frames::Count(_))) {
        let message = "--spp and --frames N are the same number: give one of them\n";
        return Err(clap::Error::raw(ErrorKind::ArgumentConflict, message));
    }
    for option in method_options() {
        let given = match option.value {
            None => matches.get_flag(option.name).then_some("true"),
            Some(_) => matches.get_one::<String>(option.name).map(String::as_str),
        };
        let Some(value) = given else { continue };
        let name = arguments.request.name();
        if arguments.request.set(option.name, value).is_err() {
            let message = format!("--{} has no meaning with --method {name}\n", option.name);
            return Err(clap::Error::raw(ErrorKind::ArgumentConflict, message));
        }
    }
    arguments.method = match &arguments.request {
        MethodRequest::Method(method) => method.clone(),
        MethodRequest::Auto(auto) => {
            let method = auto.plainest(false).or_else(|_| auto.plainest(true));
            method.map_err(|error| clap::Error::raw(ErrorKind::ArgumentConflict, format!("{error}\n")))?
        }
    };
    Ok(arguments)
}

/// Parses the command line. In the other case what there is to say has been said and the program
/// ends.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Arguments, ExitCode> {
    let words: Vec<OsString> = arguments.into_iter().collect();
    let matches = command().try_get_matches_from(&words);
    matches
        .and_then(|matches| from_matches(&matches))
        .map(|arguments| Arguments {
            words: words[1..].to_vec(),
            ..arguments
        })
        .map_err(|error| match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
                // A closed pipe is nothing to complain about.
                error.print().ok();
                ExitCode::SUCCESS
            }
            _ => {
                // The message ends where the usage begins.
                let text = error.to_string();
                let message = text.split("\n\nUsage:").next().unwrap_or_default();
                complain(one_line(message.split("\n\nFor more").next().unwrap_or_default()));
                ExitCode::from(2)
            }
        })
}

fn parts(text: &str) -> Result<Parts, ShardPartError> {
    let of = |numbers: Range<u32>, part: ShardPart| Parts {
        numbers,
        count: part.count(),
    };
    let Some((first, rest)) = text.split_once("..") else {
        let part: ShardPart = text.parse()?;
        return Ok(of(part.index()..part.index() + 1, part));
    };
    let (end, count) = rest.split_once('/').ok_or(ShardPartError::Form)?;
    match (first.parse(), end.parse::<u32>(), count.parse()) {
        (Ok(first), Ok(end), Ok(count)) if first < end => Ok(of(first..end, ShardPart::new(end - 1, count)?)),
        _ => Err(ShardPartError::Form),
    }
}

fn frames(text: &str) -> Result<Frames, String> {
    let number = |text: &str| text.parse::<u32>().ok();
    match text.split_once("..") {
        None => match number(text) {
            Some(0) => Err("0 is not in 1..=4294967295".to_owned()),
            Some(frames) => Ok(Frames::Count(frames)),
            None => Err("not of the form 0..24, and no number".to_owned()),
        },
        Some((first, end)) => match (number(first), number(end)) {
            (Some(first), Some(end)) if first < end => Ok(Frames::Range(first..end)),
            (Some(_), Some(_)) => Err("there is no frame in it".to_owned()),
            _ => Err("not of the form 0..24".to_owned()),
        },
    }
}

fn positive_seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    let sound = seconds > 0.0 && seconds.is_finite();
    sound
        .then_some(seconds)
        .ok_or_else(|| "not a positive time".to_owned())
}

fn stops(text: &str) -> Result<f32, String> {
    let stops: f32 = text.parse().map_err(|_| "not a number".to_owned())?;
    (stops.abs() <= 64.0)
        .then_some(stops)
        .ok_or_else(|| "not between -64 and 64 stops".to_owned())
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text
        .split_once(['x', 'X'])
        .and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some([width, height]) if width > 0 && height > 0 => Ok([width, height]),
        Some(_) => Err("an image needs at least one pixel".to_owned()),
        None => Err("not of the form 640x480".to_owned()),
    }
}

fn motion(text: &str) -> Result<Motion, String> {
    let number = |text: &str| text.trim().parse::<f32>().ok().filter(|x| x.is_finite());
    let parsed = match text.split_once(':') {
        Some(("translate", vector)) => {
            let numbers: Option<Vec<f32>> = vector.split(',').map(number).collect();
            numbers
                .and_then(|numbers| numbers.try_into().ok())
                .map(Motion::Translation)
        }
        Some(("orbit", angle)) => number(angle).map(Motion::Orbit),
        _ => None,
    };
    parsed.ok_or_else(|| "not of the form translate:X,Y,Z or orbit:DEGREES".to_owned())
}

fn load_limit(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("not of the form vertices=1e8")?;
    let value: f64 = value.parse().map_err(|_| format!("{value} is not a number"))?;
    match LoadLimits::default().set(name, value) {
        true => Ok((name.to_owned(), value)),
        false if LoadLimits::NAMES.contains(&name) => Err(format!("{value} is no limit")),
        false => Err(format!(
            "there is no limit {name}, only {}",
            LoadLimits::NAMES.join(", ")
        )),
    }
}

fn definition(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err("not of the form key=value".to_owned()),
    }
}
