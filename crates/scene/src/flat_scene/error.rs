//! What has no flat form.

use std::fmt;

/// Why a scene has no flat form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlatError {
    /// It has spheres.
    Spheres,
    /// It has instances of meshes that are not copied.
    Instances,
    /// It has participating media.
    Media,
    /// The material of this index lets light pass, has textures of something else than the
    /// reflectance of diffuse surfaces, mirrors and conductors, has Beckmann's microfacets, or is
    /// glTF's.
    Material(usize),
}

impl fmt::Display for FlatError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spheres => write!(f, "spheres have no flat form"),
            Self::Instances => write!(f, "instances have no flat form"),
            Self::Media => write!(f, "participating media have no flat form"),
            Self::Material(index) => write!(
                f,
                "material {index} has no flat form: only diffuse surfaces, mirrors, and conductors, dielectrics and plastics (smooth or \
                 GGX) and blends of them have, with textures of the reflectance of the first three"
            ),
        }
    }
}

impl std::error::Error for FlatError {}
