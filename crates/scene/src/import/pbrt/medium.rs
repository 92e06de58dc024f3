//! Participating media.

use super::parameters::{Parameters, Values};
use super::{Directive, Importer};
use crate::import::error::ImportError;
use crate::import::nanovdb;
use crate::import::spectrum;
use crate::{
    DensityDescription, EmissionDescription, GridDescription, GridFilter, MediumDescription,
    PhaseDescription, Rgb,
};
use glam::{DAffine3, DVec3};

impl Importer<'_> {
    /// The medium of that name; none has no name.
    pub(super) fn medium_named(&self, directive: &Directive, name: &str) -> Result<Option<u32>, ImportError> {
        if name.is_empty() {
            return Ok(None);
        }
        let medium = self.media.get(name).copied();
        medium
            .map(Some)
            .ok_or_else(|| directive.malformed(format!("no medium is named `{name}`")))
    }

    pub(super) fn medium(&mut self, name: &str, parameters: &Parameters) -> Result<(), ImportError> {
        let kind = parameters.text("type")?.unwrap_or_default();
        let coefficient = |name: &str, default: [f64; 3]| -> Result<Rgb, ImportError> {
            let Some(parameter) = parameters.get(name) else {
                return parameters.color_of(name, &default);
            };
            match &parameter.values {
                Values::Numbers(numbers) if parameter.kind == "spectrum" => {
                    let points = super::light::spectrum_points(numbers);
                    let points = points.ok_or_else(|| {
                        parameters.malformed(format!("the wavelengths of `{name}` must ascend"))
                    })?;
                    Ok(spectrum::levels(&points))
                }
                // A colour for each voxel.
                Values::Numbers(numbers) if kind == "rgbgrid" && !numbers.is_empty() => {
                    let sums = (numbers.as_chunks::<3>().0.iter())
                        .fold(DVec3::ZERO, |sum, &color| sum + DVec3::from_array(color));
                    let mean = sums * (3.0 / numbers.len() as f64);
                    parameters.color_of(name, &mean.to_array())
                }
                Values::Numbers(numbers) => parameters.color_of(name, numbers),
                _ => Err(parameters.unsupported(format!("`{name}` must be numbers"))),
            }
        };
        if parameters.get("preset").is_some() {
            self.warn(
                parameters,
                "media by the name of a substance are not known: the default coefficients are taken",
            );
        }
        let absorbed = coefficient("sigma_a", [0.0011, 0.0024, 0.014])?;
        let scattered = coefficient("sigma_s", [2.55, 3.21, 3.77])?;
        let extinction = (absorbed + scattered) * parameters.float("scale", 1.0)?;
        if !(extinction.is_finite() && extinction.min_element() >= 0.0) {
            return Err(parameters.malformed("the extinction is negative or out of range"));
        }
        let sum = absorbed + scattered;
        let albedo = Rgb::from_array(std::array::from_fn(|channel| {
            if sum[channel] > 0.0 {
                (scattered[channel] / sum[channel]).min(1.0)
            } else {
                0.0
            }
        }));
        let g = parameters.float("g", 0.0)?;
        if !(g > -1.0 && g < 1.0) {
            return Err(parameters.malformed(format!("`g` must be within (-1, 1), found {g}")));
        }
        let phase = if g == 0.0 {
            PhaseDescription::Isotropic
        } else {
            PhaseDescription::HenyeyGreenstein { g }
        };
        let emitted = coefficient("Le", [0.0; 3])? * parameters.float("Lescale", 1.0)?;
        let density = match kind {
            "homogeneous" => DensityDescription::Homogeneous,
            "uniformgrid" => DensityDescription::Grid(self.density(parameters)?),
            "cloud" | "rgbgrid" => {
                parameters.ignore(&[
                    "density",
                    "wispiness",
                    "frequency",
                    "p0",
                    "p1",
                    "nx",
                    "ny",
                    "nz",
                    "sigma_a",
                    "sigma_s",
                ]);
                self.warn(parameters, format!("a medium of type `{kind}` is homogeneous"));
                DensityDescription::Homogeneous
            }
            "nanovdb" => DensityDescription::Grid(self.nanovdb(parameters)?),
            _ => return Err(parameters.unsupported(format!("the medium `{kind}` is not supported"))),
        };
        let emission = (emitted != Rgb::ZERO && emitted.is_finite() && emitted.min_element() >= 0.0)
            .then_some(EmissionDescription {
                radiance: emitted,
                grid: None,
            });
        self.warn_left_over(parameters);
        self.description.media.push(MediumDescription {
            name: name.to_owned(),
            density,
            extinction,
            albedo,
            albedo_grids: Vec::new(),
            phase,
            emission,
        });
        let index = self.description.media.len() as u32 - 1;
        self.media.insert(name.to_owned(), index);
        Ok(())
    }

    /// The grid `density` of a file.
    fn nanovdb(&mut self, parameters: &Parameters) -> Result<GridDescription, ImportError> {
        let file = parameters.text("filename")?;
        let file = file.ok_or_else(|| parameters.malformed("`filename` is missing"))?;
        if parameters.float("Lescale", 1.0)? > 0.0 && parameters.get("Lescale").is_some() {
            self.warn(
                parameters,
                "a grid of temperatures is left out: the medium emits nothing by it",
            );
        }
        parameters.ignore(&["temperatureoffset", "temperaturescale", "temperaturecutoff"]);
        let (bytes, path) = self.bytes_of(parameters, file)?;
        let found = nanovdb::parse_within(&bytes, Some("density"), &path, self.loading);
        let mut grid = found.map_err(|source| ImportError::Referenced {
            location: parameters.location(),
            source: Box::new(source),
        })?;
        let own = DAffine3::from_cols_array(&grid.to_world.to_cols_array().map(f64::from));
        let to_world = self.state.map * own;
        if !(to_world.is_finite() && to_world.inverse().is_finite() && to_world.matrix3.determinant() != 0.0)
        {
            return Err(parameters.malformed("the grid's box is flat or out of range"));
        }
        grid.to_world = to_world.as_affine3a();
        Ok(grid)
    }

    /// The grid of densities in the box from `p0` to `p1`.
    fn density(&self, parameters: &Parameters) -> Result<GridDescription, ImportError> {
        let side = |name: &str| Ok::<u32, ImportError>(parameters.count(name)?.unwrap_or(1));
        let resolution = [side("nx")?, side("ny")?, side("nz")?];
        let values = parameters.numbers("density")?.unwrap_or_default();
        let count = resolution.iter().map(|&side| u64::from(side)).product::<u64>();
        if values.len() as u64 != count {
            return Err(parameters.malformed(format!("{} densities for {count} voxels", values.len())));
        }
        let values: Vec<f32> = values.iter().map(|&value| value as f32).collect();
        if values.iter().any(|value| !(value.is_finite() && *value >= 0.0)) {
            return Err(parameters.malformed("a density is negative or out of range"));
        }
        let low = parameters.point("p0")?.unwrap_or(DVec3::ZERO);
        let high = parameters.point("p1")?.unwrap_or(DVec3::ONE);
        let to_world = self.state.map * DAffine3::from_translation(low) * DAffine3::from_scale(high - low);
        let inverse = to_world.inverse();
        if !(to_world.matrix3.determinant() != 0.0 && inverse.is_finite() && to_world.is_finite()) {
            return Err(parameters.malformed("the grid's box is flat or out of range"));
        }
        Ok(GridDescription {
            resolution,
            values: values.into(),
            filter: GridFilter::Trilinear,
            to_world: to_world.as_affine3a(),
        })
    }
}
