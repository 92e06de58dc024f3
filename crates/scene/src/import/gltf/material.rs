//! glTF materials.

use super::texture::Placed;
use super::{Importer, Known};
use crate::import::error::ImportError;
use crate::import::image::Encoding;
use crate::{Channel, ColorTexture, FloatTexture, ImageTexture, Material, Relief, Rgb};
use gltf::material::AlphaMode;

/// A texture that emits less than this in the mean, that is no more than a lit white wall, is taken
/// for a display or a sign, not for a light.
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
        let [r, g, b, alpha] = pbr.base_color_factor();
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
                FloatTexture::Constant(pbr.metallic_factor()),
                FloatTexture::Constant(pbr.roughness_factor()),
            ),
        };
        let mut transmits = false;
        let mut transmission = FloatTexture::Constant(0.0);
        if let Some(extension) = source.transmission() {
            let factor = extension.transmission_factor();
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
        let mut material = Material::MetallicRoughness {
            base_color,
            metallic,
            roughness,
            transmission,
            ior,
        };
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
        let mean = |texture: &ImageTexture| texture.image.mean() * emission.unwrap_or(Rgb::ZERO);
        let is_dim = emission_texture
            .as_ref()
            .is_some_and(|texture| mean(texture).max_element() < GLIMMER);
        let known = self.known(key, material, emission, emission_texture);
        if is_dim {
            self.glimmering.insert(known.material);
        }
        Ok(known)
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
        if source.double_sided() {
            self.warn(element, "a double-sided emitter emits from its front only");
        }
        let [.., alpha] = source.pbr_metallic_roughness().base_color_factor();
        let black = Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::ZERO),
        };
        let material = self.alpha(source, alpha, black, element)?;
        let (emission, texture) = match color {
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
        Ok(self.known(source.index(), material, emission, texture))
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
        if !(radiance.is_finite() && radiance.min_element() >= 0.0) {
            return Err(self.malformed(element, "the emission is negative or not finite"));
        }
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
