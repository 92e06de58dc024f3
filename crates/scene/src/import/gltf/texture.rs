//! glTF textures and images.

use super::extras::{TextureInfo, TextureTransform};
use super::{Importer, read_uri};
use crate::import::error::ImportError;
use crate::import::image::{Encoding, decode_guessed};
use crate::{AxisWrap, Channel, Filter, FloatTexture, Image, ImageTexture, Rgb, Wrap};
use glam::{Affine2, Mat2, Vec2};
use gltf::texture::{MagFilter, WrappingMode};
use std::path::Path;
use std::sync::Arc;

impl Importer<'_> {
    /// A texture of a material.
    pub(super) fn texture(
        &mut self,
        info: &gltf::texture::Info,
        encoding: Encoding,
        scale: Rgb,
        element: &str,
    ) -> Result<ImageTexture, ImportError> {
        let transform = info.texture_transform().map(|t| TextureTransform {
            offset: t.offset(),
            rotation: t.rotation(),
            scale: t.scale(),
            set: t.tex_coord(),
        });
        let placed = Placed {
            texture: info.texture(),
            set: info.tex_coord(),
            transform,
        };
        self.placed(placed, encoding, scale, element)
    }

    /// A texture that an extension refers to.
    pub(super) fn referred(
        &mut self,
        info: TextureInfo,
        encoding: Encoding,
        scale: Rgb,
        element: &str,
    ) -> Result<ImageTexture, ImportError> {
        let TextureInfo {
            index,
            set,
            transform,
        } = info;
        let texture = self.document.textures().nth(index);
        let texture =
            texture.ok_or_else(|| self.malformed(element, format!("there is no texture {index}")))?;
        let placed = Placed {
            texture,
            set,
            transform,
        };
        self.placed(placed, encoding, scale, element)
    }

    /// A texture with its place on the surface.
    pub(super) fn placed(
        &mut self,
        Placed {
            texture,
            set,
            transform,
        }: Placed,
        encoding: Encoding,
        scale: Rgb,
        element: &str,
    ) -> Result<ImageTexture, ImportError> {
        let set = transform.and_then(|t| t.set).unwrap_or(set);
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
            let rotation = Mat2::from_angle(-t.rotation);
            let scale = Mat2::from_diagonal(Vec2::from_array(t.scale));
            Affine2::from_mat2_translation(rotation * scale, Vec2::from_array(t.offset))
        });
        let sampler = texture.sampler();
        let wrap = Wrap::of_axes([sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
            WrappingMode::Repeat => AxisWrap::Repeat,
            WrappingMode::MirroredRepeat => AxisWrap::Mirror,
            WrappingMode::ClampToEdge => AxisWrap::Clamp,
        }));
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
            (Some(uri), _) => match read_uri(uri, self.path, self.loading, || self.location(&element)) {
                Ok((bytes, path)) => self.decoded(&bytes, encoding, path.as_deref(), &element),
                Err(error) if may_be_absent(&error) => self.white(
                    &element,
                    &format!("white is taken for an image: {}", error.chain()),
                ),
                Err(error) => return Err(error),
            },
            (None, Some(view)) => match self.buffers.view(&view).map(<[u8]>::to_vec) {
                Ok(bytes) => self.decoded(&bytes, encoding, None, &element),
                Err(what) => self.white(&element, &format!("white is taken for an image: {what}")),
            },
            (None, None) => self.white(
                &element,
                "white is taken for an image without a URI or buffer view",
            ),
        };
        let image = Arc::new(image.map_err(|source| self.referenced(&element, source))?);
        self.images.insert((index, encoding), image.clone());
        Ok(image)
    }

    /// Decodes an image; one that is damaged, or of a format that is not read, is white.
    fn decoded(
        &mut self,
        bytes: &[u8],
        encoding: Encoding,
        path: Option<&Path>,
        element: &str,
    ) -> Result<Image, ImportError> {
        let known = FORMATS.iter().find(|(start, _)| bytes.starts_with(start));
        if let Some((_, name)) = known {
            return self.white(
                element,
                &format!("{name} images are not supported: white is taken"),
            );
        }
        match decode_guessed(bytes, encoding, path.unwrap_or(self.path), self.loading) {
            // What it would cost is no matter of taste.
            Err(error) if !matches!(error, ImportError::OverBudget { .. }) => self.white(
                element,
                &format!("white is taken for a damaged image: {}", error.chain()),
            ),
            image => image,
        }
    }

    /// One white texel in place of an image.
    fn white(&mut self, element: &str, message: &str) -> Result<Image, ImportError> {
        self.warn(element, message);
        Image::from_linear(1, 1, vec![[1.0; 3]]).ok_or_else(|| self.malformed(element, "an empty image"))
    }

    /// The opacity in the alpha channel of a texture, with all above `cutoff` opaque and the rest
    /// clear if there is one; `None` if it is opaque all over.
    pub(super) fn opacity(
        &mut self,
        info: &gltf::texture::Info,
        factor: f32,
        cutoff: Option<f32>,
        element: &str,
    ) -> Result<Option<FloatTexture>, ImportError> {
        let mut texture = self.texture(info, Encoding::Alpha, Rgb::splat(factor), element)?;
        let alpha = |texel: Rgb| texel.x * factor;
        if let Some(cutoff) = cutoff {
            let image = &texture.image;
            let size = [image.width() as usize, image.height() as usize];
            self.loading.spend_image(size, 0, 3, self.path)?;
            let code = |texel: Rgb| [if alpha(texel) >= cutoff { u8::MAX } else { 0 }; 3];
            let codes = image.texels().map(code).collect();
            let image = Image::from_linear8(image.width(), image.height(), codes);
            let image = image.ok_or_else(|| self.malformed(element, "an empty image"))?;
            texture.image = Arc::new(image);
            texture.scale = Rgb::ONE;
        }
        let is_opaque = texture
            .image
            .texels()
            .all(|texel| texel.x * texture.scale.x >= 1.0);
        Ok((!is_opaque).then_some(FloatTexture::Image(texture, Channel::Red)))
    }
}

/// First bytes of formats that files have and that are not read.
const FORMATS: [(&[u8], &str); 5] = [
    (b"\xabKTX", "KTX"),
    (b"DDS ", "DDS"),
    (b"GIF8", "GIF"),
    (b"II*\0", "TIFF"),
    (b"MM\0*", "TIFF"),
];

/// Whether an image can be left out that was not read for this reason: all but what would take too
/// much.
fn may_be_absent(error: &ImportError) -> bool {
    !matches!(error.innermost(), ImportError::OverBudget { .. })
}

/// A texture, the set of coordinates that it lies at, and how it is moved there.
pub(super) struct Placed<'a> {
    pub texture: gltf::Texture<'a>,
    pub set: u32,
    pub transform: Option<TextureTransform>,
}
