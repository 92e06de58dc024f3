//! The images that a material reads.

use super::{Material, Relief, Roughness};
use crate::{ColorTexture, FloatTexture, ImageTexture};

impl Material {
    /// Shows `see` each image that the material reads, in the order in which it does.
    pub(crate) fn for_each_image(&self, see: &mut impl FnMut(&ImageTexture)) {
        match self {
            Self::Null => (),
            Self::Diffuse { reflectance } | Self::Mirror { reflectance } => color(reflectance, see),
            Self::Conductor {
                ior: _,
                roughness,
                specular_reflectance,
            } => {
                color(specular_reflectance, see);
                rough(roughness, see);
            }
            Self::Dielectric {
                eta: _,
                roughness,
                specular_reflectance,
                specular_transmittance,
            } => {
                color(specular_reflectance, see);
                color(specular_transmittance, see);
                rough(roughness, see);
            }
            Self::ThinDielectric {
                eta: _,
                specular_reflectance,
                specular_transmittance,
            } => {
                color(specular_reflectance, see);
                color(specular_transmittance, see);
            }
            Self::Plastic {
                eta: _,
                diffuse_reflectance,
                specular_reflectance,
                nonlinear: _,
                roughness,
            } => {
                color(diffuse_reflectance, see);
                color(specular_reflectance, see);
                rough(roughness, see);
            }
            Self::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                transmission,
                ior: _,
            } => {
                color(base_color, see);
                number(roughness, see);
                number(metallic, see);
                number(transmission, see);
            }
            Self::Layered { base, layers } => {
                base.for_each_image(see);
                color(&layers.sheen, see);
                for texture in [&layers.coat, &layers.coat_roughness, &layers.sheen_roughness] {
                    number(texture, see);
                }
            }
            Self::Blend {
                weight,
                first,
                second,
            } => {
                number(weight, see);
                first.for_each_image(see);
                second.for_each_image(see);
            }
            Self::TwoSided { front, back } => {
                front.for_each_image(see);
                if let Some(back) = back {
                    back.for_each_image(see);
                }
            }
            Self::Relief { relief, base } => {
                match &**relief {
                    Relief::Normals { texture, .. } => color(texture, see),
                    Relief::Heights { texture, .. } => number(texture, see),
                }
                base.for_each_image(see);
            }
        }
    }
}

fn color(texture: &ColorTexture, see: &mut impl FnMut(&ImageTexture)) {
    if let Some(image) = texture.image() {
        see(image);
    }
}

fn number(texture: &FloatTexture, see: &mut impl FnMut(&ImageTexture)) {
    if let Some(image) = texture.image() {
        see(image);
    }
}

fn rough(roughness: &Option<Roughness>, see: &mut impl FnMut(&ImageTexture)) {
    if let Some(roughness) = roughness {
        number(&roughness.alpha_u, see);
        number(&roughness.alpha_v, see);
    }
}
