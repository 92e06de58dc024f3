//! BSDFs to [`Material`]s.

use super::Importer;
use super::properties::Properties;
use crate::import::error::ImportError;
use crate::import::ior;
use crate::import::xml::Node;
use crate::{ColorTexture, ConductorIor, FloatTexture, Material, Microfacet, Relief, Rgb, Roughness};

impl Importer<'_> {
    /// Index of the material that a `bsdf` element describes; the same element always gives the
    /// same index.
    pub(super) fn material(&mut self, node: &Node) -> Result<u32, ImportError> {
        let key = std::ptr::from_ref(node);
        if let Some(&index) = self.materials.get(&key) {
            return Ok(index);
        }
        self.attribute = None;
        let material = self.bsdf(node)?;
        let index = self.push_material(material);
        if let Some(attribute) = self.attribute.take() {
            self.attributes.insert(index, attribute);
        }
        self.materials.insert(key, index);
        Ok(index)
    }

    fn bsdf(&mut self, node: &Node) -> Result<Material, ImportError> {
        // References can make a few elements many.
        self.spend_node(node)?;
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        let material = match kind {
            "diffuse" => Material::Diffuse {
                reflectance: self.color_texture(&properties, "reflectance", 0.5)?,
            },
            "conductor" | "roughconductor" => {
                let roughness = self.roughness(&properties, kind == "roughconductor")?;
                let specular_reflectance = self.color_texture(&properties, "specular_reflectance", 1.0)?;
                let ior = match properties.string("material")?.map(ior::roughly) {
                    Some(Some(ior)) if !has_figures(&properties)? => {
                        if conductor_ior(&properties).is_err() {
                            self.warn(
                                node,
                                "a metal without RGB figures has those of its reflectance alone",
                            );
                        }
                        conductor_ior(&properties).unwrap_or(ior)
                    }
                    _ => conductor_ior(&properties)?,
                };
                if roughness.is_none() && Some(ior) == ior::conductor("none") {
                    Material::Mirror {
                        reflectance: specular_reflectance,
                    }
                } else {
                    Material::Conductor {
                        ior,
                        roughness,
                        specular_reflectance,
                    }
                }
            }
            "dielectric" | "roughdielectric" => Material::Dielectric {
                eta: relative_ior(&properties, "bk7")?,
                roughness: self.roughness(&properties, kind == "roughdielectric")?,
                specular_reflectance: self.color_texture(&properties, "specular_reflectance", 1.0)?,
                specular_transmittance: self.color_texture(&properties, "specular_transmittance", 1.0)?,
            },
            "thindielectric" => Material::ThinDielectric {
                eta: relative_ior(&properties, "bk7")?,
                specular_reflectance: self.color_texture(&properties, "specular_reflectance", 1.0)?,
                specular_transmittance: self.color_texture(&properties, "specular_transmittance", 1.0)?,
            },
            "pplastic" => {
                let eta = relative_ior(&properties, "polypropylene")?;
                Material::Plastic {
                    eta,
                    diffuse_reflectance: self.color_texture(&properties, "diffuse_reflectance", 0.5)?,
                    specular_reflectance: self.color_texture(&properties, "specular_reflectance", 1.0)?,
                    nonlinear: true,
                    roughness: self.roughness(&properties, true)?,
                }
            }
            "plastic" | "roughplastic" => Material::Plastic {
                eta: relative_ior(&properties, "polypropylene")?,
                diffuse_reflectance: self.color_texture(&properties, "diffuse_reflectance", 0.5)?,
                specular_reflectance: self.color_texture(&properties, "specular_reflectance", 1.0)?,
                nonlinear: properties.boolean("nonlinear")?.unwrap_or(false),
                roughness: self.roughness(&properties, kind == "roughplastic")?,
            },
            "blendbsdf" => {
                let weight = self.float_texture(&properties, "weight")?;
                let weight = weight.ok_or_else(|| node.malformed("`weight` is missing"))?;
                if matches!(weight, FloatTexture::Constant(w) if !(0.0..=1.0).contains(&w)) {
                    return Err(node.malformed("`weight` must be in [0, 1]"));
                }
                let [first, second] = self.nested(&properties)?.try_into().map_err(|found: Vec<_>| {
                    node.malformed(format!("`blendbsdf` needs two BSDFs, found {}", found.len()))
                })?;
                let (first, second) = (Layers::of(first), Layers::of(second));
                let relief = self.one_relief(node, [first.relief, second.relief]);
                with_relief(
                    relief,
                    Material::Blend {
                        weight,
                        first: first.base,
                        second: second.base,
                    },
                )
            }
            "twosided" => {
                let mut nested = self.nested(&properties)?.into_iter();
                let (front, back) = (nested.next(), nested.next());
                let Some(front) = front.filter(|_| nested.next().is_none()) else {
                    return Err(node.malformed("`twosided` needs one or two BSDFs"));
                };
                if [Some(&front), back.as_ref()].into_iter().flatten().any(transmits) {
                    return Err(node.malformed("`twosided` can hold only BSDFs that do not transmit"));
                }
                let (front, back) = (Layers::of(front), back.map(Layers::of));
                let (behind, back) = back.map_or((None, None), |back| (back.relief, Some(back.base)));
                let relief = self.one_relief(node, [front.relief, behind]);
                with_relief(
                    relief,
                    Material::TwoSided {
                        front: front.base,
                        back,
                    },
                )
            }
            "null" => Material::Null,
            "mask" => {
                let opacity = self.float_texture(&properties, "opacity")?;
                let opacity = opacity.unwrap_or(FloatTexture::Constant(0.5));
                let within = Layers::of(self.only_nested(&properties)?);
                with_relief(
                    within.relief,
                    Material::Blend {
                        weight: opacity,
                        first: Box::new(Material::Null),
                        second: within.base,
                    },
                )
            }
            "normalmap" | "bumpmap" => {
                // How to treat directions that the turned normal cannot explain.
                properties.ignore(&["flip_invalid_normals", "use_shadowing_function"]);
                let relief = match kind {
                    "normalmap" => Relief::Normals {
                        texture: self.color_texture(&properties, "normalmap", 0.5)?,
                        scale: 1.0,
                        follows_mirroring: false,
                    },
                    _ => self.heights(&properties)?,
                };
                let within = Layers::of(self.only_nested(&properties)?);
                let relief = self.one_relief(node, [Some(Box::new(relief)), within.relief]);
                with_relief(relief, *within.base)
            }
            "principled" => self.principled(&properties)?,
            "polarizer" | "retarder" | "circular" => {
                properties.ignore(&[
                    "theta",
                    "transmittance",
                    "delta",
                    "left_handed",
                    "polarizing",
                    "in_polarize_dir",
                ]);
                self.warn(
                    node,
                    format!("`{kind}` lets all light pass: there is no polarization"),
                );
                Material::Null
            }
            _ => self.bsdf_instead(&properties)?,
        };
        self.finish(&properties);
        Ok(material)
    }

    /// The heights of a bump map, whose texture has any name.
    fn heights(&mut self, properties: &Properties) -> Result<Relief, ImportError> {
        let node = properties.node;
        let scale = properties.float("scale")?.unwrap_or(1.0);
        let is_texture = |child: &Node| match child.tag.as_str() {
            "texture" => true,
            "ref" => self.any_target(child).is_ok_and(|target| target.tag == "texture"),
            _ => false,
        };
        let textures = properties.all(is_texture);
        let [texture] = textures[..] else {
            let found = textures.len();
            return Err(node.malformed(format!("a bump map needs one texture, found {found}")));
        };
        let texture = match texture.tag.as_str() {
            "ref" => self.target(texture, "texture")?,
            _ => texture,
        };
        let texture = self.texture(texture)?;
        Ok(Relief::Heights {
            texture: Self::luminance(node, texture)?,
            scale,
        })
    }

    /// The first of the reliefs in a material, which can have one.
    fn one_relief(&mut self, node: &Node, [first, second]: [Option<Box<Relief>>; 2]) -> Option<Box<Relief>> {
        if first.is_some() && second.is_some() {
            self.warn(
                node,
                "a surface has one normal or bump map at most: the second is left out",
            );
        }
        first.or(second)
    }

    /// The one BSDF within another.
    fn only_nested(&mut self, properties: &Properties) -> Result<Material, ImportError> {
        let nested = self.nested(properties)?;
        let [one] = <[Material; 1]>::try_from(nested).map_err(|found| {
            let found = found.len();
            properties
                .node
                .malformed(format!("one BSDF is needed within, found {found}"))
        })?;
        Ok(one)
    }

    /// Disney's BSDF as far as a metallic-roughness material goes: base colour, metalness,
    /// roughness and transmission.
    fn principled(&mut self, properties: &Properties) -> Result<Material, ImportError> {
        let left_out = [
            "anisotropic",
            "spec_tint",
            "sheen",
            "sheen_tint",
            "clearcoat",
            "clearcoat_gloss",
            "flatness",
            "diff_trans",
        ];
        for name in left_out {
            let is_zero = |node: &Node| {
                node.attribute("value")
                    .is_some_and(|value| value.trim().parse() == Ok(0.0))
            };
            if properties.get(name).is_some_and(|node| !is_zero(node)) {
                self.warn(
                    properties.node,
                    format!("`{name}` of `principled` is not supported: left out"),
                );
            }
        }
        properties.ignore(&[
            "main_specular_sampling_rate",
            "clearcoat_sampling_rate",
            "diffuse_reflectance_sampling_rate",
        ]);
        let share =
            |texture: Option<FloatTexture>, default| texture.unwrap_or(FloatTexture::Constant(default));
        // Reflectance at normal incidence is 0.08 times `specular`.
        let specular = properties.float("specular")?.unwrap_or(0.5).clamp(0.0, 1.0);
        let root = (0.08 * specular).sqrt();
        let eta = properties.positive("eta")?.unwrap_or((1.0 + root) / (1.0 - root));
        Ok(Material::MetallicRoughness {
            base_color: self.color_texture(properties, "base_color", 0.5)?,
            metallic: share(self.float_texture(properties, "metallic")?, 0.0),
            roughness: share(self.float_texture(properties, "roughness")?, 0.5),
            transmission: share(self.float_texture(properties, "spec_trans")?, 0.0),
            ior: eta,
        })
    }

    /// The BSDFs nested in or referred to by another.
    fn nested(&mut self, properties: &Properties) -> Result<Vec<Material>, ImportError> {
        // A reference may be to a texture.
        let is_other = |child: &Node| {
            let target = self.any_target(child).ok();
            target.is_some_and(|target| target.tag == "texture")
        };
        let children = properties.all(|child| match child.tag.as_str() {
            "bsdf" => true,
            "ref" => !is_other(child),
            _ => false,
        });
        let mut materials = Vec::with_capacity(children.len());
        for child in children {
            let target = if child.tag == "ref" {
                self.target(child, "bsdf")?
            } else {
                child
            };
            self.depth += 1;
            // References can run in circles.
            if self.depth > 16 {
                return Err(child.malformed("BSDFs are nested more than 16 deep"));
            }
            materials.push(self.bsdf(target)?);
            self.depth -= 1;
        }
        Ok(materials)
    }

    fn roughness(&mut self, properties: &Properties, rough: bool) -> Result<Option<Roughness>, ImportError> {
        if !rough {
            return Ok(None);
        }
        let node = properties.node;
        // How to sample, not what is reflected.
        properties.ignore(&["sample_visible"]);
        let distribution = match properties.string("distribution")?.unwrap_or("beckmann") {
            "ggx" => Microfacet::Ggx,
            "beckmann" => Microfacet::Beckmann,
            other => return Err(node.unsupported(format!("unknown `distribution` `{other}`"))),
        };
        let both = self.float_texture(properties, "alpha")?;
        let sides = (
            self.float_texture(properties, "alpha_u")?,
            self.float_texture(properties, "alpha_v")?,
        );
        let (alpha_u, alpha_v) = match (both, sides) {
            (None, (Some(u), Some(v))) => (u, v),
            (Some(alpha), (None, None)) => (alpha.clone(), alpha),
            (None, (None, None)) => (FloatTexture::Constant(0.1), FloatTexture::Constant(0.1)),
            _ => return Err(node.malformed("give either `alpha` or both `alpha_u` and `alpha_v`")),
        };
        if [&alpha_u, &alpha_v]
            .iter()
            .any(|a| matches!(a, FloatTexture::Constant(a) if *a <= 0.0))
        {
            return Err(node.malformed("`alpha` must be positive"));
        }
        Ok(Some(Roughness {
            distribution,
            alpha_u,
            alpha_v,
        }))
    }

    pub(super) fn push_material(&mut self, material: Material) -> u32 {
        self.description.materials.push(material);
        (self.description.materials.len() - 1) as u32
    }

    /// Mitsuba's material of a shape without one: Lambertian of albedo one half.
    pub(super) fn default_material(&mut self) -> u32 {
        match self.default_material {
            Some(index) => index,
            None => {
                let index = self.push_material(Material::Diffuse {
                    reflectance: ColorTexture::Constant(Rgb::splat(0.5)),
                });
                self.default_material = Some(index);
                index
            }
        }
    }
}

