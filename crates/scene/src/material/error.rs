//! Errors of a material.

use std::error::Error;
use std::fmt;

/// Why a material is refused. `parameter` names the field of [`Material`](crate::Material).
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MaterialError {
    /// A colour has a negative or non-finite component (for an image: a texel times the scale).
    Color {
        /// Field.
        parameter: &'static str,
    },
    /// A share (metalness, transmission, blend weight) is negative or not finite.
    Share {
        /// Field.
        parameter: &'static str,
    },
    /// A roughness is not positive and finite.
    Roughness {
        /// Field.
        parameter: &'static str,
    },
    /// An index of refraction is not positive and finite, or outside what the material allows.
    IndexOfRefraction {
        /// Field.
        parameter: &'static str,
    },
    /// A texture's transform is not finite.
    Transform {
        /// Field.
        parameter: &'static str,
    },
    /// A transmissive material inside [`Material::TwoSided`](crate::Material::TwoSided): it has two
    /// sides already.
    TransmissiveTwoSided,
    /// A [`Material::Relief`](crate::Material::Relief) within another material.
    NestedRelief,
    /// A number of a relief is not finite.
    Relief,
    /// A [`Material::Layered`](crate::Material::Layered) over what is no opaque
    /// [`Material::MetallicRoughness`](crate::Material::MetallicRoughness).
    Layers,
    /// Blends and sides nest deeper than [`Material::MAX_DEPTH`](crate::Material::MAX_DEPTH).
    TooDeep,
    /// Blends and sides hold more than [`Material::MAX_LEAVES`](crate::Material::MAX_LEAVES)
    /// materials.
    TooManyLeaves,
}

impl fmt::Display for MaterialError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Color { parameter } => write!(f, "{parameter} has a negative or non-finite component"),
            Self::Share { parameter } => write!(f, "{parameter} is negative or not finite"),
            Self::Roughness { parameter } => write!(f, "{parameter} is not positive and finite"),
            Self::IndexOfRefraction { parameter } => write!(
                f,
                "{parameter} is not an index of refraction that this material can have"
            ),
            Self::Transform { parameter } => write!(f, "the texture transform of {parameter} is not finite"),
            Self::TransmissiveTwoSided => write!(f, "a transmissive material cannot be made two-sided"),
            Self::NestedRelief => write!(f, "a relief can only be around all of a material"),
            Self::Relief => write!(f, "the scale of a relief is not finite"),
            Self::Layers => write!(f, "layers can only be on an opaque metallic-roughness material"),
            Self::TooDeep => write!(f, "materials nest too deeply"),
            Self::TooManyLeaves => write!(f, "a blended or two-sided material has too many parts"),
        }
    }
}

impl Error for MaterialError {}
