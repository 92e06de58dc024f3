mod beckmann;
mod cone;
mod disk;
mod erf;
mod exponential;
mod ggx;
mod hemisphere;
mod microfacet;
#[cfg(test)]
mod properties;
mod sphere;
mod tent;
mod triangle;
mod turn;
mod vmf;

pub use beckmann::Beckmann;
pub use cone::UniformCone;
pub use disk::{ConcentricDisk, PolarDisk};
pub use exponential::FreeFlight;
pub use ggx::Ggx;
pub use hemisphere::{CosineHemisphere, UniformHemisphere};
pub use microfacet::MicrofacetDistribution;
pub use sphere::UniformSphere;
pub use tent::Tent;
pub use triangle::UniformTriangle;
pub use turn::sin_cos_turns;
pub use vmf::VonMisesFisher;
