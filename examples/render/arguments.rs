//! The command line.

use crate::failure::one_line;
use crate::lightcuts::LightcutArguments;
use crate::vpl::VplArguments;
use clap::error::ErrorKind;
use clap::{Parser, ValueEnum};
use lightshed::film::MAX_THREADS;
use lightshed::integrator::{LightChoosing, MAX_DIRECT_SAMPLES};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

/// Renders a scene and compares the image with a reference.
#[derive(Debug, Parser)]
#[command(name = "render")]
pub struct Arguments {
    /// A built-in scene or a file: Mitsuba 3 (.xml) or glTF 2.0 (.gltf, .glb).
    #[arg(default_value = "cornell")]
    pub scene: String,

    /// How light is found.
    #[arg(long, value_enum, default_value_t = Method::Path)]
    pub method: Method,

    /// Where to render; a GPU needs the feature `gpu`.
    #[arg(long, value_enum, default_value_t = Device::Cpu)]
    pub device: Device,

    /// How ReSTIR path tracing carries paths between pixels.
    #[arg(long, value_enum, default_value_t = Mapping::Hybrid)]
    pub shift: Mapping,

    /// How an emitter is chosen; by power and without regard to the point if not given.
    #[arg(long, value_name = "HOW", value_parser = lights)]
    pub lights: Option<LightChoosing>,

    /// Samples of emitters at the point that a camera ray meets, with --method direct and --lights.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_DIRECT_SAMPLES)), requires = "lights")]
    pub light_samples: Option<u32>,

    /// Samples in every pixel, or frames of methods that make whole frames; the scene's own number if neither this nor
    /// --seconds is given.
    #[arg(long, value_name = "N", visible_alias = "frames", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "seconds")]
    pub spp: Option<u32>,

    /// Wall time to render for instead of a number of samples.
    #[arg(long, value_name = "S", value_parser = positive_seconds)]
    pub seconds: Option<f64>,

    /// Image size instead of the scene's own; the horizontal field of view stays.
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

    /// Moves the camera from frame to frame: translate:X,Y,Z (in the scene's units) or orbit:DEGREES (about what is in the
    /// middle of the image). The image is the last frame.
    #[arg(long, value_name = "MOTION", value_parser = motion, allow_hyphen_values = true)]
    pub motion: Option<Motion>,

    /// Moves the media, and what bounds them alone, in the same way: translate:X,Y,Z or orbit:DEGREES (about the image's vertical through
    /// their middle). The image is the last frame.
    #[arg(long, value_name = "MOTION", value_parser = motion, allow_hyphen_values = true)]
    pub media_motion: Option<Motion>,

    /// Which frame of --media-motion to render, with methods whose samples show one and the same.
    #[arg(long, value_name = "N", requires = "media_motion")]
    pub frame: Option<u32>,

    /// Also writes each frame as it is made, numbered: image-0000.png and so on.
    #[arg(long)]
    pub sequence: bool,

    /// Says what the method would do for the scene and what it would leave out, and renders nothing.
    #[arg(long)]
    pub explain: bool,

    /// Prints one JSON object instead of text.
    #[arg(long)]
    pub json: bool,

    /// Sets a parameter ($key) of a Mitsuba scene.
    #[arg(long = "define", value_name = "KEY=VALUE", value_parser = definition)]
    pub defines: Vec<(String, String)>,

    #[command(flatten)]
    pub lightcuts: LightcutArguments,

    #[command(flatten)]
    pub vpl: VplArguments,
}

/// Where an image is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Device {
    /// Threads of this process.
    Cpu,
    /// The first adapter that wgpu finds, or the one that WGPU_ADAPTER_NAME names.
    Gpu,
}

