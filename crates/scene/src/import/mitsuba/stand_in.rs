//! What stands for plugins of Mitsuba's that are not done here: something like them, with a warning
//! that names both.

use super::Importer;
use super::properties::Properties;
use crate::import::error::ImportError;
use crate::import::transform::look_at;
use crate::{ColorTexture, EmitterDescription, FloatTexture, Material, Rgb};
use glam::{DAffine3, DVec3, Vec3};

/// Radiance of a clear sky and irradiance of the sun above it, in W/m² a nanometre, about noon
/// (orders of magnitude of the solar spectrum at the ground).
const SKY: Rgb = Rgb::new(0.09, 0.13, 0.20);
const SUN: Rgb = Rgb::new(1.5, 1.4, 1.2);

/// Where the sun stands if a file does not say, +Z up.
const SUN_DIRECTION: DVec3 = DVec3::new(0.4, 0.3, 0.85);

impl Importer<'_> {
    /// Leaves out the properties that nothing has asked for, with a warning for each.
    pub(super) fn finish(&mut self, properties: &Properties) {
        for (child, what) in properties.left() {
            self.warn(child, format!("{what}: left out"));
        }
    }

    /// A BSDF that stands for another.
    pub(super) fn bsdf_instead(&mut self, properties: &Properties) -> Result<Material, ImportError> {
        let node = properties.node;
        let kind = properties.kind()?;
        let material = match kind {
            "principledthin" => self.thin_principled(properties)?,
            _ => {
                self.warn(
                    node,
                    format!("the BSDF `{kind}` is not supported: a grey diffuse surface stands for it"),
                );
                Material::TwoSided {
                    front: Box::new(Material::Diffuse {
                        reflectance: ColorTexture::Constant(Rgb::splat(0.5)),
                    }),
                    back: None,
                }
            }
        };
        properties.all(|_| true);
        Ok(material)
    }

    fn thin_principled(&mut self, properties: &Properties) -> Result<Material, ImportError> {
        let node = properties.node;
        self.warn(
            node,
            "of `principledthin` colour, roughness, `eta` and transmission are taken, with what is \
             transmitted diffusely as transmitted by the surface",
        );
        let share =
            |texture: Option<FloatTexture>, default| texture.unwrap_or(FloatTexture::Constant(default));
        let diffuse = properties.float("diff_trans").ok().flatten().unwrap_or(0.0);
        let transmission = match share(self.float_texture(properties, "spec_trans")?, 0.0) {
            // Of 2: all of it is transmitted.
            FloatTexture::Constant(specular) => {
                FloatTexture::Constant(specular.max(0.5 * diffuse).clamp(0.0, 1.0))
            }
            texture => texture,
        };
        let is_opaque = matches!(transmission, FloatTexture::Constant(0.0));
        let sheet = Material::MetallicRoughness {
            base_color: self.color_texture(properties, "base_color", 0.5)?,
            metallic: FloatTexture::Constant(0.0),
            roughness: share(self.float_texture(properties, "roughness")?, 0.5),
            transmission,
            ior: properties.positive("eta")?.unwrap_or(1.5),
        };
        Ok(match is_opaque {
            true => Material::TwoSided {
                front: Box::new(sheet),
                back: None,
            },
            false => sheet,
        })
    }

    /// Emitters that stand for another, none where there is nothing like it.
    pub(super) fn emitters_instead(
        &mut self,
        properties: &Properties,
    ) -> Result<Vec<EmitterDescription>, ImportError> {
        let node = properties.node;
        let to_world = properties.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
        let scale = |name| Ok::<f32, ImportError>(properties.float(name)?.unwrap_or(1.0).max(0.0));
        let kind = properties.kind()?;
        let axis = |direction: DVec3| direction.try_normalize().map(|axis| axis.as_vec3());
        let emitters = match kind {
            "projector" => {
                self.warn(node, "a projector is a spot light of its image's mean colour");
                let color = self.color_texture(properties, "irradiance", 1.0)?.mean();
                let fov = properties
                    .positive("fov")
                    .ok()
                    .flatten()
                    .unwrap_or(45.0)
                    .min(179.0);
                let cutoff_angle = 0.5 * fov.to_radians();
                vec![EmitterDescription::Spot {
                    position: to_world.translation.as_vec3(),
                    direction: axis(to_world.matrix3.z_axis).unwrap_or(Vec3::Z),
                    intensity: color * scale("scale")?,
                    beam_width: 0.95 * cutoff_angle,
                    cutoff_angle,
                }]
            }
            "sunsky" | "timed_sunsky" => {
                self.warn(
                    node,
                    format!("`{kind}` is a sky of constant radiance and a sun without a disc"),
                );
                let sun = properties.vector("sun_direction")?.unwrap_or(SUN_DIRECTION);
                let direction = axis(to_world.matrix3 * -sun).unwrap_or(Vec3::NEG_Z);
                vec![
                    EmitterDescription::Constant {
                        radiance: SKY * scale("sky_scale")?,
                    },
                    EmitterDescription::Directional {
                        direction,
                        irradiance: SUN * scale("sun_scale")?,
                    },
                ]
            }
            _ => {
                self.warn(node, format!("the emitter `{kind}` is not supported: left out"));
                Vec::new()
            }
        };
        properties.all(|_| true);
        Ok(emitters)
    }

    /// The view of a meter that looks along one ray: a field of a fiftieth of a degree.
    pub(super) fn along_ray(properties: &Properties) -> Result<DAffine3, ImportError> {
        let own = properties.transform("to_world")?;
        match (properties.vector("origin")?, properties.vector("direction")?) {
            (Some(origin), Some(direction)) => {
                let up = if direction.x.abs() < direction.y.abs() {
                    DVec3::X
                } else {
                    DVec3::Y
                };
                look_at(origin, origin + direction, up)
                    .ok_or_else(|| properties.node.malformed("the direction has no length"))
            }
            (None, None) => Ok(own.unwrap_or(DAffine3::IDENTITY)),
            _ => Err(properties
                .node
                .malformed("`origin` and `direction` must be given together")),
        }
    }
}
