//! Participating media: density fields, majorants, free flight, transmittance and phase functions.
//!
//! The crate knows no scene: a medium is a [`DensityField`] `ρ(x) ≥ 0` in its own space and a
//! coefficient `k` of the user, so that extinction is `σ_t = k ρ` per unit of a ray's parameter
//! `t`. A [`FieldRay`] is the user's ray transformed into that space without normalising its
//! direction; `t` remains the user's distance.
//!
//! | what | where |
//! |---|---|
//! | densities | [`DenseGrid`], [`SparseGrid`], [`Grid8`], [`Grid4`], [`Homogeneous`], [`Procedural`], or a user's own [`DensityField`] |
//! | coarser versions of a grid | [`MipPyramid`] |
//! | look-ups in a grid | [`DensityAccessor`], [`DenseAccessor`] |
//! | bounds of densities along rays | [`MajorantGrid`] |
//! | where light collides, density known | [`regular_flight`], [`homogeneous_flight`], [`ray_marching_flight`], [`EquiAngular`] |
//! | the same, density not known | [`delta_tracking`], [`decomposition_tracking`], [`weighted_delta_tracking`], [`spectral_delta_tracking`] |
//! | how much light comes through, exactly | [`regular_depth`] |
//! | the same, unbiased | [`ratio_tracking`], [`residual_ratio_tracking`], [`delta_transmittance`], [`next_flight_transmittance`], [`power_series_transmittance`], [`unbiased_ray_marching`] |
//! | the same, unbiased, for several channels | [`spectral_ratio_tracking`], [`spectral_residual_ratio_tracking`]: [`SpectralTransmittance`] |
//! | the same, biased | [`ray_marching_transmittance`], [`ray_marching_depth`] |
//! | a user's own null-collision method | [`TentativeCollisions`] |
//! | where light scatters to | [`HenyeyGreenstein`], [`Draine`], [`Isotropic`], [`Blend`] |
//! | the same as a `DirectionDistribution` | [`ScatteredDirections`] |
//!
//! # Example
//!
//! ```
//! use lightshed_sampling::CounterRng;
//! use lightshed_volume::{
//!     DenseGrid, DensityField, FieldRay, Filter, Interval, MajorantGrid, delta_tracking, glam::Vec3,
//!     ratio_tracking,
//! };
//!
//! let grid = DenseGrid::from_fn([16, 16, 16], Filter::Trilinear, |[x, ..]| x as f32 / 16.0)?;
//! let majorants = MajorantGrid::new(&grid, 8.0)?;
//! // A ray through the grid; 16 voxels are two units of its parameter.
//! let ray = FieldRay::new(Vec3::new(0.0, 8.0, 8.0), Vec3::new(8.0, 0.0, 0.0));
//! let interval = Interval { t0: 0.0, t1: 2.0 };
//! let mut rng = CounterRng::new(1, 2, 3);
//!
//! let segments = || majorants.segments(&ray, interval);
//! let flight = delta_tracking(&mut grid.accessor(), &ray, segments(), 3.0, &mut rng);
//! assert!(flight.distance.is_none_or(|t| t < 2.0));
//! let transmittance = ratio_tracking(&mut grid.accessor(), &ray, segments(), 3.0, &mut rng);
//! assert!((0.0..=1.0).contains(&transmittance.value));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! - `parallel`: builds over a rayon pool. Same result, bit for bit.
#![forbid(unsafe_code)]

mod bounds;
mod collisions;
mod dda;
mod exponential;
mod field;
mod filter;
mod flight;
mod grid;
mod majorant;
mod mip;
mod phase;
mod regular;
mod spectral;
#[cfg(test)]
mod testing;
mod transmittance;
mod voxels;

pub use bounds::{FieldBounds, FieldRay, Interval};
pub use collisions::{TentativeCollision, TentativeCollisions};
pub use field::{
    DensityAccessor, DensityField, DensityRange, Homogeneous, Procedural, ProceduralAccessor, densities_at,
};
pub use filter::Filter;
pub use flight::{
    EquiAngular, EquiAngularSample, Flight, FlightGuiding, FlightGuidingError, GuidedFlight, KnownFlight,
    MAX_FLIGHT_CANDIDATES, WeightedFlight, decomposition_tracking, delta_tracking, guided_homogeneous_flight,
    guided_tracking, homogeneous_flight, ray_marching_flight, weighted_delta_tracking,
};
pub use glam;
pub use grid::{
    BrickAccessor, BrickGrid, BrickStorage, DenseAccessor, DenseBricks, DenseGrid, FilteredGrid, Grid4,
    Grid8, GridError, MAX_VOXELS, MAX_VOXELS_PER_AXIS, QuantizedBricks, SparseBricks, SparseGrid, VoxelBlock,
};
pub use lightshed_lanes as lanes;
pub use lightshed_sampling as sampling;
pub use majorant::{MAX_MAJORANTS, MajorantError, MajorantGrid, Segment, Segments};
pub use mip::{MAX_MIP_LEVELS, MipError, MipLevel, MipPyramid};
pub use phase::{
    Blend, Draine, HenyeyGreenstein, Isotropic, MAX_ASYMMETRY, MAX_DRAINE_ALPHA, PhaseError, PhaseFunction,
    PhaseSample, ScatteredDirections, ScatteringAngle,
};
pub use regular::{RegularDepth, regular_depth, regular_flight};
pub use spectral::{SpectralFlight, spectral_delta_tracking};
pub use transmittance::{
    Control, SpectralTransmittance, TransmittanceEstimate, delta_transmittance, next_flight_transmittance,
    power_series_transmittance, ratio_tracking, ray_marching_depth, ray_marching_transmittance,
    residual_ratio_tracking, spectral_ratio_tracking, spectral_residual_ratio_tracking,
    unbiased_ray_marching, unbiased_ray_marching_lookups,
};
pub use voxels::VoxelGrid;

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/volume.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
