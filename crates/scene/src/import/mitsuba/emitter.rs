//! Emitters that are no surface, and the emission of those that are.

use super::Importer;
use super::properties::Properties;
use crate::import::error::ImportError;
use crate::import::image::Encoding;
use crate::import::xml::Node;
use crate::{ColorTexture, EmitterDescription, EnvironmentMap, ImageTexture, Rgb};
use glam::{DAffine3, DVec3, Vec3};

impl Importer<'_> {
    pub(super) fn emitter(&mut self, node: &Node) -> Result<(), ImportError> {
        let properties = Properties::new(node)?;
        // Weights of Mitsuba's choice among emitters; here the integrator decides.
        properties.ignore(&["sampling_weight"]);
        let color = |name| Ok::<Rgb, ImportError>(properties.color(name)?.unwrap_or(Rgb::ONE));
        let emitter = match properties.kind()? {
            "point" => EmitterDescription::Point {
                position: position(&properties)?.as_vec3(),
                intensity: color("intensity")?,
            },
            "spot" => {
                if properties.get("texture").is_some() {
                    self.warn(node, "the texture of a spot light is not supported: left out");
                }
                let to_world = properties.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
                let cutoff = properties.positive("cutoff_angle")?.unwrap_or(20.0);
                let beam = properties.float("beam_width")?.unwrap_or(0.75 * cutoff);
                if !(0.0..=cutoff).contains(&beam) || cutoff > 180.0 {
                    return Err(node.malformed(format!(
                        "expected 0 ≤ `beam_width` ≤ `cutoff_angle` ≤ 180, found {beam} and {cutoff}"
                    )));
                }
                EmitterDescription::Spot {
                    position: to_world.translation.as_vec3(),
                    direction: axis(node, to_world.matrix3.z_axis)?,
                    intensity: color("intensity")?,
                    beam_width: beam.to_radians(),
                    cutoff_angle: cutoff.to_radians(),
                }
            }
            "directional" => {
                let direction = match (properties.vector("direction")?, properties.transform("to_world")?) {
                    (Some(_), Some(_)) => {
                        return Err(node.malformed("`direction` and `to_world` exclude each other"));
                    }
                    (Some(direction), None) => direction,
                    (None, map) => map.unwrap_or(DAffine3::IDENTITY).matrix3.z_axis,
                };
                EmitterDescription::Directional {
                    direction: axis(node, direction)?,
                    irradiance: color("irradiance")?,
                }
            }
            "constant" => EmitterDescription::Constant {
                radiance: color("radiance")?,
            },
            "envmap" => self.environment(&properties)?,
            "area" => return Err(node.malformed("an area emitter belongs into a shape")),
            _ => {
                return self
                    .emitters_instead(&properties)?
                    .into_iter()
                    .try_for_each(|emitter| self.add_emitter(node, emitter));
            }
        };
        self.finish(&properties);
        self.add_emitter(node, emitter)
    }

    fn add_emitter(&mut self, node: &Node, emitter: EmitterDescription) -> Result<(), ImportError> {
        let surrounds = |e: &EmitterDescription| {
            matches!(
                e,
                EmitterDescription::Constant { .. } | EmitterDescription::Environment(_)
            )
        };
        if surrounds(&emitter) && self.description.emitters.iter().any(surrounds) {
            return Err(node.malformed("a second environment"));
        }
        self.description.emitters.push(emitter);
        Ok(())
    }

    fn environment(&mut self, properties: &Properties) -> Result<EmitterDescription, ImportError> {
        let node = properties.node;
        let file = properties
            .string("filename")?
            .ok_or_else(|| node.malformed("`filename` is missing"))?;
        properties.ignore(&["mis_compensation"]);
        let image = self.image(node, file, Encoding::Srgb)?;
        let to_world = properties.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
        let scale = properties.float("scale")?.unwrap_or(1.0);
        if scale < 0.0 {
            return Err(node.malformed(format!("`scale` is negative: {scale}")));
        }
        Ok(EmitterDescription::Environment(EnvironmentMap {
            image,
            scale,
            to_world: to_world.as_affine3a(),
        }))
    }

    /// Radiance of an area emitter inside a shape, and what it is multiplied by.
    pub(super) fn area_radiance(&mut self, node: &Node) -> Result<(Rgb, Option<ImageTexture>), ImportError> {
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        if kind == "directionalarea" {
            self.warn(
                node,
                "a `directionalarea` emits in all directions, not along its normal alone",
            );
        } else if kind != "area" {
            return Err(node.malformed(format!("a shape can hold an area emitter, not `{kind}`")));
        }
        properties.ignore(&["sampling_weight"]);
        let is_texture = |child: &Node| matches!(child.tag.as_str(), "texture" | "ref");
        let radiance = if properties.get("radiance").is_some_and(is_texture) {
            match self.color_texture(&properties, "radiance", 1.0)? {
                ColorTexture::Image(texture) => (Rgb::ONE, Some(texture)),
                other => (other.mean(), None),
            }
        } else {
            (properties.color("radiance")?.unwrap_or(Rgb::ONE), None)
        };
        self.finish(&properties);
        Ok(radiance)
    }
}

fn position(properties: &Properties) -> Result<DVec3, ImportError> {
    match (properties.vector("position")?, properties.transform("to_world")?) {
        (Some(_), Some(_)) => Err(properties
            .node
            .malformed("`position` and `to_world` exclude each other")),
        (Some(position), None) => Ok(position),
        (None, map) => Ok(map.unwrap_or(DAffine3::IDENTITY).translation),
    }
}

fn axis(node: &Node, direction: DVec3) -> Result<Vec3, ImportError> {
    direction
        .try_normalize()
        .map(|d| d.as_vec3())
        .ok_or_else(|| node.malformed("the direction has no length"))
}
