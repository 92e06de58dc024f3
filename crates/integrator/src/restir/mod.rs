//! Methods that resample: pixels reuse from neighbours and from earlier frames.

mod candidates;
mod di;
mod gi;
mod guiding;
mod held;
mod indirect;
mod light;
mod mutation;
mod passes;
pub(crate) mod primary;
pub(crate) mod pt;
pub(crate) mod suffix;
mod world;

pub use di::{RestirDi, RestirDiError, RestirDiSettings};
pub use gi::RestirGi;
pub use guiding::{GUIDE_UPDATES, GuideSource, GuidedWorlds, PathGuiding};
pub use world::WorldReuse;
