//! Materials that scatter alike everywhere.

use super::{Bsdf, Layers, Material, Roughness};
use crate::{ColorTexture, FloatTexture};
use glam::Vec2;

impl Material {
    /// The scattering function of a material that has the same everywhere, where it is worth
    /// keeping: that of a diffuse material is found as fast.
    pub(crate) fn everywhere(&self) -> Option<Bsdf> {
        (self.as_diffuse().is_none() && self.is_uniform()).then(|| self.at(Vec2::ZERO))
    }

    fn is_uniform(&self) -> bool {
        match self {
            Self::Null => true,
            Self::Diffuse { reflectance } | Self::Mirror { reflectance } => color(reflectance),
            Self::Conductor {
                ior: _,
                roughness,
                specular_reflectance,
            } => rough(roughness) && color(specular_reflectance),
            Self::Dielectric {
                eta: _,
                roughness,
                specular_reflectance,
                specular_transmittance,
            } => rough(roughness) && color(specular_reflectance) && color(specular_transmittance),
            Self::ThinDielectric {
                eta: _,
                specular_reflectance,
                specular_transmittance,
            } => color(specular_reflectance) && color(specular_transmittance),
            Self::Plastic {
                eta: _,
                diffuse_reflectance,
                specular_reflectance,
                nonlinear: _,
                roughness,
            } => color(diffuse_reflectance) && color(specular_reflectance) && rough(roughness),
            Self::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                transmission,
                ior: _,
            } => color(base_color) && [metallic, roughness, transmission].into_iter().all(float),
            Self::Layered { base, layers } => base.is_uniform() && layers_are_uniform(layers),
            Self::Blend {
                weight,
                first,
                second,
            } => float(weight) && first.is_uniform() && second.is_uniform(),
            Self::TwoSided { front, back } => {
                front.is_uniform() && back.as_ref().is_none_or(|back| back.is_uniform())
            }
            Self::Relief { .. } => false,
        }
    }
}

fn layers_are_uniform(layers: &Layers) -> bool {
    let floats = [&layers.coat, &layers.coat_roughness, &layers.sheen_roughness];
    color(&layers.sheen) && floats.into_iter().all(float)
}

fn color(texture: &ColorTexture) -> bool {
    matches!(texture, ColorTexture::Constant(_))
}

fn float(texture: &FloatTexture) -> bool {
    matches!(texture, FloatTexture::Constant(_))
}

fn rough(roughness: &Option<Roughness>) -> bool {
    roughness
        .as_ref()
        .is_none_or(|roughness| float(&roughness.alpha_u) && float(&roughness.alpha_v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ConductorIor, Microfacet, Rgb};
    use glam::Vec3;
    use std::cell::Cell;

    /// One material of each kind, of which the textures are counted, and that of this number is
    /// the colour of vertices.
    fn materials(textured: usize, count: &Cell<usize>) -> Vec<Material> {
        let is_textured = || {
            count.set(count.get() + 1);
            count.get() == textured
        };
        let color = || match is_textured() {
            true => ColorTexture::Vertex(Box::new(ColorTexture::Constant(Rgb::ONE))),
            false => ColorTexture::Constant(Rgb::new(0.9, 0.5, 0.3)),
        };
        let float = || match is_textured() {
            true => FloatTexture::Vertex(crate::Channel::Red),
            false => FloatTexture::Constant(0.3),
        };
        let rough = || {
            Some(Roughness {
                distribution: Microfacet::Ggx,
                alpha_u: float(),
                alpha_v: float(),
            })
        };
        let conductor = || Material::Conductor {
            ior: ConductorIor {
                eta: Rgb::splat(0.2),
                k: Rgb::splat(3.0),
            },
            roughness: rough(),
            specular_reflectance: color(),
        };
        let metallic = || Material::MetallicRoughness {
            base_color: color(),
            metallic: float(),
            roughness: float(),
            transmission: FloatTexture::Constant(0.0),
            ior: 1.5,
        };
        vec![
            Material::Mirror { reflectance: color() },
            conductor(),
            Material::Dielectric {
                eta: 1.5,
                roughness: rough(),
                specular_reflectance: color(),
                specular_transmittance: color(),
            },
            Material::ThinDielectric {
                eta: 1.5,
                specular_reflectance: color(),
                specular_transmittance: color(),
            },
            Material::Plastic {
                eta: 1.5,
                diffuse_reflectance: color(),
                specular_reflectance: color(),
                nonlinear: true,
                roughness: rough(),
            },
            Material::MetallicRoughness {
                base_color: color(),
                metallic: float(),
                roughness: float(),
                transmission: float(),
                ior: 1.5,
            },
            Material::Layered {
                base: Box::new(metallic()),
                layers: Box::new(Layers {
                    coat: float(),
                    coat_roughness: float(),
                    sheen: color(),
                    sheen_roughness: float(),
                }),
            },
            Material::Blend {
                weight: float(),
                first: Box::new(Material::Diffuse { reflectance: color() }),
                second: Box::new(conductor()),
            },
            Material::TwoSided {
                front: Box::new(conductor()),
                back: Some(Box::new(Material::Mirror { reflectance: color() })),
            },
        ]
    }

    /// Every texture of every kind keeps its material from being the same everywhere.
    /// Planted fault: a texture that is not looked at.
    #[test]
    fn textures_differ_from_place_to_place() {
        let count = Cell::new(0);
        let uniform = materials(0, &count);
        for material in &uniform {
            let kept = material.everywhere().unwrap();
            let found = material.at(Vec2::new(0.3, 0.8));
            let wo = Vec3::new(0.6, 0.0, 0.8);
            for wi in [Vec3::Z, Vec3::new(0.0, 0.6, 0.8), Vec3::new(-0.6, 0.0, 0.8)] {
                assert_eq!(kept.evaluate(wo, wi), found.evaluate(wo, wi), "{material:?}");
            }
        }
        for textured in 1..=count.get() {
            let of_each = materials(textured, &Cell::new(0));
            let others = of_each.iter().filter(|material| material.everywhere().is_none());
            assert_eq!(others.count(), 1, "texture {textured}");
        }
        let diffuse = Material::Diffuse {
            reflectance: Rgb::ONE.into(),
        };
        assert!(diffuse.everywhere().is_none());
    }
}
