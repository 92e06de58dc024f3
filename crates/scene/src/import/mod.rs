//! Importers: scene, mesh and image files to [`SceneDescription`](crate::SceneDescription)s.

mod error;
mod normals;
mod ply;

pub use error::{ImportError, Location, Position};
pub use ply::{parse_ply, read_ply};