/// A material and the relief around it.
struct Layers {
    relief: Option<Box<Relief>>,
    base: Box<Material>,
}

impl Layers {
    fn of(material: Material) -> Self {
        match material {
            Material::Relief { relief, base } => Self {
                relief: Some(relief),
                base,
            },
            base => Self {
                relief: None,
                base: Box::new(base),
            },
        }
    }
}

fn with_relief(relief: Option<Box<Relief>>, base: Material) -> Material {
    match relief {
        Some(relief) => Material::Relief {
            relief,
            base: Box::new(base),
        },
        None => base,
    }
}

fn transmits(material: &Material) -> bool {
    match material {
        Material::Dielectric { .. } | Material::ThinDielectric { .. } | Material::Null => true,
        Material::Blend { first, second, .. } => transmits(first) || transmits(second),
        Material::Relief { base, .. } => transmits(base),
        _ => false,
    }
}

/// `int_ior / ext_ior`, each a number or a name.
fn relative_ior(properties: &Properties, interior: &str) -> Result<f32, ImportError> {
    let side = |name: &str, default: &str| -> Result<f32, ImportError> {
        let named = |text: &str| {
            ior::dielectric(text).ok_or_else(|| {
                properties
                    .node
                    .unsupported(format!("`{name}`: unknown material `{text}`"))
            })
        };
        match properties.get(name) {
            None => named(default),
            Some(child) if child.tag == "string" => named(child.require("value")?),
            Some(_) => properties.positive(name)?.map_or_else(|| named(default), Ok),
        }
    };
    Ok(side("int_ior", interior)? / side("ext_ior", "air")?)
}

/// Whether a conductor has its own indices.
fn has_figures(properties: &Properties) -> Result<bool, ImportError> {
    Ok(properties.color("eta")?.is_some() || properties.color("k")?.is_some())
}

/// Mitsuba's rule: `eta` and `k` if given, else the named material, else `none`.
fn conductor_ior(properties: &Properties) -> Result<ConductorIor, ImportError> {
    let node = properties.node;
    let material = properties.string("material")?;
    match (properties.color("eta")?, properties.color("k")?, material) {
        (None, None, name) => {
            let name = name.unwrap_or("none");
            ior::conductor(name).ok_or_else(|| {
                node.unsupported(format!(
                    "no RGB figures for the conductor `{name}`; known are none, Ag, Al, Au, Cu, or give `eta` and `k`"
                ))
            })
        }
        (Some(eta), Some(k), None | Some("none")) => Ok(ConductorIor { eta, k }),
        (_, _, None | Some("none")) => Err(node.malformed("`eta` and `k` must be given together")),
        _ => Err(node.malformed("`material` and `eta`, `k` exclude each other")),
    }
}
