//! Paths, shift mappings between pixels, and the Jacobians of those mappings.
//!
//! | what | where |
//! |---|---|
//! | what a renderer brings | [`World`]: [`WorldGeometry`], [`WorldScattering`], [`WorldLighting`] |
//! | the paths behind a surface point, with their integrand and measure | [`PathDomain`] |
//! | a path in 64 bytes, and the directions that it takes | [`PathSample`], [`held_directions`] |
//! | candidates: trees of paths from the camera | [`TreeTracer`] |
//! | random replay, reconnection, hybrid | [`PathShift`] with [`Connectability`] |
//! | steps of Markov chains | [`PathMutator`] |
//! | prefixes, and the suffixes behind them | [`PrefixDomain`], [`PrefixTracer`], [`PrefixShift`] |
//! | one scattering event: copies of a vertex, a direction, a half vector | [`LocalShift`], [`VertexCopy`], [`DirectionCopy`], [`HalfVectorCopy`] |
//! | paths through volumes: their coordinates, their integrand, the shift between pixels | [`VolumePath`], [`VolumeWorld`], [`VolumePathShift`] |
//! | values and targets of such paths | [`FollowPaths`], [`path_target`], [`MAX_SCATTERINGS`] |
//! | whether a renderer's world keeps the laws that shifts rest on | [`check_world`] |
//! | determinants that know their measure | [`MeasuredJacobian`], [`reconnection_jacobian`] |
//!
//! [`PathDomain`] implements `Domain` and [`PathShift`] implements `ShiftMapping` of
//! `lightshed-resampling`, so its merges reuse paths among pixels and frames.
//!
//! Section and equation numbers refer to Lin 2022 (*High-Quality Sampling for Complex Effects in
//! Real-Time Ray Tracing*, ch. 6 and app. B).
#![forbid(unsafe_code)]

mod check;
mod connectability;
mod departure;
mod directions;
mod domain;
mod jacobian;
mod local;
mod mis;
mod mutation;
mod numbers;
mod path_shift;
mod prefix;
mod roulette;
mod sample;
mod suffix;
#[cfg(test)]
mod testing;
mod tracer;
mod volume;
mod walk;
mod world;

pub use check::{WorldFault, WorldFaults, WorldLaw, WorldTally, check_world};
pub use connectability::{Connectability, ConnectabilityError, Footprint};
pub use directions::{HeldDirection, held_directions};
pub use domain::{PathDomain, PathPart};
pub use jacobian::{MeasuredJacobian, reconnection_jacobian};
pub use lightshed_resampling as resampling;
pub use lightshed_sampling as sampling;
pub use lightshed_sampling::glam;
pub use local::{DirectionCopy, HalfVectorCopy, LocalShift, LocalVertex, VertexCopy};
pub use mutation::PathMutator;
pub use path_shift::PathShift;
pub use prefix::{PrefixDomain, PrefixFinding, PrefixSample, PrefixShift, PrefixStart, PrefixTracer};
pub use sample::{MAX_PATH_LENGTH, PathAnatomy, PathSample};
pub use suffix::trace_suffix;
pub use tracer::{Finding, TreeTracer};
pub use world::{
    Connection, Endpoint, EndpointDensity, LobeDirection, MAX_LOBES, Place, RayKind, Scattering, Suffix,
    SuffixLight, SuffixLimits, World, WorldGeometry, WorldLighting, WorldScattering,
};

pub use volume::{
    ConnectedEdge, ConnectionReach, EdgeEnd, FollowPaths, MAX_SCATTERINGS, PathCoordinates, Reflection,
    SensorPlace, Step, Transmittance, VolumePath, VolumePathDomain, VolumePathShift, VolumeWorld,
    path_target,
};

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/shift.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
