//! BSDFs to [`Material`]s.

use super::properties::Properties;
use super::{Importer, ior};
use crate::import::error::ImportError;
use crate::import::xml::Node;
use crate::{ColorTexture, ConductorIor, FloatTexture, Material, Microfacet, Rgb, Roughness};

impl Importer<'_> {
    /// Index of the material that a `bsdf` element describes; the same element always gives the
    /// same index.
    pub(super) fn material(&mut self, node: &Node) -> Result<u32, ImportError> {
        let key = std::ptr::from_ref(node);
        if let Some(&index) = self.materials.get(&key) {
            return Ok(index);
        }
        let material = self.bsdf(node)?;
        let index = self.push_material(material);
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
                let ior = conductor_ior(&properties)?;
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
                Material::Blend {
                    weight,
                    first: Box::new(first),
                    second: Box::new(second),
                }
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
                Material::TwoSided {
                    front: Box::new(front),
                    back: back.map(Box::new),
                }
            }
            "null" => Material::Null,
            "mask" => {
                let opacity = self.float_texture(&properties, "opacity")?;
                let opacity = opacity.unwrap_or(FloatTexture::Constant(0.5));
                Material::Blend {
                    weight: opacity,
                    first: Box::new(Material::Null),
                    second: Box::new(self.only_nested(&properties)?),
                }
            }
            "normalmap" | "bumpmap" => {
                properties.ignore(&[
                    "normalmap",
                    "scale",
                    "flip_invalid_normals",
                    "use_shadowing_function",
                ]);
                // The texture of a bump map has any name.
                properties.all(|child| child.tag == "texture");
                self.warn(
                    node,
                    format!("`{kind}` is not supported: the surface keeps its normals"),
                );
                self.only_nested(&properties)?
            }
            "principled" => self.principled(&properties)?,
            _ => return Err(node.unsupported(format!("the BSDF `{kind}` is not supported"))),
        };
        properties.finish()?;
        Ok(material)
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

fn transmits(material: &Material) -> bool {
    match material {
        Material::Dielectric { .. } | Material::ThinDielectric { .. } | Material::Null => true,
        Material::Blend { first, second, .. } => transmits(first) || transmits(second),
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
