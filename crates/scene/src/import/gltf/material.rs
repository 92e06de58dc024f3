//! glTF materials.

use super::extras::{MaterialExtras, TextureInfo};
use super::texture::Placed;
use super::{Importer, Known};
use crate::import::error::ImportError;
use crate::import::image::Encoding;
use crate::{
    Channel, ColorTexture, Filter, FloatTexture, Image, ImageTexture, Layers, Material, Microfacet, Relief,
    Rgb, Roughness, Wrap,
};
use glam::{Affine2, Vec2};
use gltf::material::AlphaMode;
use std::sync::Arc;

/// What emits less than this in the mean, that is little more than a lit white wall, is taken for a
/// display or a sign, not for a light.
const GLIMMER: f32 = 1.5;

impl Importer<'_> {
    /// The material and, where it emits, its radiance.
    pub(super) fn material(&mut self, source: &gltf::Material) -> Result<Known, ImportError> {
        // The default material has no index.
        let key = source.index();
        if let Some(known) = self.materials.get(&key) {
            return Ok(known.clone());
        }
        let element = match key {
            Some(index) => format!("materials[{index}]"),
            None => "default material".to_owned(),
        };
        self.texture_set = None;
        let extras = key.and_then(|index| self.extras.get(index)).cloned();
        let extras = extras.unwrap_or_default();
        let pbr = source.pbr_metallic_roughness();
        // Factors are shares; what lies outside is brought inside, where viewers clamp what comes
        // of it.
        let [r, g, b, alpha] = pbr.base_color_factor().map(|factor| factor.clamp(0.0, 1.0));
        let mut base_color = match pbr.base_color_texture() {
            Some(info) => {
                ColorTexture::Image(self.texture(&info, Encoding::Srgb, Rgb::new(r, g, b), &element)?)
            }
            None => ColorTexture::Constant(Rgb::new(r, g, b)),
        };
        if extras.unlit {
            return self.unlit(source, base_color, &element);
        }
        if self.vertex_colors.contains(&key) {
            base_color = ColorTexture::Vertex(Box::new(base_color));
        }
        let (metallic, roughness) = match pbr.metallic_roughness_texture() {
            Some(info) => {
                let mut channel = |factor: f32, channel| -> Result<FloatTexture, ImportError> {
                    let texture = self.texture(&info, Encoding::Linear, Rgb::splat(factor), &element)?;
                    Ok(FloatTexture::Image(texture, channel))
                };
                (
                    channel(pbr.metallic_factor(), Channel::Blue)?,
                    channel(pbr.roughness_factor(), Channel::Green)?,
                )
            }
            None => (
                FloatTexture::Constant(pbr.metallic_factor().clamp(0.0, 1.0)),
                FloatTexture::Constant(pbr.roughness_factor().clamp(0.0, 1.0)),
            ),
        };
        let mut transmits = false;
        let mut transmission = FloatTexture::Constant(0.0);
        if let Some(extension) = source.transmission() {
            let factor = extension.transmission_factor().clamp(0.0, 1.0);
            transmits = factor > 0.0;
            transmission = match extension.transmission_texture() {
                Some(info) => {
                    let texture = self.texture(&info, Encoding::Linear, Rgb::splat(factor), &element)?;
                    FloatTexture::Image(texture, Channel::Red)
                }
                None => FloatTexture::Constant(factor),
            };
        }
        let mut ior = source.ior().unwrap_or(1.5);
        if let Some(specular) = extras.specular {
            if specular.is_textured || specular.color != [specular.color[0]; 3] {
                self.warn(
                    &element,
                    "KHR_materials_specular is taken without textures, and grey",
                );
            }
            ior = specular.index(ior);
        }
        let tint = extras
            .volume
            .filter(|volume| volume.thickness > 0.0)
            .map(|volume| volume.tint());
        let mut material = match (tint, &transmission) {
            (Some(tint), &FloatTexture::Constant(share)) if share > 0.0 && ior > 0.0 => {
                let solid = refracting(&base_color, tint, &roughness, ior);
                match share {
                    1.0.. => solid,
                    _ => Material::Blend {
                        weight: FloatTexture::Constant(share),
                        first: Box::new(Material::MetallicRoughness {
                            base_color,
                            metallic,
                            roughness,
                            transmission: FloatTexture::Constant(0.0),
                            ior,
                        }),
                        second: Box::new(solid),
                    },
                }
            }
            _ => Material::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                transmission,
                ior,
            },
        };
        let normals = source.normal_texture().map(|normals| normals.texture().index());
        if let Some(layers) = self.layers(&extras, normals, &element)? {
            if transmits {
                self.warn(&element, "coats and sheens of what transmits light are left out");
            } else {
                material = Material::Layered {
                    base: Box::new(material),
                    layers: Box::new(layers),
                };
            }
        }
        // What transmits has two sides already.
        if source.double_sided() && !transmits {
            material = Material::TwoSided {
                front: Box::new(material),
                back: None,
            };
        }
        material = self.alpha(source, alpha, material, &element)?;
        if let Some(normals) = source.normal_texture() {
            let placed = Placed {
                texture: normals.texture(),
                set: normals.tex_coord(),
                transform: extras.normal_transform,
            };
            let texture = self.placed(placed, Encoding::Linear, Rgb::ONE, &element)?;
            material = Material::Relief {
                relief: Box::new(Relief::Normals {
                    texture: ColorTexture::Image(texture),
                    scale: normals.scale(),
                    follows_mirroring: true,
                }),
                base: Box::new(material),
            };
        }
        let (emission, emission_texture) = match self.emission(source, &element)? {
            Some((radiance, texture)) => (Some(radiance), texture),
            None => (None, None),
        };
        let share = emission_texture
            .as_ref()
            .map_or(Rgb::ONE, |texture| texture.image.mean());
        let is_dim = emission.is_some_and(|radiance| (radiance * share).max_element() < GLIMMER);
        let known = self.known(key, material, emission, emission_texture);
        if is_dim {
            self.glimmering.insert(known.material);
        }
        Ok(known)
    }

    /// Its coat and its sheen, if it has either. `normals` is the texture of the normals below.
    fn layers(
        &mut self,
        extras: &MaterialExtras,
        normals: Option<usize>,
        element: &str,
    ) -> Result<Option<Layers>, ImportError> {
        let coat = extras.coat.clone().filter(|coat| coat.factor > 0.0);
        let sheen = extras.sheen.clone().filter(|sheen| sheen.color != [0.0; 3]);
        if coat.is_none() && sheen.is_none() {
            return Ok(None);
        }
        let mut layers = Layers {
            coat: FloatTexture::Constant(0.0),
            coat_roughness: FloatTexture::Constant(0.0),
            sheen: ColorTexture::Constant(Rgb::ZERO),
            sheen_roughness: FloatTexture::Constant(0.0),
        };
        if let Some(coat) = coat {
            let linear = Encoding::Linear;
            layers.coat = self.share(coat.factor, coat.texture, (linear, Channel::Red), element)?;
            layers.coat_roughness = self.share(
                coat.roughness,
                coat.roughness_texture,
                (linear, Channel::Green),
                element,
            )?;
            // Without a map the coat is even, whatever lies below it.
            if coat.normals != normals {
                self.warn(element, "a clear coat has the normals of what lies below it");
            }
        }
        if let Some(sheen) = sheen {
            let factor = Rgb::from_array(sheen.color);
            layers.sheen = match sheen.texture {
                Some(info) => ColorTexture::Image(self.referred(info, Encoding::Srgb, factor, element)?),
                None => ColorTexture::Constant(factor),
            };
            let alpha = (Encoding::Alpha, Channel::Red);
            layers.sheen_roughness = self.share(sheen.roughness, sheen.roughness_texture, alpha, element)?;
        }
        Ok(Some(layers))
    }

    /// A factor times a channel of a texture, if there is one.
    fn share(
        &mut self,
        factor: f32,
        info: Option<TextureInfo>,
        (encoding, channel): (Encoding, Channel),
        element: &str,
    ) -> Result<FloatTexture, ImportError> {
        Ok(match info {
            Some(info) => FloatTexture::Image(
                self.referred(info, encoding, Rgb::splat(factor), element)?,
                channel,
            ),
            None => FloatTexture::Constant(factor),
        })
    }

    /// Remembers a material.
    fn known(
        &mut self,
        key: Option<usize>,
        material: Material,
        emission: Option<Rgb>,
        emission_texture: Option<ImageTexture>,
    ) -> Known {
        self.description.materials.push(material);
        let known = Known {
            material: (self.description.materials.len() - 1) as u32,
            emission,
            emission_texture,
            texture_set: self.texture_set.unwrap_or(0),
        };
        self.materials.insert(key, known.clone());
        known
    }

    /// A material that shows its colour whatever the light is: it emits it.
    fn unlit(
        &mut self,
        source: &gltf::Material,
        color: ColorTexture,
        element: &str,
    ) -> Result<Known, ImportError> {
        let [.., alpha] = source.pbr_metallic_roughness().base_color_factor();
        let black = Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::ZERO),
        };
        let material = self.alpha(source, alpha, black, element)?;
        let (emission, texture) = match color {
            ColorTexture::Constant(color) if self.vertex_colors.contains(&source.index()) => (
                color,
                Some(white().ok_or_else(|| self.malformed(element, "an empty image"))?),
            ),
            ColorTexture::Image(texture) => (
                texture.scale,
                Some(ImageTexture {
                    scale: Rgb::ONE,
                    ..texture
                }),
            ),
            other => (other.mean(), None),
        };
        let emission = (emission != Rgb::ZERO).then_some(emission);
        let known = self.known(source.index(), material, emission, texture);
        // It shows its colour and lights nothing, in glTF.
        self.glimmering.insert(known.material);
        if source.double_sided() {
            self.unlit_both.insert(known.material);
        }
        Ok(known)
    }

    /// A material with holes where its alpha says so.
    fn alpha(
        &mut self,
        source: &gltf::Material,
        factor: f32,
        material: Material,
        element: &str,
    ) -> Result<Material, ImportError> {
        let cutoff = match source.alpha_mode() {
            AlphaMode::Opaque => return Ok(material),
            AlphaMode::Mask => Some(source.alpha_cutoff().unwrap_or(0.5)),
            AlphaMode::Blend => None,
        };
        let opacity = match source.pbr_metallic_roughness().base_color_texture() {
            Some(info) => self.opacity(&info, factor, cutoff, element)?,
            None => {
                let opacity = match cutoff {
                    Some(cutoff) => f32::from(u8::from(factor >= cutoff)),
                    None => factor,
                };
                (opacity < 1.0).then_some(FloatTexture::Constant(opacity))
            }
        };
        Ok(match opacity {
            Some(weight) => Material::Blend {
                weight,
                first: Box::new(Material::Null),
                second: Box::new(material),
            },
            None => material,
        })
    }

    /// Radiance and what it is multiplied by.
    fn emission(
        &mut self,
        source: &gltf::Material,
        element: &str,
    ) -> Result<Option<(Rgb, Option<ImageTexture>)>, ImportError> {
        let radiance = Rgb::from_array(source.emissive_factor()) * source.emissive_strength().unwrap_or(1.0);
        if !radiance.is_finite() {
            return Err(self.malformed(element, "the emission is not finite"));
        }
        let radiance = radiance.max(Rgb::ZERO);
        if radiance == Rgb::ZERO {
            return Ok(None);
        }
        let texture = match source.emissive_texture() {
            Some(info) => Some(self.texture(&info, Encoding::Srgb, Rgb::ONE, element)?),
            None => None,
        };
        if texture
            .as_ref()
            .is_some_and(|t| t.image.mean() * radiance == Rgb::ZERO)
        {
            return Ok(None);
        }
        if source.double_sided() {
            self.warn(element, "a double-sided emitter emits from its front only");
        }
        Ok(Some((radiance, texture)))
    }
}

