//! The assumptions of [`Material::at`].

use super::bsdf::MAX_COMPONENTS;
use super::component;
use super::{ConductorIor, Material, MaterialError, Relief, Roughness, rough_coat};
use crate::{ColorTexture, FloatTexture, ImageTexture, Rgb};
use glam::Affine2;

type Check = Result<(), MaterialError>;

impl Material {
    /// Most [`Material::Blend`]s and [`Material::TwoSided`]s around one another.
    pub const MAX_DEPTH: usize = 8;
    /// Most materials that a tree of blends and sides may hold.
    pub const MAX_LEAVES: usize = MAX_COMPONENTS;

    /// Checks every parameter: colours are finite and not negative (above 1 is allowed: such a
    /// surface gains energy, as its author asked), shares likewise (they are clamped to 1 when
    /// looked up), roughness and indices of refraction positive and finite, blends and sides within
    /// [`Material::MAX_DEPTH`] and [`Material::MAX_LEAVES`], no dielectric inside a
    /// [`Material::TwoSided`] (but [`Material::Null`] may be its back), the index of a rough
    /// plastic within `[1, 3]`, where its transmittance is tabulated (the table is computed here,
    /// not on the first hit). Reads every texel of images.
    ///
    /// # Errors
    /// The first [`MaterialError`] found.
    pub fn validate(&self) -> Check {
        let within = match self {
            Self::Relief { relief, base } => {
                check_relief(relief)?;
                base
            }
            _ => self,
        };
        let leaves = within.check(Self::MAX_DEPTH, false)?;
        if leaves > Self::MAX_LEAVES {
            return Err(MaterialError::TooManyLeaves);
        }
        Ok(())
    }

    /// Counts leaves.
    fn check(&self, depth: usize, two_sided: bool) -> Result<usize, MaterialError> {
        if depth == 0 && matches!(self, Self::Blend { .. } | Self::TwoSided { .. }) {
            return Err(MaterialError::TooDeep);
        }
        match self {
            Self::Diffuse { reflectance } | Self::Mirror { reflectance } => {
                color("reflectance", reflectance)?
            }
            Self::Conductor {
                ior: ConductorIor { eta, k },
                roughness,
                specular_reflectance,
            } => {
                let sound = |v: &Rgb| v.is_finite() && v.min_element() >= 0.0;
                if !(sound(eta) && sound(k)) {
                    return Err(MaterialError::IndexOfRefraction { parameter: "ior" });
                }
                alpha(roughness)?;
                color("specular_reflectance", specular_reflectance)?;
            }
            Self::Dielectric {
                eta,
                roughness,
                specular_reflectance,
                specular_transmittance,
            } => {
                refuse_two_sided(two_sided)?;
                index("eta", *eta)?;
                alpha(roughness)?;
                color("specular_reflectance", specular_reflectance)?;
                color("specular_transmittance", specular_transmittance)?;
            }
            Self::Null => refuse_two_sided(two_sided)?,
            Self::ThinDielectric {
                eta,
                specular_reflectance,
                specular_transmittance,
            } => {
                refuse_two_sided(two_sided)?;
                index("eta", *eta)?;
                color("specular_reflectance", specular_reflectance)?;
                color("specular_transmittance", specular_transmittance)?;
            }
            Self::Plastic {
                eta,
                diffuse_reflectance,
                specular_reflectance,
                nonlinear: _,
                roughness,
            } => {
                index("eta", *eta)?;
                alpha(roughness)?;
                if let Some(roughness) = roughness {
                    if !(1.0..=rough_coat::MAX_ETA).contains(eta) {
                        return Err(MaterialError::IndexOfRefraction { parameter: "eta" });
                    }
                    rough_coat::prepare(roughness.distribution);
                }
                color("diffuse_reflectance", diffuse_reflectance)?;
                color("specular_reflectance", specular_reflectance)?;
            }
            Self::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                transmission,
                ior,
            } => {
                color("base_color", base_color)?;
                share("metallic", metallic)?;
                share("roughness", roughness)?;
                share("transmission", transmission)?;
                // KHR_materials_ior uses zero for a reflectance of one.
                if *ior != 0.0 {
                    index("ior", *ior)?;
                }
            }
            Self::Layered { base, layers } => {
                // Light that passes the base would have to pass the layers, too.
                if !matches!(
                    **base,
                    Self::MetallicRoughness {
                        transmission: FloatTexture::Constant(0.0),
                        ..
                    }
                ) {
                    return Err(MaterialError::Layers);
                }
                component::prepare_sheen();
                share("coat", &layers.coat)?;
                share("coat_roughness", &layers.coat_roughness)?;
                color("sheen", &layers.sheen)?;
                share("sheen_roughness", &layers.sheen_roughness)?;
                return base.check(depth, two_sided);
            }
            Self::Relief { .. } => return Err(MaterialError::NestedRelief),
            Self::Blend {
                weight,
                first,
                second,
            } => {
                share("weight", weight)?;
                return Ok(first.check(depth - 1, two_sided)? + second.check(depth - 1, two_sided)?);
            }
            Self::TwoSided { front, back } => {
                let behind = match back.as_deref() {
                    // Nothing at all is no boundary: what is seen from one side only.
                    Some(Self::Null) => 1,
                    Some(back) => back.check(depth - 1, true)?,
                    None => 0,
                };
                return Ok(front.check(depth - 1, true)? + behind);
            }
        }
        Ok(1)
    }
}

