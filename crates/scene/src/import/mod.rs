//! Importers: scene, mesh and image files to [`SceneDescription`](crate::SceneDescription)s.
//!
//! PLY, OBJ and Mitsuba's volume grids are always read. The rest are features, off by default,
//! since their decoders take longer to compile than all other code here: `mitsuba` (Mitsuba 3
//! XML), `pbrt` (pbrt-v4, NanoVDB), `gltf` (glTF and GLB), `images` (PNG, JPEG, Radiance HDR,
//! OpenEXR; both need it), and `importers` for all.

#[cfg(feature = "gltf")]
mod draco;
mod error;
mod fit;
#[cfg(any(feature = "gltf", feature = "mitsuba"))]
mod glow;
#[cfg(feature = "gltf")]
mod gltf;
#[cfg(feature = "pbrt")]
mod gz;
#[cfg(feature = "images")]
mod image;
#[cfg(any(feature = "mitsuba", feature = "pbrt"))]
mod ior;
mod limits;
mod load;
mod loaded;
mod loading;
mod look;
#[cfg(feature = "mitsuba")]
mod mitsuba;
#[cfg(feature = "pbrt")]
mod nanovdb;
mod normals;
mod obj;
#[cfg(feature = "pbrt")]
mod pbrt;
#[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
mod placed;
mod ply;
mod polygon;
#[cfg(any(feature = "mitsuba", feature = "pbrt"))]
mod primitives;
#[cfg(any(feature = "mitsuba", feature = "pbrt"))]
mod spd;
#[cfg(any(feature = "mitsuba", feature = "pbrt"))]
mod spectrum;
mod transform;
mod vol;
#[cfg(feature = "mitsuba")]
mod xml;

#[cfg(feature = "gltf")]
pub use self::gltf::{parse_gltf, parse_gltf_with};
#[cfg(feature = "images")]
pub use self::image::{Encoding, parse_image, read_image};
#[cfg(feature = "pbrt")]
pub use self::pbrt::parse_pbrt;
pub use error::{ImportError, Location, Position};
pub use limits::{LoadLimits, LoadResource};
pub use load::{load, load_with};
pub use loaded::{Defines, Loaded, Warning};
#[cfg(feature = "mitsuba")]
pub use mitsuba::{parse_mitsuba, parse_mitsuba_with};
#[cfg(feature = "pbrt")]
pub use nanovdb::parse_nanovdb;
pub use obj::{parse_obj, read_obj};
pub use ply::{parse_ply, read_ply};
pub(crate) use transform::move_mesh;
pub use vol::{VolumeGrid, parse_vol, read_vol};