/// How light is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Path tracing with next-event estimation and multiple importance sampling.
    Path,
    /// The same through participating media, by null collisions.
    Volpath,
    /// The same by decomposition tracking and residual ratio tracking.
    VolpathDecomposition,
    /// Paths through participating media by reuse among pixels and frames: --spp counts frames.
    RestirVolume,
    /// Direct light only.
    Direct,
    /// Direct light by cuts through a light tree that blocks of pixels share; samples are frames.
    Lightcuts,
    /// Path tracing by tiles of 16 pixels that share their paths; samples are frames.
    PathReuse,
    /// Direct light by reuse among pixels and frames; samples are frames.
    RestirDi,
    /// The same, cheaper and biased.
    RestirDiBiased,
    /// Indirect light by reuse of the points that send it, biased; direct light as restir-di.
    RestirGi,
    /// ReSTIR path tracing, one tree a frame, with reuse from the frame before: --spp counts frames.
    RestirPt,
    /// ReSTIR path tracing in independent frames of 32 trees.
    RestirPtOffline,
    /// Indirect light by a lighting grid hierarchy over virtual point lights: --spp counts frames.
    VplGrid,
    /// Indirect light by a sum over virtual point lights.
    VplBrute,
}

/// How paths are carried between pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mapping {
    /// Random replay up to the first vertices that can be reconnected.
    Hybrid,
    /// Reconnection to the second surface.
    Reconnection,
}

impl Method {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Volpath => "volpath",
            Self::VolpathDecomposition => "volpath-decomposition",
            Self::RestirVolume => "restir-volume",
            Self::Direct => "direct",
            Self::Lightcuts => "lightcuts",
            Self::PathReuse => "path-reuse",
            Self::RestirDi => "restir-di",
            Self::RestirDiBiased => "restir-di-biased",
            Self::RestirGi => "restir-gi",
            Self::RestirPt => "restir-pt",
            Self::RestirPtOffline => "restir-pt-offline",
            Self::VplGrid => "vpl-grid",
            Self::VplBrute => "vpl-brute",
        }
    }

    /// Whether it shows paths of one and two edges only.
    pub fn is_direct(self) -> bool {
        matches!(
            self,
            Self::Direct | Self::Lightcuts | Self::RestirDi | Self::RestirDiBiased
        )
    }

    /// Whether its emitters may be chosen by any of the light samplers.
    pub fn chooses_lights(self) -> bool {
        (self.is_direct() && self != Self::Lightcuts) || self == Self::Path
    }

    /// Whether it knows participating media.
    pub fn has_media(self) -> bool {
        matches!(
            self,
            Self::Volpath | Self::VolpathDecomposition | Self::RestirVolume
        )
    }

    /// Whether it makes frames with a camera that may move.
    pub fn has_motion(self) -> bool {
        let alone = [
            Self::Path,
            Self::Volpath,
            Self::VolpathDecomposition,
            Self::Direct,
            Self::Lightcuts,
            Self::PathReuse,
        ];
        !alone.contains(&self) && !self.is_vpl()
    }

    /// Whether it makes one frame after another.
    pub fn makes_frames(self) -> bool {
        !matches!(
            self,
            Self::Path | Self::Volpath | Self::VolpathDecomposition | Self::Direct
        )
    }

    /// Whether its indirect light comes from virtual point lights.
    pub fn is_vpl(self) -> bool {
        matches!(self, Self::VplGrid | Self::VplBrute)
    }
}

/// A camera's motion from each frame to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// By a vector.
    Translation([f32; 3]),
    /// About the middle of the image, by an angle in degrees.
    Orbit(f32),
}

/// Parses the command line. In the other case what there is to say has been said and the program ends.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Arguments, ExitCode> {
    Arguments::try_parse_from(arguments).map_err(|error| match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // A closed pipe is nothing to complain about.
            error.print().ok();
            ExitCode::SUCCESS
        }
        _ => {
            // The message ends where the usage begins.
            let text = error.to_string();
            let message = text.split("\n\nUsage:").next().unwrap_or_default();
            eprintln!(
                "{}",
                one_line(message.split("\n\nFor more").next().unwrap_or_default())
            );
            ExitCode::from(2)
        }
    })
}

fn lights(text: &str) -> Result<LightChoosing, String> {
    text.parse().map_err(|_| {
        let names = LightChoosing::ALL.map(LightChoosing::name).join(", ");
        format!("not one of {names}")
    })
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

fn definition(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err("not of the form key=value".to_owned()),
    }
}
