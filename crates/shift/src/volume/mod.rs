//! Paths through volumes: their coordinates, their contributions in a pixel, and the shift between
//! pixels.

mod follow;
mod path;
mod shift;
mod world;

pub use follow::{FollowPaths, path_target};
pub use path::{ConnectedEdge, MAX_SCATTERINGS, PathCoordinates, Step, VolumePath};
pub use shift::{VolumePathDomain, VolumePathShift};
pub use world::{ConnectionReach, EdgeEnd, Reflection, SensorPlace, Transmittance, VolumeWorld};
