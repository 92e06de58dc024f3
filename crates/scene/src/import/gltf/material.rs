//! glTF materials and textures.

use super::{Importer, Known};
use crate::import::error::{ImportError, Location};
use crate::import::image::{Encoding, decode_guessed};
use crate::import::limits::LoadResource;
use crate::{Channel, ColorTexture, Filter, FloatTexture, Image, ImageTexture, Material, Rgb, Wrap};
use glam::{Affine2, Mat2, Vec2};
use gltf::material::AlphaMode;
use gltf::texture::{MagFilter, WrappingMode};
use std::sync::Arc;

/// A texture that emits less than this in the mean is taken for a display or a sign, not for a
/// light.
const GLIMMER: f32 = 0.25;

impl Importer<'_> {
    /// The material and, where it emits, its radiance.
    pub(super) fn material(&mut self, source: &gltf::Material) -> Result<Known, ImportError> {
        // The default material has no index.
        let key = source.index();
        if let Some(&known) = self.materials.get(&key) {
            return Ok(known);
        }
        let element = match key {
            Some(index) => format!("materials[{index}]"),
            None => "default material".to_owned(),
        };
        self.texture_set = None;
        let pbr = source.pbr_metallic_roughness();
        let [r, g, b, _] = pbr.base_color_factor();
        let base_color = match pbr.base_color_texture() {
            Some(info) => {
                ColorTexture::Image(self.texture(&info, Encoding::Srgb, Rgb::new(r, g, b), &element)?)
            }
            None => ColorTexture::Constant(Rgb::new(r, g, b)),
        };
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
        let mut material = Material::MetallicRoughness {
            base_color,
            metallic,
            roughness,
            transmission,
            ior: source.ior().unwrap_or(1.5),
        };
        // What transmits has two sides already.
        if source.double_sided() && !transmits {
            material = Material::TwoSided {
                front: Box::new(material),
                back: None,
            };
        }
        match source.alpha_mode() {
            AlphaMode::Opaque => {}
            AlphaMode::Mask => self.warn(&element, "alpha mode MASK is not supported: taken as opaque"),
            AlphaMode::Blend => self.warn(&element, "alpha mode BLEND is not supported: taken as opaque"),
        }
        if source.normal_texture().is_some() {
            self.warn(
                &element,
                "normal maps are not supported: the surface keeps its vertex normals",
            );
        }
        let emission = self.emission(source, &element)?;
        self.description.materials.push(material);
        let known = Known {
            material: (self.description.materials.len() - 1) as u32,
            emission,
            texture_set: self.texture_set.unwrap_or(0),
        };
        let is_dim = |emission: Rgb| emission.max_element() < GLIMMER;
        if emission.is_some_and(is_dim) && source.emissive_texture().is_some() {
            self.glimmering.insert(known.material);
        }
        self.materials.insert(key, known);
        Ok(known)
    }

    fn emission(&mut self, source: &gltf::Material, element: &str) -> Result<Option<Rgb>, ImportError> {
        let mut radiance =
            Rgb::from_array(source.emissive_factor()) * source.emissive_strength().unwrap_or(1.0);
        if !(radiance.is_finite() && radiance.min_element() >= 0.0) {
            return Err(self.malformed(element, "the emission is negative or not finite"));
        }
        if radiance == Rgb::ZERO {
            return Ok(None);
        }
        if let Some(info) = source.emissive_texture() {
            let texture = self.texture(&info, Encoding::Srgb, Rgb::ONE, element)?;
            radiance *= texture.image.mean();
            self.warn(
                element,
                "emission does not vary over a surface here: its texture's mean is emitted everywhere",
            );
        }
        if source.double_sided() {
            self.warn(element, "a double-sided emitter emits from its front only");
        }
        Ok((radiance != Rgb::ZERO).then_some(radiance))
    }

    fn texture(
        &mut self,
        info: &gltf::texture::Info,
        encoding: Encoding,
        scale: Rgb,
        element: &str,
    ) -> Result<ImageTexture, ImportError> {
        let transform = info.texture_transform();
        let set = transform
            .as_ref()
            .and_then(|t| t.tex_coord())
            .unwrap_or(info.tex_coord());
        // The first texture of a material says which set its surfaces have.
        let first = *self.texture_set.get_or_insert(set);
        if set != first {
            self.warn(
                element,
                format!("texture coordinates of set {set} beside those of set {first}: the latter are taken"),
            );
        }
        let to_uv = transform.map_or(Affine2::IDENTITY, |t| {
            // KHR_texture_transform: translation · rotation · scale, counter-clockwise with v
            // downwards.
            let rotation = Mat2::from_angle(-t.rotation());
            let scale = Mat2::from_diagonal(Vec2::from_array(t.scale()));
            Affine2::from_mat2_translation(rotation * scale, Vec2::from_array(t.offset()))
        });
        let texture = info.texture();
        let sampler = texture.sampler();
        let wrap = match (sampler.wrap_s(), sampler.wrap_t()) {
            (WrappingMode::Repeat, WrappingMode::Repeat) => Wrap::Repeat,
            (WrappingMode::MirroredRepeat, WrappingMode::MirroredRepeat) => Wrap::Mirror,
            (WrappingMode::ClampToEdge, WrappingMode::ClampToEdge) => Wrap::Clamp,
            (s, t) => {
                self.warn(
                    element,
                    format!("a texture that wraps differently in s and t ({s:?}, {t:?}) is wrapped as in s"),
                );
                match s {
                    WrappingMode::Repeat => Wrap::Repeat,
                    WrappingMode::MirroredRepeat => Wrap::Mirror,
                    WrappingMode::ClampToEdge => Wrap::Clamp,
                }
            }
        };
        let filter = match sampler.mag_filter() {
            Some(MagFilter::Nearest) => Filter::Nearest,
            Some(MagFilter::Linear) | None => Filter::Bilinear,
        };
        Ok(ImageTexture {
            image: self.image(texture.source().index(), encoding)?,
            to_uv,
            filter,
            wrap,
            scale,
        })
    }

    /// An image of the document, decoded once an encoding.
    fn image(&mut self, index: usize, encoding: Encoding) -> Result<Arc<Image>, ImportError> {
        if let Some(image) = self.images.get(&(index, encoding)) {
            return Ok(image.clone());
        }
        let element = format!("images[{index}]");
        // The JSON itself: the wrapper's accessor takes a view's type for granted.
        let source = self.document.as_json().images.get(index);
        let (uri, view) = source.map_or((None, None), |image| (image.uri.as_deref(), image.buffer_view));
        let view = view.and_then(|view| self.document.views().nth(view.value()));
        let image = match (uri, view) {
            (Some(uri), _) => {
                let (bytes, path) = self.resource(uri, &element)?;
                if let Some(white) = self.undecoded(&bytes, &element) {
                    return Ok(white);
                }
                decode_guessed(
                    &bytes,
                    encoding,
                    path.as_deref().unwrap_or(self.path),
                    self.loading,
                )
            }
            (None, Some(view)) => {
                let bytes = self
                    .buffers
                    .view(&view)
                    .map_err(|what| self.malformed(&element, what))?;
                let bytes = bytes.to_vec();
                if let Some(white) = self.undecoded(&bytes, &element) {
                    return Ok(white);
                }
                decode_guessed(&bytes, encoding, self.path, self.loading)
            }
            (None, None) => {
                return Err(self.malformed(&element, "the image has neither a URI nor a buffer view"));
            }
        };
        let image = Arc::new(image.map_err(|source| self.referenced(&element, source))?);
        self.images.insert((index, encoding), image.clone());
        Ok(image)
    }

    /// A white image in place of one in a format that is known, and not read.
    fn undecoded(&mut self, bytes: &[u8], element: &str) -> Option<Arc<Image>> {
        let name = match bytes {
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => "WebP",
            [0xab, b'K', b'T', b'X', ..] => "KTX",
            _ => return None,
        };
        self.warn(
            element,
            format!("{name} images are not supported: white is taken"),
        );
        Image::from_linear(1, 1, vec![[1.0; 3]]).map(Arc::new)
    }

    /// Bytes behind a URI, and the file that they come from unless they stand in the URI itself.
    fn resource(
        &self,
        uri: &str,
        element: &str,
    ) -> Result<(Vec<u8>, Option<std::path::PathBuf>), ImportError> {
        match super::resolve_uri(uri, self.path).map_err(|what| self.malformed(element, what))? {
            super::Resource::Data(bytes) => {
                let location = || Location::file(self.path).element(element);
                self.loading
                    .spend(LoadResource::Bytes, bytes.len() as u64, location)?;
                Ok((bytes, None))
            }
            super::Resource::File(path) => {
                let bytes = self
                    .loading
                    .read(&path)
                    .map_err(|source| self.referenced(element, source))?;
                Ok((bytes, Some(path)))
            }
        }
    }
}
