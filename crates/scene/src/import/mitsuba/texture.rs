//! Textures and texture-valued properties.

use super::Importer;
use super::properties::Properties;
use super::values;
use crate::import::error::ImportError;
use crate::import::image::{Encoding, read_within};
use crate::import::spectrum::SpectrumOf;
use crate::import::xml::Node;
use crate::{Channel, Checkerboard, ColorTexture, Filter, FloatTexture, Image, ImageTexture, Rgb, Wrap};
use glam::{Affine2, DAffine3, Vec2};
use std::sync::Arc;

impl Importer<'_> {
    /// The image in a file, read once.
    pub(super) fn image(
        &mut self,
        node: &Node,
        file: &str,
        encoding: Encoding,
    ) -> Result<Arc<Image>, ImportError> {
        let key = (node.resolve(file, self.loading), encoding);
        if let Some(image) = self.images.get(&key) {
            return Ok(image.clone());
        }
        let image = match read_within(&key.0, encoding, self.loading) {
            Ok(image) => image,
            Err(source @ ImportError::OverBudget { .. }) => return Err(Self::referenced(node, source)),
            Err(source) => {
                self.warn(node, format!("grey is taken for an image: {}", source.chain()));
                Image::from_linear(1, 1, vec![[0.5; 3]]).ok_or_else(|| node.malformed("an empty image"))?
            }
        };
        let image = Arc::new(image);
        self.images.insert(key, image.clone());
        Ok(image)
    }

    /// A colour that may vary, `default` where the property is missing.
    pub(super) fn color_texture(
        &mut self,
        properties: &Properties,
        name: &str,
        default: f32,
    ) -> Result<ColorTexture, ImportError> {
        let Some(node) = properties.get(name) else {
            return Ok(ColorTexture::Constant(Rgb::splat(default)));
        };
        match node.tag.as_str() {
            "rgb" | "spectrum" | "float" => Ok(ColorTexture::Constant(
                properties.color(name)?.unwrap_or(Rgb::splat(default)),
            )),
            "texture" => self.texture(node),
            "ref" => {
                let target = self.target(node, "texture")?;
                self.texture(target)
            }
            tag => Err(node.malformed(format!("`{name}` is <{tag}>, expected a colour or a texture"))),
        }
    }

    /// A number that may vary. A texture gives its luminance, as in Mitsuba.
    pub(super) fn float_texture(
        &mut self,
        properties: &Properties,
        name: &str,
    ) -> Result<Option<FloatTexture>, ImportError> {
        let Some(node) = properties.get(name) else {
            return Ok(None);
        };
        let texture = match node.tag.as_str() {
            "float" | "integer" => {
                let value = values::float(node, node.require("value")?)?;
                return Ok(Some(FloatTexture::Constant(value)));
            }
            "texture" => self.texture(node)?,
            "ref" => {
                let target = self.target(node, "texture")?;
                self.texture(target)?
            }
            tag => return Err(node.malformed(format!("`{name}` is <{tag}>, expected a number or a texture"))),
        };
        Self::luminance(node, texture).map(Some)
    }

    /// The luminance of a texture.
    pub(super) fn luminance(node: &Node, texture: ColorTexture) -> Result<FloatTexture, ImportError> {
        match texture {
            ColorTexture::Image(image) => Ok(FloatTexture::Image(image, Channel::Luminance)),
            ColorTexture::Constant(color) => Ok(FloatTexture::Constant(crate::luminance(color))),
            ColorTexture::Vertex(_) => Ok(FloatTexture::Vertex(Channel::Luminance)),
            // Two by two texels without filtering; above one half is the second.
            ColorTexture::Checkerboard(board) => {
                let [a, b] = [board.color0, board.color1].map(|color| color.to_array());
                let image = Image::from_linear(2, 2, vec![a, b, b, a]);
                let image = image.ok_or_else(|| node.malformed("a colour is not finite"))?;
                let texture = ImageTexture {
                    image: Arc::new(image),
                    to_uv: board.to_uv,
                    filter: Filter::Nearest,
                    wrap: Wrap::Repeat,
                    scale: Rgb::ONE,
                };
                Ok(FloatTexture::Image(texture, Channel::Luminance))
            }
        }
    }

    pub(super) fn texture(&mut self, node: &Node) -> Result<ColorTexture, ImportError> {
        let properties = Properties::new(node)?;
        let texture = match properties.kind()? {
            "bitmap" => {
                let file = properties
                    .string("filename")?
                    .ok_or_else(|| node.malformed("`filename` is missing"))?;
                // Storage and acceleration, not values.
                properties.ignore(&["format", "accel"]);
                let encoding = match properties.boolean("raw")? {
                    Some(true) => Encoding::Linear,
                    _ => Encoding::Srgb,
                };
                let filter = match properties.string("filter_type")?.unwrap_or("bilinear") {
                    "bilinear" => Filter::Bilinear,
                    "nearest" => Filter::Nearest,
                    other => return Err(node.unsupported(format!("unknown `filter_type` `{other}`"))),
                };
                let wrap = match properties.string("wrap_mode")?.unwrap_or("repeat") {
                    "repeat" => Wrap::Repeat,
                    "mirror" => Wrap::Mirror,
                    "clamp" => Wrap::Clamp,
                    other => return Err(node.unsupported(format!("unknown `wrap_mode` `{other}`"))),
                };
                ColorTexture::Image(ImageTexture {
                    image: self.image(node, file, encoding)?,
                    to_uv: to_uv(&properties)?,
                    filter,
                    wrap,
                    scale: Rgb::ONE,
                })
            }
            "checkerboard" => ColorTexture::Checkerboard(Checkerboard {
                color0: properties.color("color0")?.unwrap_or(Rgb::splat(0.4)),
                color1: properties.color("color1")?.unwrap_or(Rgb::splat(0.2)),
                to_uv: to_uv(&properties)?,
            }),
            "rawconstant" | "uniform" => {
                let value = properties.get("value");
                let value = value.ok_or_else(|| node.malformed("`value` is missing"))?;
                ColorTexture::Constant(match value.tag.as_str() {
                    "vector" | "point" => values::vector(value, 0.0)?.as_vec3(),
                    _ => values::color(value, SpectrumOf::Reflectance)?,
                })
            }
            "mesh_attribute" => {
                let name = properties.string("name")?;
                let name = name.ok_or_else(|| node.malformed("`name` is missing"))?;
                if !(name.starts_with("vertex_") || name.starts_with("face_")) {
                    return Err(node.malformed(format!(
                        "the attribute `{name}` is neither of vertices (`vertex_…`) nor of faces (`face_…`)"
                    )));
                }
                let scale = properties.float("scale")?.unwrap_or(1.0);
                if scale < 0.0 {
                    return Err(node.malformed(format!("`scale` is negative: {scale}")));
                }
                if self.attribute.as_deref().is_some_and(|other| other != name) {
                    self.warn(
                        node,
                        format!("a surface has one attribute of its mesh at most: `{name}` is left out"),
                    );
                } else {
                    self.attribute = Some(name.to_owned());
                }
                ColorTexture::Vertex(Box::new(ColorTexture::Constant(Rgb::splat(scale))))
            }
            "volume" => {
                self.warn(node, "a texture of a volume is its mean");
                let mean = self.mean_of_volume(&properties, "volume")?;
                ColorTexture::Constant(mean.ok_or_else(|| node.malformed("`volume` is missing"))?)
            }
            kind => {
                self.warn(
                    node,
                    format!("the texture `{kind}` is not supported: grey is taken"),
                );
                properties.all(|_| true);
                ColorTexture::Constant(Rgb::splat(0.5))
            }
        };
        self.finish(&properties);
        Ok(texture)
    }
}

/// The upper left 2 × 2 block and the shift in x and y of `to_uv`: Mitsuba leaves out the third
/// row and column.
fn to_uv(properties: &Properties) -> Result<Affine2, ImportError> {
    let map = properties
        .transform("to_uv")?
        .unwrap_or(DAffine3::IDENTITY)
        .as_affine3a();
    let (x, y) = (map.matrix3.x_axis, map.matrix3.y_axis);
    Ok(Affine2::from_cols(
        Vec2::new(x.x, x.y),
        Vec2::new(y.x, y.y),
        Vec2::new(map.translation.x, map.translation.y),
    ))
}