fn check_relief(relief: &Relief) -> Check {
    let (scale, sound) = match relief {
        Relief::Normals { texture, scale, .. } => {
            color("normals", texture)?;
            (scale, true)
        }
        Relief::Heights { texture, scale } => (scale, float("heights", texture, f32::is_finite)?),
    };
    if scale.is_finite() && sound {
        Ok(())
    } else {
        Err(MaterialError::Relief)
    }
}

fn refuse_two_sided(two_sided: bool) -> Check {
    if two_sided {
        Err(MaterialError::TransmissiveTwoSided)
    } else {
        Ok(())
    }
}

fn index(parameter: &'static str, eta: f32) -> Check {
    if eta > 0.0 && eta.is_finite() {
        Ok(())
    } else {
        Err(MaterialError::IndexOfRefraction { parameter })
    }
}

fn transform(parameter: &'static str, to_uv: &Affine2) -> Check {
    if to_uv.is_finite() {
        Ok(())
    } else {
        Err(MaterialError::Transform { parameter })
    }
}

/// Whether `sound` holds for each texel times the scale.
fn texels(texture: &ImageTexture, sound: impl Fn(Rgb) -> bool) -> bool {
    texture.image.texels().all(|texel| sound(texel * texture.scale))
}

fn color(parameter: &'static str, texture: &ColorTexture) -> Check {
    let sound = |rgb: Rgb| rgb.is_finite() && rgb.min_element() >= 0.0;
    let all_sound = match texture {
        ColorTexture::Constant(rgb) => sound(*rgb),
        ColorTexture::Checkerboard(board) => {
            transform(parameter, &board.to_uv)?;
            sound(board.color0) && sound(board.color1)
        }
        ColorTexture::Image(image) => {
            transform(parameter, &image.to_uv)?;
            texels(image, sound)
        }
        ColorTexture::Vertex(other) => return color(parameter, other),
    };
    if all_sound {
        Ok(())
    } else {
        Err(MaterialError::Color { parameter })
    }
}

fn share(parameter: &'static str, texture: &FloatTexture) -> Check {
    let sound = |value: f32| value >= 0.0 && value.is_finite();
    if float(parameter, texture, sound)? {
        Ok(())
    } else {
        Err(MaterialError::Share { parameter })
    }
}

fn alpha(roughness: &Option<Roughness>) -> Check {
    let Some(roughness) = roughness else {
        return Ok(());
    };
    for (parameter, texture) in [("alpha_u", &roughness.alpha_u), ("alpha_v", &roughness.alpha_v)] {
        // A black texel means a smooth spot; it gets the least roughness.
        let sound = match texture {
            FloatTexture::Constant(alpha) => *alpha > 0.0 && alpha.is_finite(),
            FloatTexture::Image(..) | FloatTexture::Vertex(_) => {
                float(parameter, texture, |alpha| alpha >= 0.0 && alpha.is_finite())?
            }
        };
        if !sound {
            return Err(MaterialError::Roughness { parameter });
        }
    }
    Ok(())
}

fn float(
    parameter: &'static str,
    texture: &FloatTexture,
    sound: impl Fn(f32) -> bool,
) -> Result<bool, MaterialError> {
    Ok(match texture {
        FloatTexture::Constant(value) => sound(*value),
        FloatTexture::Image(image, channel) => {
            transform(parameter, &image.to_uv)?;
            texels(image, |texel| sound(channel.of(texel)))
        }
        // Colours of vertices are looked at where the mesh is.
        FloatTexture::Vertex(_) => true,
    })
}
