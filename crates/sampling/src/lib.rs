//! Random numbers, measures and densities, warps and discrete distributions for light transport.
#![forbid(unsafe_code)]

mod alias;
mod frame;
mod measure;
mod morton;
mod octahedral;
mod piecewise;
mod piecewise2d;
mod rng;
mod sobol;
mod sum;
mod uniform;
mod warp;
mod weights;

pub use alias::{AliasEntry, AliasTable};
pub use frame::Frame;
pub use glam;
pub use measure::{Area, Density, Measure, PrimarySample, SolidAngle, balance_heuristic, power_heuristic};
pub use morton::{
    BoundsError, MortonGrid, morton30_decode, morton30_encode, morton63_decode, morton63_encode,
};
pub use octahedral::{
    octahedral_decode, octahedral_encode, octahedral_from_solid_angle, octahedral_pack16, octahedral_pack32,
    octahedral_to_solid_angle, octahedral_unpack16, octahedral_unpack32,
};
pub use piecewise::{PiecewiseConstant1d, PiecewiseSample};
pub use piecewise2d::{PiecewiseConstant2d, PiecewiseSample2d};
pub use rng::{CounterRng, PathSeed, threefry4x32};
pub use sobol::SobolSampler;
pub use sum::{CompensatedSum, Real, pairwise_sum, pairwise_sum_iter};
pub use uniform::{
    Choice, ONE_MINUS_EPSILON, choose, choose_pmf, f32_from_u32, f64_from_u64, remap, u32_from_f32,
};
pub use warp::{
    Beckmann, ConcentricDisk, CosineHemisphere, FreeFlight, Ggx, MicrofacetDistribution, PolarDisk,
    SphericalRectangle, SphericalRectangleSample, SphericalTriangle, SphericalTriangleSample, Tent,
    UniformCone, UniformHemisphere, UniformSphere, UniformTriangle, VonMisesFisher, sin_cos_turns,
    triangle_solid_angle,
};
pub use weights::WeightsError;
