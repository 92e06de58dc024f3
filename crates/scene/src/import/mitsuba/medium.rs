//! Media, their volumes and phase functions.

use super::Importer;
use super::properties::Properties;
use super::values;
use crate::import::error::ImportError;
use crate::import::spectrum::SpectrumOf;
use crate::import::vol::parse_vol;
use crate::import::xml::Node;
use crate::{DensityDescription, GridDescription, GridFilter, MediumDescription, PhaseDescription, Rgb};
use glam::{DAffine3, DVec3};

/// What a volume property is.
enum Volume {
    Constant(Rgb),
    Grid(GridDescription),
    /// Grids, one a channel.
    Varying(Vec<GridDescription>),
}

impl Importer<'_> {
    /// Index of the medium that a `medium` element describes; the same element always gives the
    /// same index.
    pub(super) fn medium(&mut self, node: &Node) -> Result<u32, ImportError> {
        let key = std::ptr::from_ref(node);
        if let Some(&index) = self.media.get(&key) {
            return Ok(index);
        }
        let medium = self.medium_description(node)?;
        self.description.media.push(medium);
        let index = self.description.media.len() as u32 - 1;
        self.media.insert(key, index);
        Ok(index)
    }

    /// The medium that a child of a shape or sensor is or refers to.
    pub(super) fn medium_of(&mut self, child: &Node) -> Result<u32, ImportError> {
        let target = if child.tag == "ref" {
            self.target(child, "medium")?
        } else {
            child
        };
        self.medium(target)
    }

    fn medium_description(&mut self, node: &Node) -> Result<MediumDescription, ImportError> {
        let properties = Properties::new(node)?;
        let kind = properties.kind()?;
        // How to sample, or what follows from the figures.
        properties.ignore(&[
            "sample_emitters",
            "has_spectral_extinction",
            "majorant_resolution_factor",
        ]);
        let scale = properties.float("scale")?.unwrap_or(1.0);
        if scale < 0.0 {
            return Err(node.malformed(format!("`scale` is negative: {scale}")));
        }
        let (density, extinction) = match (kind, self.volume(&properties, "sigma_t")?) {
            ("homogeneous" | "heterogeneous", Some(Volume::Constant(value))) => {
                (DensityDescription::Homogeneous, value)
            }
            ("homogeneous" | "heterogeneous", None) => (DensityDescription::Homogeneous, Rgb::ONE),
            ("heterogeneous", Some(Volume::Grid(grid))) => (DensityDescription::Grid(grid), Rgb::ONE),
            (_, Some(Volume::Varying(_))) | ("homogeneous", Some(Volume::Grid(_))) => {
                return Err(node.malformed("`sigma_t` of a homogeneous medium cannot be a grid"));
            }
            _ => return Err(node.unsupported(format!("the medium `{kind}` is not supported"))),
        };
        let extinction = extinction * scale;
        if !extinction.is_finite() {
            return Err(node.malformed("`sigma_t` times `scale` is out of range"));
        }
        let is_share = |grid: &GridDescription| grid.values.iter().all(|&value| value <= 1.0);
        let (albedo, albedo_grids) = match self.volume(&properties, "albedo")? {
            None => (Rgb::splat(0.75), Vec::new()),
            Some(Volume::Constant(albedo)) if albedo.max_element() <= 1.0 => (albedo, Vec::new()),
            Some(Volume::Grid(grid)) if is_share(&grid) => (Rgb::ONE, vec![grid]),
            Some(Volume::Varying(grids)) if grids.iter().all(is_share) => (Rgb::ONE, grids),
            Some(_) => return Err(node.malformed("`albedo` must be in [0, 1]")),
        };
        let phase = properties.all(|child| {
            child.tag == "phase" || (child.tag == "ref" && child.attribute("name") == Some("phase"))
        });
        let phase = match phase[..] {
            [] => PhaseDescription::Isotropic,
            [one] => self.phase(one, true)?,
            [_, second, ..] => return Err(second.malformed("a second <phase>")),
        };
        self.finish(&properties);
        let name = match node.attribute("id") {
            Some(id) => id.to_owned(),
            None => format!("{kind} {}", self.description.media.len()),
        };
        Ok(MediumDescription {
            name,
            density,
            extinction,
            albedo,
            albedo_grids,
            phase,
            emission: None,
        })
    }

    fn phase(&mut self, node: &Node, outermost: bool) -> Result<PhaseDescription, ImportError> {
        let node = if node.tag == "ref" {
            self.target(node, "phase")?
        } else {
            node
        };
        let properties = Properties::new(node)?;
        let phase = match properties.kind()? {
            "isotropic" => PhaseDescription::Isotropic,
            "rayleigh" => PhaseDescription::Draine { g: 0.0, alpha: 1.0 },
            "hg" => {
                let g = properties.float("g")?.unwrap_or(0.8);
                if !(g > -1.0 && g < 1.0) {
                    return Err(node.malformed(format!("`g` must be within (-1, 1), found {g}")));
                }
                PhaseDescription::HenyeyGreenstein { g }
            }
            "blendphase" if outermost => {
                let share = properties.float("weight")?;
                let share = share.ok_or_else(|| node.malformed("`weight` is missing"))?;
                if !(0.0..=1.0).contains(&share) {
                    return Err(node.malformed("`weight` must be in [0, 1]"));
                }
                let nested = properties.all(|child| matches!(child.tag.as_str(), "phase" | "ref"));
                let [first, second] = nested[..] else {
                    return Err(node.malformed(format!(
                        "`blendphase` needs two phase functions, found {}",
                        nested.len()
                    )));
                };
                PhaseDescription::Blend {
                    first: Box::new(self.phase(first, false)?),
                    second: Box::new(self.phase(second, false)?),
                    share,
                }
            }
            kind => {
                self.warn(
                    node,
                    format!("the phase function `{kind}` is not supported: isotropic"),
                );
                properties.all(|_| true);
                PhaseDescription::Isotropic
            }
        };
        self.finish(&properties);
        Ok(phase)
    }

    /// The mean of a volume.
    pub(super) fn mean_of_volume(
        &mut self,
        properties: &Properties,
        name: &str,
    ) -> Result<Option<Rgb>, ImportError> {
        let mean = |grid: &GridDescription| {
            let sum: f64 = grid.values.iter().map(|&value| f64::from(value)).sum();
            (sum / grid.values.len().max(1) as f64) as f32
        };
        Ok(self.volume(properties, name)?.map(|volume| match volume {
            Volume::Constant(color) => color,
            Volume::Grid(grid) => Rgb::splat(mean(&grid)),
            Volume::Varying(grids) => match &grids[..] {
                [r, g, b] => Rgb::new(mean(r), mean(g), mean(b)),
                _ => Rgb::splat(0.5),
            },
        }))
    }

    fn volume(&mut self, properties: &Properties, name: &str) -> Result<Option<Volume>, ImportError> {
        let Some(child) = properties.get(name) else {
            return Ok(None);
        };
        let node = match child.tag.as_str() {
            "rgb" | "spectrum" | "float" => return Ok(properties.color(name)?.map(Volume::Constant)),
            "volume" => child,
            "ref" => self.target(child, "volume")?,
            tag => {
                return Err(child.malformed(format!("`{name}` is <{tag}>, expected a colour or a volume")));
            }
        };
        let properties = Properties::new(node)?;
        let volume = match properties.kind()? {
            "constvolume" => {
                let value = properties.get("value");
                let value = value.ok_or_else(|| node.malformed("`value` is missing"))?;
                Volume::Constant(values::color(value, SpectrumOf::Reflectance)?)
            }
            "gridvolume" => self.grid(&properties, matches!(name, "albedo" | "volume"))?,
            kind => return Err(node.unsupported(format!("the volume `{kind}` is not supported"))),
        };
        self.finish(&properties);
        Ok(Some(volume))
    }

    /// The grid of a volume in a file, or where colours may be those of their channels.
    fn grid(&mut self, properties: &Properties, may_be_colors: bool) -> Result<Volume, ImportError> {
        let node = properties.node;
        // Colours are not converted where there is one channel.
        properties.ignore(&["raw", "accel"]);
        let file = properties
            .string("filename")?
            .ok_or_else(|| node.malformed("`filename` is missing"))?;
        let filter = match properties.string("filter_type")?.unwrap_or("trilinear") {
            "trilinear" => GridFilter::Trilinear,
            "nearest" => GridFilter::Nearest,
            other => return Err(node.unsupported(format!("unknown `filter_type` `{other}`"))),
        };
        let wrap = properties.string("wrap_mode")?.unwrap_or("clamp");
        if wrap != "clamp" {
            self.warn(
                node,
                format!("the `wrap_mode` `{wrap}` is not supported: `clamp` is taken"),
            );
        }
        let to_world = properties.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
        let by_file = properties.boolean("use_grid_bbox")?.unwrap_or(false);
        let path = node.resolve(file, self.loading);
        let bytes = self.loading.read(&path);
        let volume = bytes
            .and_then(|bytes| parse_vol(&bytes, &path))
            .map_err(|source| Self::referenced(node, source))?;
        let channels = volume.channels as usize;
        if channels != 1 && !(may_be_colors && channels == 3) {
            return Err(node.unsupported(format!(
                "a grid of {} channels is not supported, only of one",
                volume.channels
            )));
        }
        if let Some(index) = volume.values.iter().position(|&value| value < 0.0) {
            let value = volume.values[index];
            return Err(node.malformed(format!("value {index} of the grid is negative: {value}")));
        }
        let unit_to_box = if by_file {
            let [least, greatest] = volume.bounds.map(|corner| corner.as_dvec3());
            DAffine3::from_translation(least) * DAffine3::from_scale(greatest - least)
        } else {
            DAffine3::IDENTITY
        };
        let to_world = to_world * unit_to_box;
        let inverse = to_world.inverse();
        let sound = |map: &DAffine3| map.is_finite() && map.matrix3.determinant() != 0.0;
        if !(sound(&to_world) && inverse.is_finite() && inverse.matrix3.mul_vec3(DVec3::ONE).is_finite()) {
            return Err(node.malformed("`to_world` is singular"));
        }
        let grid = |channel: usize| GridDescription {
            resolution: volume.resolution,
            values: volume
                .values
                .iter()
                .skip(channel)
                .step_by(channels)
                .copied()
                .collect(),
            filter,
            to_world: to_world.as_affine3a(),
        };
        Ok(match channels {
            1 => Volume::Grid(grid(0)),
            _ => Volume::Varying((0..channels).map(grid).collect()),
        })
    }
}
