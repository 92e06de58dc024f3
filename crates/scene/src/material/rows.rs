//! Components as rows of numbers, for shaders.

use super::Material;
use super::bsdf::{Entry, Side};
use super::component::Component;
use super::microfacet::Distribution;
use crate::{ColorTexture, FloatTexture, Rgb};
use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// A component of a BSDF as a shader reads it: 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ComponentRow {
    /// One of [`ComponentRow::DIFFUSE`], [`ComponentRow::MIRROR`], [`ComponentRow::SMOOTH_CONDUCTOR`], [`ComponentRow::GGX_CONDUCTOR`].
    pub kind: u32,
    /// From where it is seen: 0 the side of the normal, 1 the other, 2 both.
    pub side: u32,
    /// Share of the blend.
    pub weight: f32,
    /// Unnormalised probability of being chosen.
    pub importance: f32,
    /// Albedo, or what multiplies the reflection.
    pub color: Rgb,
    /// Roughness `α` along the tangent.
    pub alpha_u: f32,
    /// Real part of the index of refraction.
    pub eta: Rgb,
    /// Roughness `α` along the bitangent.
    pub alpha_v: f32,
    /// Imaginary part.
    pub k: Rgb,
    /// Nothing.
    pub padding: u32,
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

    fn of(entry: &Entry) -> Option<Self> {
        let row = Self {
            side: match entry.side {
                Side::Front => 0,
                Side::Back => 1,
                Side::Both => 2,
            },
            weight: entry.weight,
            importance: entry.importance,
            ..Self::default()
        };
        match &entry.component {
            Component::Diffuse(diffuse) => Some(Self {
                kind: Self::DIFFUSE,
                color: diffuse.reflectance,
                ..row
            }),
            Component::Mirror(mirror) => Some(Self {
                kind: Self::MIRROR,
                color: mirror.reflectance,
                ..row
            }),
            Component::SmoothConductor(conductor) => Some(Self {
                kind: Self::SMOOTH_CONDUCTOR,
                color: conductor.tint,
                eta: conductor.eta,
                k: conductor.k,
                ..row
            }),
            Component::RoughConductor(conductor) => {
                let Distribution::Ggx(ggx) = conductor.distribution else {
                    return None;
                };
                let (alpha_u, alpha_v) = ggx.alpha();
                Some(Self {
                    kind: Self::GGX_CONDUCTOR,
                    color: conductor.smooth.tint,
                    eta: conductor.smooth.eta,
                    k: conductor.smooth.k,
                    alpha_u,
                    alpha_v,
                    ..row
                })
            }
            _ => None,
        }
    }
}

impl Material {
    /// The components of a material that is the same everywhere, in the order in which [`Bsdf`](crate::Bsdf) chooses among them;
    /// `None` for one with textures, and for one with components for which there is no row.
    pub fn component_rows(&self) -> Option<Vec<ComponentRow>> {
        if !self.is_constant() {
            return None;
        }
        let (entries, count) = self.at(Vec2::ZERO).leaves();
        entries[..count].iter().map(ComponentRow::of).collect()
    }

    /// Whether nothing of it depends on texture coordinates.
    pub fn is_constant(&self) -> bool {
        let color = |texture: &ColorTexture| matches!(texture, ColorTexture::Constant(_));
        let float = |texture: &FloatTexture| matches!(texture, FloatTexture::Constant(_));
        let rough = |roughness: &Option<super::Roughness>| {
            roughness
                .as_ref()
                .is_none_or(|roughness| float(&roughness.alpha_u) && float(&roughness.alpha_v))
        };
        match self {
            Self::Diffuse { reflectance } | Self::Mirror { reflectance } => color(reflectance),
            Self::Conductor {
                roughness,
                specular_reflectance,
                ..
            } => color(specular_reflectance) && rough(roughness),
            Self::Dielectric {
                roughness,
                specular_reflectance,
                specular_transmittance,
                ..
            } => color(specular_reflectance) && color(specular_transmittance) && rough(roughness),
            Self::ThinDielectric {
                specular_reflectance,
                specular_transmittance,
                ..
            } => color(specular_reflectance) && color(specular_transmittance),
            Self::Plastic {
                diffuse_reflectance,
                specular_reflectance,
                roughness,
                ..
            } => color(diffuse_reflectance) && color(specular_reflectance) && rough(roughness),
            Self::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                transmission,
                ..
            } => color(base_color) && float(metallic) && float(roughness) && float(transmission),
            Self::Blend {
                weight,
                first,
                second,
            } => float(weight) && first.is_constant() && second.is_constant(),
            Self::Null => true,
            Self::TwoSided { front, back } => {
                front.is_constant() && back.as_ref().is_none_or(|back| back.is_constant())
            }
        }
    }
}
