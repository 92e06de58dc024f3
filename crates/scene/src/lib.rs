//! Geometry, materials with lobes, emitters, cameras, importers and ray queries.
//!
//! A scene goes through two stages. [`SceneDescription`] is plain data that importers, the built-in
//! scenes and users write. [`Scene`] is the form for ray tracing, and its constructor validates the
//! description.

mod accel;
pub mod builtin;
mod camera;
mod description;
mod emitter;
mod environment_directions;
mod error;
mod features;
mod fingerprint;
mod flat;
mod flat_scene;
mod image_blocks;
pub mod import;
mod material;
mod medium;
mod scene;
mod surface;
mod texture;

pub use accel::{Accelerator, AcceleratorKind, Hit, HitBatch, Ray, RayBatch, Sphere, intersect_triangle};
pub use camera::{Camera, CameraError, FilmMap, MAX_IMAGE_SIDE};
pub use description::{
    CameraDescription, DensityDescription, EmissionDescription, EmitterDescription, EnvironmentMap, FovAxis,
    Geometry, GridDescription, GridFilter, MediumBoundary, MediumDescription, MeshInstances,
    PhaseDescription, Projection, RenderSettings, SceneDescription, ShapeDescription, SphereGeometry,
    TriangleMesh,
};
pub use emitter::{
    EmittedRay, EmitterConnection, EmitterEndpoint, EmitterExtent, EmitterLanes, EmitterOrientation,
    EmitterOutline, EmitterSample, Emitters, EmittersByPower, EmittersIdentity, Environment,
    EnvironmentChoice, EnvironmentLanes, SkySampling, UnknownSkySampling,
};
pub use error::SceneError;
pub use features::SceneFeatures;
pub use flat::{FlatCamera, FlatDelta, FlatEmitter, FlatSky};
pub use flat_scene::{FlatError, FlatScene, FlatTriangle};
pub use glam;
pub use image_blocks::ImageBlocks;
pub use lightshed_bvh::Preset;
pub use lightshed_lanes as lanes;
pub use lightshed_sampling as sampling;
pub use lightshed_sampling::{Rgb, luminance};
pub use lightshed_volume as volume;
pub use material::{
    Bsdf, BsdfSample, BsdfValue, ComponentRow, ConductorIor, FlatMaterials, FlatTexture, GlossyColumns,
    GlossyLanes, GlossyScattering, GlossyVertices, Layers, LobeSample, Material, MaterialError, Microfacet,
    Relief, Roughness,
};
pub use medium::{GridField, Medium, MediumDensity, MediumEmission, MediumPhase, MediumSides, PhaseLobe};
pub use scene::{BuildOptions, Scene};
pub use surface::{DiffuseLanes, SurfacePoint};
pub use texture::{
    AxisWrap, Channel, Checkerboard, ColorTexture, Filter, FloatTexture, Image, ImageTexture, Place, Wrap,
};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/scene.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
