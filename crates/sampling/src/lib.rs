//! Random numbers, measures and densities, warps and discrete distributions for light transport.
//!
//! | what | where | exact, tested and portable how |
//! |---|---|---|
//! | random numbers by place: seed, pixel, sample, dimension | [`CounterRng`], [`PathSeed`], [`threefry4x32`] | integers; WGSL computes the same bits |
//! | the same for the passes of a frame | [`FramePasses`] | parts of a stream that do not overlap |
//! | stratified numbers | [`SobolSampler`] | integers; nets counted exactly |
//! | the same, shared out among neighbouring pixels | [`BlueNoiseSampler`] | integers; nets of pixels counted exactly |
//! | one of the three, chosen by a setting | [`PointSet`], [`PointStream`] | as each |
//! | bits → numbers, one number used twice, choice among a few | [`f32_from_u32`], [`f64_from_u64`], [`u32_from_f32`], [`remap`], [`choose`] | never 1, never a zero weight |
//! | choice among many | [`AliasTable`] | the pmf is the one realised, by exact counts; integers |
//! | environment maps, tabulated densities | [`PiecewiseConstant1d`], [`PiecewiseConstant2d`] | the density is the one realised; monotone in `u`; integers |
//! | densities that carry their measure, MIS heuristics | [`Density`], [`balance_heuristic`], [`power_heuristic`] | mixing measures does not compile |
//! | points on disks, spheres, triangles; lobes; distances | [`CosineHemisphere`], [`UniformCone`], [`SphericalTriangle`], [`Ggx`], [`VonMisesFisher`], [`FreeFlight`], … | a sample's density is the inverse's Jacobian |
//! | the unit disk | [`ConcentricDisk`], [`PolarDisk`] | |
//! | the same bits in eight lanes | [`FrameLanes`], [`f32_from_u32_lanes`] | bit for bit |
//! | | [`power_heuristic_lanes`], [`sin_cos_turns_lanes`] | bit for bit |
//! | sine and cosine of turns, solid angles of triangles | [`sin_cos_turns`], [`triangle_solid_angle`] | |
//! | the angle of a point in turns | [`turn_of`], [`turn_of_lanes`] | WGSL has the same polynomial |
//! | any of those directions, and those of other crates | [`DirectionDistribution`], [`Oriented`], [`with_density`] | a sample's density is that of its direction, bit for bit |
//! | frames | [`Frame`] | orthonormal to 5·10⁻⁷ |
//! | directions in a square, in 32 or 16 bits | [`octahedral_encode`], [`octahedral_pack32`], [`octahedral_pack16`] and their inverses [`octahedral_decode`], [`octahedral_unpack32`], [`octahedral_unpack16`]; [`octahedral_from_solid_angle`] | `snorm` packing bit for bit as WGSL's |
//! | linear RGB and its luminance | [`Rgb`], [`luminance`] by [`LUMINANCE`] | |
//! | passes over slices, on any number of threads | [`parallel`] | the same bits |
//! | sums with the same bits in any order | [`FixedSum`], [`FixedMean`] | integers; saturate, and say so |
//! | sums that keep their small terms | [`CompensatedSum`], [`pairwise_sum`] | |
//!
//! # What a renderer writes
//!
//! ```
//! use lightshed_sampling::{CounterRng, PiecewiseConstant2d};
//!
//! // An environment map of 4 × 2 pixels with a bright one; its sampler reports densities on the
//! // unit square.
//! let radiance = [0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 90.0, 2.0];
//! let map = PiecewiseConstant2d::new(&radiance, 4)?;
//!
//! let mean = |pixel: u32| {
//!     let sum: f32 = (0..256)
//!         .map(|sample| {
//!             let mut rng = CounterRng::new(1, pixel, sample);
//!             let s = map.sample(rng.next_2d());
//!             radiance[(s.cell[1] * 4 + s.cell[0]) as usize] / s.pdf.value()
//!         })
//!         .sum();
//!     sum / 256.0
//! };
//! // Sampled in proportion to the integrand: no noise.
//! assert!((mean(0) - 99.0 / 8.0).abs() < 1e-3);
//! # Ok::<(), lightshed_sampling::WeightsError>(())
//! ```
//!
//! The example `sampling_user` estimates an integral that is hard for uniform samples by uniform,
//! importance-sampled and stratified samples.
//!
//! # Conventions
//!
//! - Randomness enters as explicit uniform numbers in [0, 1) or as words, a form that ports to a
//!   shader. If the number of draws varies, functions take `&mut impl rand::Rng`; [`CounterRng`]
//!   and [`SobolSampler`] implement it.
//! - Constructors validate and return a `Result`; sampling neither allocates nor panics, and finite
//!   input gives finite output.
//! - A density names its measure: `pdf` of a point on the unit interval or square is with respect
//!   to length or area there; all others use [`Density<M>`].
//! - Sums that grow are compensated or `f64` inside and rounded once.
#![forbid(unsafe_code)]

mod alias;
mod blue_noise;
mod color;
mod direction;
mod fixed;
mod frame;
mod linked;
mod measure;
mod octahedral;
pub mod parallel;
mod passes;
mod piecewise;
mod piecewise2d;
mod point_set;
mod rng;
mod scrambling;
mod sobol;
mod sobol_directions;
mod sum;
mod uniform;
mod warp;
mod weights;

pub use alias::{AliasEntry, AliasTable};
pub use blue_noise::BlueNoiseSampler;
pub use color::{LUMINANCE, Rgb, luminance};
pub use direction::{DirectionDistribution, Oriented, with_density};
pub use fixed::{FixedMean, FixedSum};
pub use frame::{Frame, FrameLanes};
pub use glam;
pub use lightshed_lanes as lanes;
pub use measure::{
    Area, Density, Length, Measure, PrimarySample, SolidAngle, balance_heuristic, power_heuristic,
    power_heuristic_lanes,
};
pub use octahedral::{
    octahedral_decode, octahedral_encode, octahedral_from_solid_angle, octahedral_pack16, octahedral_pack32,
    octahedral_to_solid_angle, octahedral_unpack16, octahedral_unpack32,
};
pub use passes::{FrameNumbers, FramePasses, PassNumbers, TooManyPasses};
pub use piecewise::{PiecewiseConstant1d, PiecewiseSample};
pub use piecewise2d::{PiecewiseConstant2d, PiecewiseLanes2d, PiecewiseSample2d};
pub use point_set::{PointSet, PointStream};
pub use rand;
pub use rng::{CounterRng, PathSeed, threefry4x32};
pub use sobol::{SobolSampler, SobolScrambles};
pub use sum::{CompensatedSum, Real, pairwise_sum, pairwise_sum_iter};
pub use uniform::{
    Choice, ONE_MINUS_EPSILON, choose, choose_pmf, f32_from_u32, f32_from_u32_lanes, f64_from_u64, remap,
    u32_from_f32,
};
pub use warp::{
    Beckmann, ConcentricDisk, CosineHemisphere, FreeFlight, Ggx, GgxLanes, MicrofacetDistribution, PolarDisk,
    SphericalRectangle, SphericalRectangleSample, SphericalTriangle, SphericalTriangleSample, Tent,
    UniformCone, UniformHemisphere, UniformSphere, UniformTriangle, VonMisesFisher, sin_cos_turns,
    sin_cos_turns_lanes, triangle_solid_angle, turn_of, turn_of_lanes,
};
pub use weights::WeightsError;

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/sampling.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
