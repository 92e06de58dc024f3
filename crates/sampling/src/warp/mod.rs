//! Warps: maps from uniforms in the unit square to points and directions of a known density.
//!
//! Every warp is a type with three operations: `sample` maps explicit uniforms `u` in [0, 1)² to a point,
//! `density` is its density `p` in the measure that the return type names, and `invert` maps a point back to its `u`
//! (so that a path can be expressed in primary sample space, whatever technique produced it). They satisfy
//! `p(sample(u)) · |∂sample/∂u| = 1`.

mod beckmann;
mod disk;
mod erf;
mod ggx;
mod hemisphere;
mod microfacet;
#[cfg(test)]
mod properties;
mod turn;

pub use beckmann::Beckmann;
pub use disk::{ConcentricDisk, PolarDisk};
pub use ggx::Ggx;
pub use hemisphere::{CosineHemisphere, UniformHemisphere};
pub use microfacet::MicrofacetDistribution;
pub use turn::sin_cos_turns;
