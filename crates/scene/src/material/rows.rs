//! Materials as rows of numbers, for shaders.

use super::bsdf::{Entry, Side};
use super::component::{Component, SmoothDielectric};
use super::component_row::ComponentRow;
use super::flat::FlatMaterials;
use super::microfacet::Distribution;
use super::{Material, rough_coat};
use crate::{ColorTexture, FloatTexture, Rgb, Wrap};
use glam::Vec2;

impl ComponentRow {
    fn of(entry: &Entry, flat: &mut FlatMaterials) -> Option<Self> {
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
            Component::SmoothDielectric(smooth) => Some(Self {
                kind: Self::SMOOTH_DIELECTRIC,
                ..row.dielectric(smooth)
            }),
            Component::RoughDielectric(rough) => {
                let Distribution::Ggx(ggx) = rough.distribution else {
                    return None;
                };
                let (alpha_u, alpha_v) = ggx.alpha();
                Some(Self {
                    kind: Self::GGX_DIELECTRIC,
                    alpha_u,
                    alpha_v,
                    ..row.dielectric(&rough.smooth)
                })
            }
            Component::ThinDielectric(thin) => Some(Self {
                kind: Self::THIN_DIELECTRIC,
                color: thin.reflection_tint,
                eta: Rgb::splat(thin.eta),
                k: thin.transmission_tint,
                ..row
            }),
            Component::Plastic(plastic) => Some(Self {
                kind: Self::PLASTIC,
                color: plastic.reflection_tint,
                eta: Rgb::new(plastic.eta, plastic.base.importance, 0.0),
                k: plastic.base.radiosity,
                ..row
            }),
            Component::RoughPlastic(plastic) => {
                let Distribution::Ggx(ggx) = plastic.distribution else {
                    return None;
                };
                let (alpha_u, alpha_v) = ggx.alpha();
                let table = flat.coat(rough_coat::transmittances(&plastic.distribution, plastic.eta));
                Some(Self {
                    kind: Self::GGX_PLASTIC,
                    color: plastic.reflection_tint,
                    eta: Rgb::new(plastic.eta, plastic.base.importance, table as f32),
                    k: plastic.base.radiosity,
                    alpha_u,
                    alpha_v,
                    ..row
                })
            }
            Component::MetallicRoughness(_) | Component::Layered(_) => None,
        }
    }

    fn dielectric(self, smooth: &SmoothDielectric) -> Self {
        Self {
            color: smooth.reflection_tint,
            eta: Rgb::splat(smooth.eta),
            k: smooth.transmission_tint,
            ..self
        }
    }
}

impl FlatMaterials {
    /// Adds a material; `false` for one that has no rows.
    pub fn push(&mut self, material: &Material) -> bool {
        let rows = match material {
            Material::Null => Some(Vec::new()),
            _ => material.rows(self),
        };
        let Some(rows) = rows else { return false };
        self.ranges
            .push([self.components.len() as u32, rows.len() as u32]);
        self.components.extend(rows);
        true
    }
}

impl Material {
    /// The components of a material, in the order in which [`Bsdf`](crate::Bsdf) chooses among
    /// them, with the textures of what multiplies their reflection added to `flat`; `None` for one
    /// with other textures, and for one with components for which there is no row.
    pub(crate) fn rows(&self, flat: &mut FlatMaterials) -> Option<Vec<ComponentRow>> {
        if matches!(self, Self::Relief { .. }) {
            return None;
        }
        let mut textures = Vec::new();
        self.leaf_textures(1.0, &mut textures)?;
        let (entries, count) = self.at(Vec2::ZERO).leaves();
        // One that is black all over has a component, but no leaf.
        textures.resize(count, None);
        let rows = entries[..count].iter().zip(textures);
        rows.map(|(entry, texture)| {
            let row = ComponentRow::of(entry, flat)?;
            let texture = texture.map_or(0, |texture| 1 + flat.texture(texture));
            Some(ComponentRow { texture, ..row })
        })
        .collect()
    }

    /// What varies over each leaf that [`Material::at`] finds, if anything; `None` if more does
    /// than what multiplies reflections.
    fn leaf_textures<'a>(&'a self, weight: f32, leaves: &mut Vec<Option<&'a ColorTexture>>) -> Option<()> {
        match self {
            Self::Blend {
                weight: second_share,
                first,
                second,
            } => {
                let FloatTexture::Constant(share) = second_share else {
                    return None;
                };
                let share = share.clamp(0.0, 1.0);
                first.leaf_textures(weight * (1.0 - share), leaves)?;
                second.leaf_textures(weight * share, leaves)
            }
            Self::TwoSided { front, back } => {
                front.leaf_textures(weight, leaves)?;
                match back {
                    Some(back) => back.leaf_textures(weight, leaves),
                    None => Some(()),
                }
            }
            _ => {
                let texture = match self {
                    Self::Diffuse { reflectance } | Self::Mirror { reflectance } => reflectance,
                    Self::Conductor {
                        roughness,
                        specular_reflectance,
                        ..
                    } if roughness.as_ref().is_none_or(super::Roughness::is_constant) => specular_reflectance,
                    _ => &ColorTexture::Constant(Rgb::ONE),
                };
                // Shaders have images and checkerboards, wrapped alike along both axes.
                if texture.has_vertices()
                    || matches!(texture, ColorTexture::Image(image) if matches!(image.wrap, Wrap::Mixed(_)))
                {
                    return None;
                }
                let varies = texture.as_constant().is_none();
                // Leaves without a share are left out.
                if weight > 0.0 {
                    leaves.push(varies.then_some(texture));
                }
                (varies || self.is_constant()).then_some(())
            }
        }
    }

    /// Whether nothing of it depends on texture coordinates.
    pub fn is_constant(&self) -> bool {
        let color = |texture: &ColorTexture| matches!(texture, ColorTexture::Constant(_));
        let float = |texture: &FloatTexture| matches!(texture, FloatTexture::Constant(_));
        let rough = |roughness: &Option<super::Roughness>| {
            roughness.as_ref().is_none_or(super::Roughness::is_constant)
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
            Self::Layered { base, layers } => {
                base.is_constant()
                    && float(&layers.coat)
                    && float(&layers.coat_roughness)
                    && color(&layers.sheen)
                    && float(&layers.sheen_roughness)
            }
            Self::Blend {
                weight,
                first,
                second,
            } => float(weight) && first.is_constant() && second.is_constant(),
            Self::Null => true,
            Self::Relief { .. } => false,
            Self::TwoSided { front, back } => {
                front.is_constant() && back.as_ref().is_none_or(|back| back.is_constant())
            }
        }
    }
}

impl super::Roughness {
    fn is_constant(&self) -> bool {
        let constant = |texture: &FloatTexture| matches!(texture, FloatTexture::Constant(_));
        constant(&self.alpha_u) && constant(&self.alpha_v)
    }
}
