//! The interface of a renderer: geometry, scattering, lighting.

mod end;
mod geometry;
mod lighting;
mod scattering;
mod suffix;

pub(crate) use end::End;
pub(crate) use geometry::Sight;
pub use geometry::{Place, RayKind, WorldGeometry};
pub use lighting::{Connection, Endpoint, EndpointDensity, WorldLighting};
pub(crate) use scattering::max_roughness;
pub use scattering::{LobeDirection, MAX_LOBES, Scattering, WorldScattering};
pub use suffix::{Suffix, SuffixLight, SuffixLimits};

/// A scene at one moment, as shift mappings see it: the previous frame is another `World`.
///
/// A renderer implements the three parts; every type that has all of them is a `World`.
///
/// Directions are unit vectors in world space that point away from the vertex. Colours have three
/// channels. Every method is a pure function with the same result, bit for bit, for the same
/// arguments: random replay and the invertibility of shifts depend on that.
pub trait World: WorldGeometry + WorldScattering + WorldLighting {}

impl<W: WorldGeometry + WorldScattering + WorldLighting + ?Sized> World for W {}
