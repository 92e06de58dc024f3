//! A thin CPU reference integrator, film and image metrics.
//!
//! | what | where |
//! |---|---|
//! | unidirectional path tracing; direct light by itself | [`PathTracer`], [`DirectLight`] |
//! | paths through participating media | [`VolumePathTracer`] |
//! | emitters chosen for the point that they light | [`LightSelection`], [`SelectedDirectLight`], [`SelectedPathTracer`] |
//! | direct light by cuts through a light tree that pixels share | [`Lightcuts`] |
//! | what the render loop asks of a method | [`PixelEstimator`] |
//! | samples of every pixel until a budget is spent, on any number of threads | [`render`], [`RenderOptions`], [`RenderOutcome`] |
//! | whole frames, where pixels or frames reuse from each other | [`FrameMethod`], [`render_frames`], [`CameraMotion`], [`RayCounts`] |
//! | path tracing by tiles that share what is behind their first vertices | [`PathReuse`] |
//! | direct light by reuse among pixels and frames | [`RestirDi`], [`EndpointSampler`] |
//! | indirect light by reuse, biased, to compare with | [`RestirGi`] |
//! | paths through participating media by reuse among pixels and frames | [`RestirVolume`] |
//! | mean and variance of every pixel | [`Film`], [`PixelStatistics`] |
//! | linear images; OpenEXR and PNG files | [`RgbImage`], [`read_exr`], [`OutputTarget`] |
//! | how far an image is from a reference | [`ImageComparison`], [`mean_squared_error`], [`structural_similarity`], … |
//!
//! The integrator is one guest of the libraries beneath it: it reaches nothing that another renderer could not.
//!
//! # Features
//!
//! - `flip`: the image metric ꟻLIP, which compiles C++.

mod camera_motion;
mod cpu_time;
mod direct;
mod film;
mod frames;
mod image;
mod light_selection;
mod metrics;
mod output;
mod path;
mod ray_counts;
mod ray_tally;
mod render;
mod restir;
mod scene_world;
mod statistics;
mod volume;
mod vpl;

pub use camera_motion::{CameraMotion, CameraMotionError};
pub use cpu_time::process_cpu_seconds;
pub use direct::lightcuts::{
    CutTree, LightcutError, LightcutOptions, Lightcuts, MAX_CUT_BLOCK, MAX_SUBTREES,
};
pub use direct::plain::{DirectLight, DirectLightError, MAX_DIRECT_SAMPLES};
pub use direct::selected::SelectedDirectLight;
pub use film::{Film, FilmSizeError, FilmTile, TILE_SIZE};
pub use frames::{FrameMethod, render_frames};
pub use image::{ImageError, MAX_PIXELS, RgbImage};
pub use light_selection::{
    ChosenLight, LightChoosing, LightSelection, UnknownLightChoosing, scene_lights, shading_point,
};
#[cfg(feature = "flip")]
pub use metrics::flip;
pub use metrics::{
    ImageComparison, MetricError, RELATIVE_MSE_EPSILON, SSIM_WINDOW, mean_absolute_percentage_error,
    mean_squared_error, relative_mean, relative_mean_squared_error, structural_similarity,
};
pub use output::{
    ExrError, ImageFormat, OutputError, OutputTarget, linear_to_srgb, read_exr, write_exr, write_png,
};
pub use path::PathTracer;
pub use path::reuse::PathReuse;
pub use path::selected::SelectedPathTracer;
pub use ray_counts::RayCounts;
pub use render::{
    Budget, MAX_BATCH, MAX_THREADS, PixelEstimator, Progress, RenderError, RenderOptions, RenderOutcome,
    SampleId, render,
};
pub use restir::pt::{
    MAX_CANDIDATES, MAX_ROUNDS, Neighbourhood, PathMapping, RestirPt, RestirPtError, RestirPtOptions,
};
pub use restir::{EndpointSampler, LitPoint, RestirDi, RestirDiError, RestirDiSettings, RestirGi};
pub use scene_world::{PixelSensor, SceneVertex, SceneWorld};
pub use statistics::PixelStatistics;
pub use volume::restir::{MAX_SCATTERINGS, RestirVolume, RestirVolumeError, RestirVolumeOptions};
pub use volume::volpath::{VolumePathTracer, VolumeTracking};
pub use vpl::{
    MAX_FILTER_ITERATIONS, MAX_LIGHT_PATHS, MAX_VPL_BOUNCES, ShadowTargets, VplBrute, VplError, VplGrid,
    VplGridOptions, VplOptions, VplSet,
};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/integrator.md")]
struct Guide;

/// So is that of the guide to new methods.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/adding-a-method.md")]
struct GuideToMethods;
