//! Importers: scene, mesh and image files to [`SceneDescription`](crate::SceneDescription)s.

mod error;
mod fit;
mod gltf;
mod image;
mod load;
mod loaded;
mod mitsuba;
mod normals;
mod obj;
mod ply;
mod transform;
mod vol;
mod xml;

pub use self::gltf::parse_gltf;
pub use self::image::{Encoding, parse_image, read_image};
pub use error::{ImportError, Location, Position};
pub use load::load;
pub use loaded::{Defines, Loaded, Warning};
pub use mitsuba::parse_mitsuba;
pub use obj::{parse_obj, read_obj};
pub use ply::{parse_ply, read_ply};
pub use vol::{VolumeGrid, parse_vol, read_vol};
