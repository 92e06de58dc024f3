//! Materials as data, and the BSDFs with explicit lobes that they become at a surface point.

mod bsdf;
mod component;
mod component_row;
mod error;
mod everywhere;
mod flat;
mod fresnel;
mod glossy;
mod glossy_lanes;
mod images;
mod microfacet;
mod relief;
mod resolve;
mod rough_coat;
mod rows;
mod validate;

pub use bsdf::{Bsdf, BsdfSample, BsdfValue, LobeSample};
pub use component_row::ComponentRow;
pub use error::MaterialError;
pub use flat::{FlatMaterials, FlatTexture};
pub(crate) use glossy::{GlossyLook, GlossyRow};
pub use glossy_lanes::{GlossyColumns, GlossyLanes, GlossyScattering, GlossyVertices};
pub(crate) use glossy_lanes::{GlossyMaterials, ScatterGlossy, StoreGlossy};
pub(crate) use relief::Along;
pub use relief::Relief;

use crate::{ColorTexture, FloatTexture, Rgb};

/// Microfacet normal distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Microfacet {
    /// Trowbridge–Reitz.
    #[default]
    Ggx,
    /// Beckmann.
    Beckmann,
}

/// Roughness of a microfacet surface.
#[derive(Clone, Debug)]
pub struct Roughness {
    /// Normal distribution.
    pub distribution: Microfacet,
    /// `α` along the tangent.
    pub alpha_u: FloatTexture,
    /// `α` along the bitangent.
    pub alpha_v: FloatTexture,
}

/// Complex index of refraction `eta + i k` of a conductor, relative to the outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConductorIor {
    /// Real part.
    pub eta: Rgb,
    /// Imaginary part.
    pub k: Rgb,
}

/// Layers of [`Material::Layered`].
#[derive(Clone, Debug)]
pub struct Layers {
    /// Share of a clear coat of index 1.5.
    pub coat: FloatTexture,
    /// Its perceptual roughness (`α` is the square).
    pub coat_roughness: FloatTexture,
    /// Colour of a sheen below the coat; black for none.
    pub sheen: ColorTexture,
    /// Its perceptual roughness.
    pub sheen_roughness: FloatTexture,
}

/// A material as data. All but [`Material::Dielectric`], [`Material::ThinDielectric`],
/// [`Material::Null`] and transmissive [`Material::MetallicRoughness`] are one-sided (black from
/// behind) unless wrapped in [`Material::TwoSided`].
#[derive(Clone, Debug)]
pub enum Material {
    /// Lambertian reflection.
    Diffuse {
        /// Albedo.
        reflectance: ColorTexture,
    },
    /// A perfect mirror without Fresnel.
    Mirror {
        /// Reflectance.
        reflectance: ColorTexture,
    },
    /// A conductor; smooth where `roughness` is `None`.
    Conductor {
        /// Complex index of refraction.
        ior: ConductorIor,
        /// `None` for a smooth surface.
        roughness: Option<Roughness>,
        /// Multiplies the reflection.
        specular_reflectance: ColorTexture,
    },
    /// A dielectric boundary; smooth where `roughness` is `None`.
    Dielectric {
        /// Interior over exterior index of refraction.
        eta: f32,
        /// `None` for a smooth surface.
        roughness: Option<Roughness>,
        /// Multiplies the reflection.
        specular_reflectance: ColorTexture,
        /// Multiplies the transmission.
        specular_transmittance: ColorTexture,
    },
    /// A thin slab of a dielectric: light passes unbent, inner reflections summed.
    ThinDielectric {
        /// Interior over exterior index of refraction.
        eta: f32,
        /// Multiplies the reflection.
        specular_reflectance: ColorTexture,
        /// Multiplies the transmission.
        specular_transmittance: ColorTexture,
    },
    /// A dielectric coat over a diffuse base (Mitsuba's `plastic` and `roughplastic`).
    Plastic {
        /// Interior over exterior index of refraction.
        eta: f32,
        /// Albedo of the base.
        diffuse_reflectance: ColorTexture,
        /// Multiplies the coat's reflection.
        specular_reflectance: ColorTexture,
        /// Whether colour shifts by inner scattering are accounted for.
        nonlinear: bool,
        /// `None` for a smooth coat.
        roughness: Option<Roughness>,
    },
    /// glTF 2.0 metallic-roughness, with KHR transmission (thin) and ior.
    MetallicRoughness {
        /// Base colour.
        base_color: ColorTexture,
        /// Metalness.
        metallic: FloatTexture,
        /// Perceptual roughness (`α` is its square).
        roughness: FloatTexture,
        /// Share of the dielectric base that transmits.
        transmission: FloatTexture,
        /// Index of refraction of the dielectric.
        ior: f32,
    },
    /// A sheen and a clear coat over another material, which must be an opaque
    /// [`Material::MetallicRoughness`] (`KHR_materials_sheen`, `KHR_materials_clearcoat`).
    Layered {
        /// What lies below.
        base: Box<Material>,
        /// What lies on it.
        layers: Box<Layers>,
    },
    /// `(1 − weight) · first + weight · second`.
    Blend {
        /// Share of `second`.
        weight: FloatTexture,
        /// Material at weight 0.
        first: Box<Material>,
        /// Material at weight 1.
        second: Box<Material>,
    },
    /// Nothing at all: light passes, unchanged and unbent. For shapes that only bound media.
    Null,
    /// A one-sided material seen from both sides.
    TwoSided {
        /// Seen from the side of the normal.
        front: Box<Material>,
        /// Seen from the other side; `None` for the same material, [`Material::Null`] where light
        /// passes from there.
        back: Option<Box<Material>>,
    },
    /// A material whose shading normals are turned by a map of normals or heights. Around all
    /// others, never within one.
    Relief {
        /// What turns the normals.
        relief: Box<Relief>,
        /// What scatters light.
        base: Box<Material>,
    },
}

#[cfg(test)]
mod tests;
