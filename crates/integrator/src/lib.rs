//! Rendering methods on the CPU: thin users of the lower crates.
//!
//! | what | where |
//! |---|---|
//! | unidirectional path tracing; direct light by itself | [`PathTracer`], [`DirectLight`] |
//! | how any of them chooses emitters: by power, or for the point that they light | [`EmitterSampler`], [`LightSelection`] |
//! | directions by a guide; who is told of paths | [`DirectionGuide`], [`PathObserver`] |
//! | paths guided by what earlier frames found | [`GuidedPaths`], [`SceneField`] |
//! | light by Markov chain mixtures, without a list of lights | [`Mixture`] |
//! | paths that end in a cache of radiance, biased | [`CachedPaths`], [`PathEnding`] |
//! | paths through participating media | [`VolumePathTracer`] |
//! | the same by tiles that share what is behind their first collisions | [`VolumePathReuse`] |
//! | direct light by cuts through a light tree that pixels share | [`Lightcuts`] |
//! | all methods by name, with what they can do and their options | [`METHODS`], [`Method`], [`Stage`] |
//! | whichever method is best for a scene | [`Auto`], [`MethodRequest`] |
//! | a camera that moves from frame to frame | [`CameraMotion`] |
//! | path tracing by tiles that share what is behind their first vertices | [`PathReuse`] |
//! | direct light by reuse among pixels and frames | [`RestirDi`] |
//! | paths whose prefixes are drawn and whose suffixes are reused | [`RestirSuffix`] |
//! | indirect light by reuse, biased, to compare with | [`RestirGi`] |
//! | paths through participating media by reuse among pixels and frames | [`RestirVolume`] |
//!
//! Each method implements one of two traits of the crate [`film`], which has the render loops:
//! [`PixelEstimator`](film::PixelEstimator), if pixels are independent, or
//! [`FrameMethod`](film::FrameMethod). Methods use public items only, so another renderer can build
//! the same.

mod any_emitters;
mod auto;
mod built_lights;
mod cached;
mod camera_motion;
mod camera_ray;
mod direct;
mod emitter_sampler;
mod guided;
mod guided_lobes;
mod light_choosing;
mod light_selection;
mod light_training;
mod mixture;
mod path;
mod pixel_table;
mod ray_batch;
mod ray_cost;
mod registry;
mod restir;
mod reuse_frames;
mod scene_world;
mod visible_emission;
mod volume;
mod vpl;

pub use any_emitters::AnyEmitters;
pub use auto::{Auto, AutoFrames, AutoTask, Choice, LeftOut, MethodRequest, PilotRun, ShortGain, Trial};
pub use built_lights::BuiltLights;
pub use cached::{
    CacheEnding, CacheRule, CachedPaths, CachedPathsError, CachedPathsOptions, MAX_CACHE_PASSES,
    SceneVertices,
};
pub use camera_motion::{CameraMotion, CameraMotionError};
pub use direct::light::{
    DirectLight, DirectLightError, DirectLightOptions, MAX_CAMERA_STRATA, MAX_DIRECT_SAMPLES,
};
pub use direct::lightcuts::{
    CutTree, LightcutError, LightcutOptions, Lightcuts, MAX_CUT_BLOCK, MAX_SUBTREES,
};
pub use emitter_sampler::{ChosenLanes, EmitterSampler};
pub use guided::{
    FieldDirections, FieldRecorder, GuideError, GuideKind, GuidedHalf, GuidedPaths, GuidedPathsOptions,
    SceneField, UnknownGuide, guide_need,
};
pub use light_choosing::{LightChoosing, UnknownLightChoosing};
pub use light_selection::{LightSelection, scene_lights, shading_point};
pub use lightshed_caching as caching;
pub use lightshed_film as film;
pub use lightshed_guiding as guiding;
pub use lightshed_lanes as lanes;
pub use lightshed_lights as lights;
pub use lightshed_resampling as resampling;
pub use lightshed_sampling as sampling;
pub use lightshed_scene as scene;
pub use lightshed_scene::glam;
pub use lightshed_shift as shift;
pub use lightshed_spatial as spatial;
pub use mixture::{
    MAX_MIXTURE_STEPS, Mixture, MixtureError, MixtureOptions, MixtureSets, STATES, TILE_SIZES, UnknownSets,
};
pub use path::PathTracer;
pub use path::ending::{EndingVertex, NoEnding, PathEnding, VertexEnding};
pub use path::guide::{DirectionGuide, GuidedVertex, LEAST_SURVIVAL, MAX_GUIDE_SHARE, NoDirections, NoGuide};
pub use path::observer::{
    NoObserver, ObservedPath, PathArrival, PathContribution, PathDirection, PathObserver, PathVertex,
};
pub use path::reuse::PathReuse;
pub use registry::{
    METHODS, Method, MethodCapabilities, MethodEntry, MethodError, MethodOption, MethodValues, Motion,
    MovingMedia, PathDepth, Stage, StartMethod, Started,
};
pub use restir::pt::{
    MAX_CANDIDATES, MAX_ROUNDS, MAX_STEPS, Neighbourhood, OfflineSplit, PathMapping, RestirPt, RestirPtError,
    RestirPtOffline, RestirPtOptions,
};
pub use restir::suffix::{
    MAX_BORROWED, MAX_PREFIXES, MAX_SPACING, RestirSuffix, RestirSuffixError, RestirSuffixOptions,
};
pub use restir::{
    GUIDE_UPDATES, GuideSource, GuidedWorlds, PathGuiding, RestirDi, RestirDiError, RestirDiSettings,
    RestirGi, WorldReuse,
};

pub use scene_world::{PixelSensor, SceneVertex, SceneWorld};
pub use volume::restir::{MAX_SCATTERINGS, RestirVolume, RestirVolumeError, RestirVolumeOptions};
pub use volume::reuse::VolumePathReuse;
pub use volume::volpath::{VolumePathTracer, VolumeTracking};
pub use vpl::{
    MAX_FILTER_ITERATIONS, MAX_LIGHT_PATHS, MAX_VPL_BOUNCES, ShadowTargets, VplBrute, VplError, VplGrid,
    VplGridOptions, VplOptions, VplSet,
};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/integrator.md")]
struct Guide;

/// So is that of the guide to suffix reuse.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/suffixes.md")]
struct GuideToSuffixes;

/// So is that of the guide to new methods.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/adding-a-method.md")]
struct GuideToMethods;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
