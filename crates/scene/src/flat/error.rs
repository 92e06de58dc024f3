//! What has no flat form.

use std::fmt;

/// Why a scene cannot be laid flat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlatError {
    /// It has spheres.
    Spheres,
    /// It has participating media.
    Media,
    /// The material of this index lets light pass, has textures, or components other than diffuse, mirrors and conductors with GGX microfacets.
    Material(usize),
    /// It has emitters that are points, spots or directions.
    PointEmitters,
}

impl fmt::Display for FlatError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spheres => write!(f, "spheres have no flat form"),
            Self::Media => write!(f, "participating media have no flat form"),
            Self::Material(index) => write!(
                f,
                "material {index} has no flat form: only diffuse surfaces, mirrors, conductors (smooth or GGX) and blends of them \
                 without textures have"
            ),
            Self::PointEmitters => write!(f, "point, spot and directional emitters have no flat form"),
        }
    }
}

impl std::error::Error for FlatError {}
