//! The row of numbers that a component is for shaders.

use crate::Rgb;
use bytemuck::{Pod, Zeroable};

/// A component of a BSDF as a shader reads it: 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ComponentRow {
    /// One of the constants of this type.
    pub kind: u32,
    /// From where it is seen: 0 the side of the normal, 1 the other, 2 both.
    pub side: u32,
    /// Share of the blend.
    pub weight: f32,
    /// Unnormalised probability of being chosen.
    pub importance: f32,
    /// Albedo, or what multiplies the reflection; of no meaning where there is a texture.
    pub color: Rgb,
    /// Roughness `α` along the tangent.
    pub alpha_u: f32,
    /// Real part of the index of refraction. Of dielectrics and plastics: interior over exterior
    /// index, of plastics then the largest channel of the base's albedo and, under rough coats, the
    /// number of the coat's table.
    pub eta: Rgb,
    /// Roughness `α` along the bitangent.
    pub alpha_v: f32,
    /// Imaginary part. Of dielectrics: what multiplies the transmission; of plastics:
    /// `ρ/(1 − ρ R_int)/η²` of the base.
    pub k: Rgb,
    /// In place of `color`: one more than the number of a texture, or 0.
    pub texture: u32,
}

const _: () = assert!(size_of::<ComponentRow>() == 64);

impl ComponentRow {
    /// Lambertian reflection.
    pub const DIFFUSE: u32 = 0;
    /// A perfect mirror.
    pub const MIRROR: u32 = 1;
    /// A smooth conductor.
    pub const SMOOTH_CONDUCTOR: u32 = 2;
    /// A conductor with GGX microfacets.
    pub const GGX_CONDUCTOR: u32 = 3;
    /// A smooth dielectric boundary, which reflects and transmits.
    pub const SMOOTH_DIELECTRIC: u32 = 4;
    /// One with GGX microfacets.
    pub const GGX_DIELECTRIC: u32 = 5;
    /// A thin slab of a dielectric.
    pub const THIN_DIELECTRIC: u32 = 6;
    /// A smooth dielectric coat over a diffuse base.
    pub const PLASTIC: u32 = 7;
    /// A coat with GGX microfacets over a diffuse base.
    pub const GGX_PLASTIC: u32 = 8;

    /// Whether it reflects like a mirror or lets light pass unscattered, and does nothing else.
    pub fn is_delta(&self) -> bool {
        [
            Self::MIRROR,
            Self::SMOOTH_CONDUCTOR,
            Self::SMOOTH_DIELECTRIC,
            Self::THIN_DIELECTRIC,
        ]
        .contains(&self.kind)
    }
}
