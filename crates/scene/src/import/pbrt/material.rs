//! Materials and textures.

use super::parameters::{Parameter, Parameters, Values};
use super::{Importer, UPGRADE};
use crate::import::error::ImportError;
use crate::import::image::{Encoding, read_within};
use crate::import::ior;
use crate::import::spectrum::{self, SpectrumOf};
use crate::{
    Channel, Checkerboard, ColorTexture, ConductorIor, Filter, FloatTexture, Image, ImageTexture, Material,
    Microfacet, Relief, Rgb, Roughness, Wrap, luminance,
};
use glam::{Affine2, Vec2};
use std::sync::Arc;

impl Importer<'_> {
    pub(super) fn material(&mut self, kind: &str, parameters: &Parameters) -> Result<Material, ImportError> {
        // Counts what named materials and mixes of them make.
        let color = |this: &mut Self, name: &str, default: f32| this.color(parameters, name, default);
        let mut material = match kind {
            "diffuse" => two_sided(Material::Diffuse {
                reflectance: color(self, "reflectance", 0.5)?,
            }),
            "coateddiffuse" => {
                parameters.ignore(&["thickness", "maxdepth", "nsamples"]);
                for left_out in ["albedo", "g"] {
                    if parameters.get(left_out).is_some() {
                        self.warn(
                            parameters,
                            format!("nothing fills the coat: `{left_out}` is left out"),
                        );
                    }
                }
                two_sided(Material::Plastic {
                    eta: self.index(parameters, "eta", 1.5)?,
                    diffuse_reflectance: color(self, "reflectance", 0.5)?,
                    specular_reflectance: Rgb::ONE.into(),
                    nonlinear: true,
                    roughness: self.roughness(parameters, "", 0.0)?,
                })
            }
            "conductor" => two_sided(self.conductor(parameters, "")?),
            "coatedconductor" => {
                parameters.ignore(&[
                    "interface.roughness",
                    "interface.eta",
                    "thickness",
                    "maxdepth",
                    "nsamples",
                    "albedo",
                    "g",
                ]);
                self.warn(parameters, "the coat of a conductor is left out");
                two_sided(self.conductor(parameters, "conductor.")?)
            }
            "dielectric" => Material::Dielectric {
                eta: self.index(parameters, "eta", 1.5)?,
                roughness: self.roughness(parameters, "", 0.0)?,
                specular_reflectance: Rgb::ONE.into(),
                specular_transmittance: Rgb::ONE.into(),
            },
            "thindielectric" => Material::ThinDielectric {
                eta: self.index(parameters, "eta", 1.5)?,
                specular_reflectance: Rgb::ONE.into(),
                specular_transmittance: Rgb::ONE.into(),
            },
            "mix" => {
                let names = parameters.texts("materials")?.unwrap_or_default().to_vec();
                let [first, second] = &names[..] else {
                    return Err(parameters.malformed("a mix needs two materials"));
                };
                let mut part = |name: &String| -> Result<Box<Material>, ImportError> {
                    let index = self.named_materials.get(name).copied();
                    let index = index
                        .ok_or_else(|| parameters.malformed(format!("no material is named `{name}`")))?;
                    let material = self.description.materials[index as usize].clone();
                    Ok(Box::new(match material {
                        Material::Relief { base, .. } => {
                            self.warn(parameters, "a mix keeps its normals");
                            *base
                        }
                        other => other,
                    }))
                };
                let (first, second) = (part(first)?, part(second)?);
                let weight = self.float(parameters, "amount", 0.5)?;
                Material::Blend {
                    weight,
                    first,
                    second,
                }
            }
            "interface" | "" | "none" => Material::Null,
            "subsurface" => {
                self.warn(parameters, "a subsurface material is taken as a diffuse one");
                two_sided(Material::Diffuse {
                    reflectance: color(self, "reflectance", 0.5)?,
                })
            }
            "diffusetransmission" | "hair" | "measured" => {
                self.warn(
                    parameters,
                    format!("the material `{kind}` is taken as a diffuse one"),
                );
                two_sided(Material::Diffuse {
                    reflectance: color(self, "reflectance", 0.25)?,
                })
            }
            _ => {
                return Err(
                    parameters.unsupported(format!("the material `{kind}` is not supported{UPGRADE}"))
                );
            }
        };
        if let Some(relief) = self.relief(parameters)?
            && !matches!(material, Material::Null)
        {
            material = Material::Relief {
                relief: Box::new(relief),
                base: Box::new(material),
            };
        }
        parameters.ignore(&["type"]);
        self.warn_left_over(parameters);
        Ok(material)
    }

    /// A map of normals or heights.
    fn relief(&mut self, parameters: &Parameters) -> Result<Option<Relief>, ImportError> {
        if let Some(file) = parameters.text("normalmap")? {
            let texture = self.image_texture(parameters, file, Encoding::Linear)?;
            return Ok(Some(Relief::Normals {
                texture: ColorTexture::Image(texture),
                scale: 1.0,
                follows_mirroring: false,
            }));
        }
        if parameters.get("displacement").is_some() {
            return Ok(Some(Relief::Heights {
                texture: self.float(parameters, "displacement", 0.0)?,
                scale: 1.0,
            }));
        }
        Ok(None)
    }

    fn conductor(&mut self, parameters: &Parameters, prefix: &str) -> Result<Material, ImportError> {
        let name = |own: &str| format!("{prefix}{own}");
        let roughness = self.roughness(parameters, prefix, 0.0)?;
        if parameters.get(&name("reflectance")).is_some() {
            return Ok(match roughness {
                None => Material::Mirror {
                    reflectance: self.color(parameters, &name("reflectance"), 1.0)?,
                },
                Some(_) => Material::Conductor {
                    ior: ConductorIor {
                        eta: Rgb::ZERO,
                        k: Rgb::ONE,
                    },
                    roughness,
                    specular_reflectance: self.color(parameters, &name("reflectance"), 1.0)?,
                },
            });
        }
        let metal = |parameter: Option<&Parameter>| match parameter.map(|parameter| &parameter.values) {
            Some(Values::Texts(texts)) => Some(texts.first()?.split('-').nth(1)?.to_owned()),
            None => Some("Cu".to_owned()),
            _ => None,
        };
        let (eta, k) = (name("eta"), name("k"));
        let ior = match (metal(parameters.get(&eta)), metal(parameters.get(&k))) {
            (Some(metal), Some(_)) => {
                let known = match metal.as_str() {
                    "CuZn" => ior::conductor("Cu"),
                    metal => ior::conductor(metal).or_else(|| ior::roughly(metal)),
                };
                match known.or_else(|| ior::conductor("Al")) {
                    Some(ior) if known.is_none() => {
                        self.warn(
                            parameters,
                            format!("no figures for the metal `{metal}`: aluminium is taken"),
                        );
                        ior
                    }
                    Some(ior) => ior,
                    None => return Err(parameters.unsupported(format!("no figures for the metal `{metal}`"))),
                }
            }
            _ => ConductorIor {
                eta: self.constant(parameters, &eta, 1.0)?,
                k: self.constant(parameters, &k, 1.0)?,
            },
        };
        Ok(Material::Conductor {
            ior,
            roughness,
            specular_reflectance: Rgb::ONE.into(),
        })
    }

    /// A colour that does not vary; spectra by wavelength keep their level.
    fn constant(&mut self, parameters: &Parameters, name: &str, default: f32) -> Result<Rgb, ImportError> {
        if let Some(parameter) = parameters.get(name).filter(|of| of.kind == "spectrum") {
            let points = match &parameter.values {
                Values::Numbers(numbers) => super::light::spectrum_points(numbers),
                Values::Texts(texts) => match texts.first() {
                    Some(file) => Some(self.spectrum_file(parameters, file)?),
                    None => None,
                },
                Values::Flags(_) => None,
            };
            let points = points
                .ok_or_else(|| parameters.malformed(format!("the wavelengths of `{name}` must ascend")))?;
            return Ok(spectrum::levels(&points));
        }
        Ok(self.color(parameters, name, default)?.mean())
    }

    /// An index of refraction, a number or the name of a glass.
    fn index(&mut self, parameters: &Parameters, name: &str, default: f32) -> Result<f32, ImportError> {
        let eta = match parameters.get(name).map(|parameter| &parameter.values) {
            Some(Values::Texts(texts)) => {
                let glass = texts.first().map_or("", String::as_str);
                match glass {
                    "glass-BK7" => 1.5168,
                    "glass-BAF10" => 1.67,
                    "glass-FK51A" => 1.4866,
                    "glass-LASF9" => 1.8503,
                    "glass-F5" | "glass-SF5" => 1.6727,
                    "glass-SF10" => 1.7283,
                    "glass-SF11" => 1.7847,
                    "diamond" => 2.417,
                    _ => {
                        self.warn(parameters, format!("no index for `{glass}`: 1.5 is taken"));
                        1.5
                    }
                }
            }
            Some(Values::Numbers(numbers)) if numbers.len() > 1 => {
                let values: Vec<f64> = numbers.as_chunks::<2>().0.iter().map(|pair| pair[1]).collect();
                (values.iter().sum::<f64>() / values.len() as f64) as f32
            }
            _ => parameters.float(name, default)?,
        };
        if eta > 0.0 && eta.is_finite() {
            Ok(eta)
        } else {
            Err(parameters.malformed(format!("`{name}` must be positive, found {eta}")))
        }
    }

    /// GGX with `α = √roughness` unless `remaproughness` is false.
    fn roughness(
        &mut self,
        parameters: &Parameters,
        prefix: &str,
        default: f32,
    ) -> Result<Option<Roughness>, ImportError> {
        let name = |own: &str| format!("{prefix}{own}");
        let remap = parameters.flag("remaproughness", true)?;
        let both = self.float(parameters, &name("roughness"), default)?;
        let side = |this: &mut Self, own: &str| -> Result<f32, ImportError> {
            let texture = match parameters.get(&name(own)) {
                Some(_) => this.float(parameters, &name(own), default)?,
                None => both.clone(),
            };
            if !matches!(texture, FloatTexture::Constant(_)) {
                this.warn(parameters, "a roughness that varies is its mean");
            }
            let value = texture.mean().max(0.0);
            Ok(if remap { value.sqrt() } else { value })
        };
        let (u, v) = (side(self, "uroughness")?, side(self, "vroughness")?);
        // Smoother than this is smooth in pbrt, too.
        Ok((u.max(v) >= 1e-3).then(|| Roughness {
            distribution: Microfacet::Ggx,
            alpha_u: FloatTexture::Constant(u.max(1e-3)),
            alpha_v: FloatTexture::Constant(v.max(1e-3)),
        }))
    }

    /// A colour that may vary.
    pub(super) fn color(
        &mut self,
        parameters: &Parameters,
        name: &str,
        default: f32,
    ) -> Result<ColorTexture, ImportError> {
        let Some(parameter) = parameters.get(name) else {
            return Ok(Rgb::splat(default).into());
        };
        match (&parameter.values, parameter.kind.as_str()) {
            (Values::Texts(texts), "texture") => {
                let texture = texts.first().and_then(|name| self.colors.get(name)).cloned();
                texture.ok_or_else(|| parameters.malformed(format!("`{name}` names no texture of colours")))
            }
            (Values::Numbers(numbers), "spectrum") => {
                let points = super::light::spectrum_points(numbers);
                let points = points.ok_or_else(|| {
                    parameters.malformed(format!("the wavelengths of `{name}` must ascend"))
                })?;
                Ok(spectrum::color(&points, SpectrumOf::Reflectance).into())
            }
            (Values::Texts(texts), "spectrum")
                if texts.first().is_some_and(|file| file.ends_with(".spd")) =>
            {
                let points = self.spectrum_file(parameters, &texts[0])?;
                Ok(spectrum::color(&points, SpectrumOf::Reflectance).into())
            }
            (Values::Numbers(numbers), _) => Ok(parameters.color_of(name, numbers)?.into()),
            _ => Err(parameters.unsupported(format!("`{name}` is no colour that is known"))),
        }
    }

    /// A number that may vary.
    pub(super) fn float(
        &mut self,
        parameters: &Parameters,
        name: &str,
        default: f32,
    ) -> Result<FloatTexture, ImportError> {
        match parameters.get(name).map(|parameter| &parameter.values) {
            Some(Values::Texts(texts)) => {
                let texture = texts.first().and_then(|name| self.floats.get(name)).cloned();
                texture.ok_or_else(|| parameters.malformed(format!("`{name}` names no texture of numbers")))
            }
            _ => Ok(FloatTexture::Constant(parameters.float(name, default)?)),
        }
    }

    pub(super) fn texture(
        &mut self,
        name: &str,
        kind: &str,
        parameters: &Parameters,
    ) -> Result<(), ImportError> {
        let class = parameters.what.split('"').nth(1).unwrap_or_default().to_owned();
        let is_color = match kind {
            "spectrum" | "color" => true,
            "float" => false,
            _ => return Err(parameters.malformed(format!("`{kind}` is no kind of texture"))),
        };
        let texture = match class.as_str() {
            "imagemap" => {
                let file = parameters.text("filename")?.map(str::to_owned);
                let file = file.ok_or_else(|| parameters.malformed("`filename` is missing"))?;
                let encoding = match parameters.text("encoding")? {
                    Some("linear") => Encoding::Linear,
                    _ => Encoding::Srgb,
                };
                ColorTexture::Image(self.image_texture(parameters, &file, encoding)?)
            }
            "constant" => self.value(parameters, "value", is_color)?,
            "scale" => {
                let scale = self.value(parameters, "scale", false)?.mean();
                match self.value(parameters, "tex", is_color)? {
                    ColorTexture::Image(image) => ColorTexture::Image(ImageTexture {
                        scale: image.scale * scale,
                        ..image
                    }),
                    other => (other.mean() * scale).into(),
                }
            }
            "checkerboard" => ColorTexture::Checkerboard(Checkerboard {
                color0: self.value(parameters, "tex1", is_color)?.mean(),
                color1: self.value(parameters, "tex2", is_color)?.mean(),
                // A square is as large as the unit square of texture coordinates.
                to_uv: uv_map(parameters, 0.5)?,
            }),
            "mix" | "directionmix" => {
                self.warn(parameters, "a mix of textures is its mean");
                let [a, b] = ["tex1", "tex2"].map(|name| self.value(parameters, name, is_color));
                (0.5 * (a?.mean() + b?.mean())).into()
            }
            _ => {
                self.warn(
                    parameters,
                    format!("the texture `{class}` is not supported: one half is taken"),
                );
                Rgb::splat(0.5).into()
            }
        };
        if is_color {
            self.colors.insert(name.to_owned(), texture);
        } else {
            let texture = match texture {
                ColorTexture::Image(image) => FloatTexture::Image(image, Channel::Red),
                other => FloatTexture::Constant(luminance(other.mean())),
            };
            self.floats.insert(name.to_owned(), texture);
        }
        self.warn_left_over(parameters);
        Ok(())
    }

    /// A parameter of a texture, of its own kind.
    fn value(
        &mut self,
        parameters: &Parameters,
        name: &str,
        is_color: bool,
    ) -> Result<ColorTexture, ImportError> {
        if is_color {
            return self.color(parameters, name, 1.0);
        }
        Ok(match self.float(parameters, name, 1.0)? {
            FloatTexture::Image(image, _) => ColorTexture::Image(image),
            other => Rgb::splat(other.mean()).into(),
        })
    }

    /// The image in a file, over texture coordinates.
    fn image_texture(
        &mut self,
        parameters: &Parameters,
        file: &str,
        encoding: Encoding,
    ) -> Result<ImageTexture, ImportError> {
        let key = (self.folder.join(file), encoding);
        let image: Arc<Image> = match self.images.get(&key) {
            Some(image) => image.clone(),
            None => {
                let image = match read_within(&key.0, encoding, self.loading) {
                    Ok(image) => image,
                    Err(source @ ImportError::OverBudget { .. }) => {
                        return Err(ImportError::Referenced {
                            location: parameters.location(),
                            source: Box::new(source),
                        });
                    }
                    Err(source) => {
                        let message = format!("grey is taken for an image: {}", source.chain());
                        self.warn(parameters, message);
                        Image::from_linear(1, 1, vec![[0.5; 3]])
                            .ok_or_else(|| parameters.malformed("an empty image"))?
                    }
                };
                let image = Arc::new(image);
                self.images.insert(key, image.clone());
                image
            }
        };
        if parameters.flag("invert", false)? {
            self.warn(parameters, "an inverted image is taken as it is");
        }
        let scale = parameters.float("scale", 1.0)?;
        Ok(ImageTexture {
            image,
            to_uv: uv_map(parameters, 1.0)?,
            filter: match parameters.text("filter")? {
                Some("point") => Filter::Nearest,
                _ => Filter::Bilinear,
            },
            wrap: match parameters.text("wrap")? {
                Some("clamp" | "black") => Wrap::Clamp,
                _ => Wrap::Repeat,
            },
            scale: Rgb::splat(scale.max(0.0)),
        })
    }
}

/// `(u, v)` of pbrt is `(su u + du, sv v + dv)` with `v` upwards; textures here have it downwards.
fn uv_map(parameters: &Parameters, size: f32) -> Result<Affine2, ImportError> {
    parameters.ignore(&["mapping", "maxanisotropy", "dimension"]);
    let scale = Vec2::new(parameters.float("uscale", 1.0)?, parameters.float("vscale", 1.0)?) * size;
    let shift = Vec2::new(parameters.float("udelta", 0.0)?, parameters.float("vdelta", 0.0)?) * size;
    // 1 − (sv v + dv) with v = 1 − t.
    let moved = Vec2::new(shift.x, 1.0 - scale.y - shift.y);
    Ok(Affine2::from_scale_angle_translation(scale, 0.0, moved))
}

/// A material that is seen from both sides alike.
fn two_sided(material: Material) -> Material {
    Material::TwoSided {
        front: Box::new(material),
        back: None,
    }
}
