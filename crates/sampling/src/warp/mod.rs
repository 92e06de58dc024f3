mod beckmann;
mod cone;
mod disk;
mod erf;
mod exponential;
mod ggx;
mod ggx_lanes;
mod hemisphere;
mod microfacet;
#[cfg(test)]
mod properties;
mod solid_angle;
mod sphere;
mod spherical_rectangle;
mod spherical_triangle;
mod tent;
mod triangle;
mod turn;
mod vmf;

pub use beckmann::Beckmann;
pub use cone::UniformCone;
pub use disk::{ConcentricDisk, PolarDisk};
pub use exponential::FreeFlight;
pub use ggx::Ggx;
pub use ggx_lanes::GgxLanes;
pub use hemisphere::{CosineHemisphere, UniformHemisphere};
pub use microfacet::MicrofacetDistribution;
pub use solid_angle::triangle_solid_angle;
pub use sphere::UniformSphere;
pub use spherical_rectangle::{SphericalRectangle, SphericalRectangleSample};
pub use spherical_triangle::{SphericalTriangle, SphericalTriangleSample};
pub use tent::Tent;
pub use triangle::UniformTriangle;
pub use turn::{sin_cos_turns, sin_cos_turns_lanes, turn_of, turn_of_lanes};
pub use vmf::VonMisesFisher;

/// `x` within [low, high]; NaN becomes `low`, where `clamp` would let it through.
#[inline(always)]
fn clamp_or_low(x: f32, low: f32, high: f32) -> f32 {
    x.max(low).min(high)
}