/// A solid that refracts, tinted where light enters or leaves it.
fn refracting(color: &ColorTexture, tint: [f32; 3], roughness: &FloatTexture, ior: f32) -> Material {
    let alpha = roughness.at(Vec2::splat(0.5)).clamp(0.0, 1.0).powi(2);
    let tint = Rgb::from_array(tint);
    let transmittance = match color {
        ColorTexture::Constant(color) => ColorTexture::Constant(*color * tint),
        ColorTexture::Image(texture) => ColorTexture::Image(ImageTexture {
            scale: texture.scale * tint,
            ..texture.clone()
        }),
        other => other.clone(),
    };
    Material::Dielectric {
        eta: ior,
        roughness: (alpha > 1e-3).then_some(Roughness {
            distribution: Microfacet::Ggx,
            alpha_u: FloatTexture::Constant(alpha),
            alpha_v: FloatTexture::Constant(alpha),
        }),
        specular_reflectance: ColorTexture::Constant(Rgb::ONE),
        specular_transmittance: transmittance,
    }
}

/// The texture of what glows by the colours of its vertices alone.
fn white() -> Option<ImageTexture> {
    Some(ImageTexture {
        image: Arc::new(Image::from_linear(1, 1, vec![[1.0; 3]])?),
        to_uv: Affine2::IDENTITY,
        filter: Filter::Nearest,
        wrap: Wrap::Clamp,
        scale: Rgb::ONE,
    })
}
