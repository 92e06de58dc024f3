//! Lights.

use super::Importer;
use super::parameters::{Parameter, Parameters, Values};
use crate::import::error::ImportError;
use crate::import::image::{Encoding, read_within};
use crate::import::limits::LoadResource;
use crate::import::spectrum::{self, SpectrumOf};
use crate::{EmitterDescription, EnvironmentMap, Image, Rgb, luminance};
use glam::{DAffine3, DVec3, Vec3};
use std::f32::consts::{FRAC_2_PI, PI, TAU};
use std::sync::Arc;

/// Rows of the map that an image over the octahedron becomes, at most.
const MOST_ROWS: u32 = 2048;

impl Importer<'_> {
    /// The colour of a light, by default 1.
    fn emitted(&self, parameters: &Parameters, name: &str) -> Result<Rgb, ImportError> {
        let color = match parameters.get(name) {
            None => Rgb::ONE,
            Some(Parameter { kind, values, .. }) => match values {
                Values::Numbers(numbers) if kind == "blackbody" => match numbers[..] {
                    [temperature] if temperature > 0.0 => of_luminance_one(spectrum::blackbody(temperature)),
                    _ => return Err(parameters.malformed(format!("`{name}` has no temperature"))),
                },
                Values::Numbers(numbers) if kind == "spectrum" => {
                    let points = spectrum_points(numbers);
                    let points = points.ok_or_else(|| {
                        parameters.malformed(format!("the wavelengths of `{name}` must ascend"))
                    })?;
                    of_luminance_one(spectrum::color(&points, SpectrumOf::Emission))
                }
                Values::Numbers(numbers) => parameters.color_of(name, numbers)?,
                Values::Texts(texts) if texts.first().is_some_and(|file| file.ends_with(".spd")) => {
                    let points = self.spectrum_file(parameters, &texts[0])?;
                    of_luminance_one(spectrum::color(&points, SpectrumOf::Emission))
                }
                // Named illuminants are scaled to luminance 1.
                Values::Texts(_) => Rgb::ONE,
                Values::Flags(_) => return Err(parameters.malformed(format!("`{name}` is no colour"))),
            },
        };
        let color = color * parameters.float("scale", 1.0)?;
        if color.is_finite() && color.min_element() >= 0.0 {
            Ok(color)
        } else {
            Err(parameters.malformed(format!("`{name}` is negative or out of range")))
        }
    }

    /// Radiance of the area light of the current attributes.
    pub(super) fn area_radiance(&mut self) -> Result<Option<Rgb>, ImportError> {
        let Some(parameters) = self.state.area_light.clone() else {
            return Ok(None);
        };
        let radiance = self.emitted(&parameters, "L")?;
        if parameters.flag("twosided", false)? {
            self.warn(&parameters, "an area light emits from its front only");
        }
        self.warn_left_over(&parameters);
        Ok((radiance != Rgb::ZERO).then_some(radiance))
    }

    pub(super) fn light(&mut self, kind: &str, parameters: &Parameters) -> Result<(), ImportError> {
        let map = self.state.map;
        let point = |name: &str, default: DVec3| -> Result<DVec3, ImportError> {
            Ok(map.transform_point3(parameters.point(name)?.unwrap_or(default)))
        };
        let direction = |from: DVec3, to: DVec3| -> Result<Vec3, ImportError> {
            let direction = (to - from).try_normalize().map(|d| d.as_vec3());
            direction.ok_or_else(|| parameters.malformed("the direction has no length"))
        };
        let emitter = match kind {
            "point" => EmitterDescription::Point {
                position: point("from", DVec3::ZERO)?.as_vec3(),
                intensity: self.emitted(parameters, "I")?,
            },
            "spot" => {
                let (from, to) = (point("from", DVec3::ZERO)?, point("to", DVec3::Z)?);
                let cutoff = parameters.float("coneangle", 30.0)?;
                let delta = parameters.float("conedeltaangle", 5.0)?;
                if !(cutoff > 0.0 && cutoff <= 180.0 && (0.0..=cutoff).contains(&delta)) {
                    return Err(parameters.malformed("expected 0 ≤ `conedeltaangle` ≤ `coneangle` ≤ 180"));
                }
                EmitterDescription::Spot {
                    position: from.as_vec3(),
                    direction: direction(from, to)?,
                    intensity: self.emitted(parameters, "I")?,
                    beam_width: (cutoff - delta).to_radians(),
                    cutoff_angle: cutoff.to_radians(),
                }
            }
            // Without their images.
            "goniometric" => {
                self.warn(
                    parameters,
                    "a goniometric light is a point that shines in all directions alike",
                );
                EmitterDescription::Point {
                    position: map.translation.as_vec3(),
                    intensity: self.emitted(parameters, "I")?,
                }
            }
            "projection" => {
                self.warn(parameters, "a projection is a spot light without its image");
                let cutoff = 0.5 * parameters.float("fov", 90.0)?.clamp(1e-3, 179.0).to_radians();
                EmitterDescription::Spot {
                    position: map.translation.as_vec3(),
                    direction: direction(map.translation, map.transform_point3(DVec3::Z))?,
                    intensity: self.emitted(parameters, "I")?,
                    beam_width: 0.95 * cutoff,
                    cutoff_angle: cutoff,
                }
            }
            "distant" => {
                let (from, to) = (point("from", DVec3::ZERO)?, point("to", DVec3::Z)?);
                EmitterDescription::Directional {
                    direction: direction(from, to)?,
                    irradiance: self.emitted(parameters, "L")?,
                }
            }
            "infinite" => match parameters.text("filename")? {
                None => EmitterDescription::Constant {
                    radiance: self.emitted(parameters, "L")?,
                },
                Some(file) => match self.sky(parameters, file) {
                    Ok(sky) => sky,
                    Err(error) if matches!(error.innermost(), ImportError::OverBudget { .. }) => {
                        return Err(error);
                    }
                    Err(error) => {
                        let message = format!("a light from all around is left out: {}", error.chain());
                        self.warn(parameters, message);
                        return Ok(());
                    }
                },
            },
            _ => {
                self.warn(
                    parameters,
                    format!("the light `{kind}` is not supported: left out"),
                );
                return Ok(());
            }
        };
        self.warn_left_over(parameters);
        let surrounds = |emitter: &EmitterDescription| {
            matches!(
                emitter,
                EmitterDescription::Constant { .. } | EmitterDescription::Environment(_)
            )
        };
        if surrounds(&emitter) && self.description.emitters.iter().any(surrounds) {
            self.warn(parameters, "a second light from all around is left out");
            return Ok(());
        }
        self.description.emitters.push(emitter);
        Ok(())
    }

    /// An image over the octahedron (Clarberg 2008) as one over latitude and longitude.
    fn sky(&mut self, parameters: &Parameters, file: &str) -> Result<EmitterDescription, ImportError> {
        let path = self.folder.join(file);
        let image = read_within(&path, Encoding::Srgb, self.loading);
        let image = image.map_err(|source| ImportError::Referenced {
            location: parameters.location(),
            source: Box::new(source),
        })?;
        if image.width() != image.height() {
            return Err(parameters.malformed("an image from all around must be square"));
        }
        let rows = image.height().clamp(2, MOST_ROWS);
        let columns = 2 * rows;
        let texels = u64::from(rows) * u64::from(columns);
        self.loading
            .spend(LoadResource::Bytes, 12 * texels, || parameters.location())?;
        let mut pixels = Vec::with_capacity(texels as usize);
        for row in 0..rows {
            let (sin, cos) = (PI * row as f32 / (rows - 1) as f32).sin_cos();
            for column in 0..columns {
                let phi = TAU * (column as f32 + 0.5) / columns as f32;
                let direction = Vec3::new(sin * phi.sin(), cos, -sin * phi.cos());
                pixels.push(octahedral(&image, direction).to_array());
            }
        }
        let turned = Image::from_linear(columns, rows, pixels);
        let turned = turned.ok_or_else(|| parameters.malformed("the image is not finite"))?;
        let scale = parameters.float("scale", 1.0)?;
        if scale < 0.0 {
            return Err(parameters.malformed("`scale` is negative"));
        }
        let to_world = DAffine3::from_mat3(self.state.map.matrix3);
        Ok(EmitterDescription::Environment(EnvironmentMap {
            image: Arc::new(turned),
            scale,
            to_world: to_world.as_affine3a(),
        }))
    }
}

/// Points `(λ, value)` of a list; `None` if wavelengths do not ascend or a value is negative.
pub(super) fn spectrum_points(numbers: &[f64]) -> Option<Vec<(f64, f64)>> {
    let (pairs, rest) = numbers.as_chunks::<2>();
    let points: Vec<(f64, f64)> = pairs.iter().map(|&[at, value]| (at, value)).collect();
    let sound = rest.is_empty()
        && !points.is_empty()
        && points.is_sorted_by(|a, b| a.0 < b.0)
        && points.iter().all(|point| point.1 >= 0.0);
    sound.then_some(points)
}

fn of_luminance_one(color: Rgb) -> Rgb {
    let luminance = luminance(color);
    if luminance > 0.0 {
        color / luminance
    } else {
        Rgb::ZERO
    }
}

/// The texel of an image over the octahedron in a direction.
fn octahedral(image: &Image, direction: Vec3) -> Rgb {
    let side = image.width() as f32;
    let at = square(direction);
    // Between the four nearest texels; the edge is short of half a texel.
    let place = [at[0] * side - 0.5, at[1] * side - 0.5];
    let [x, y] = place.map(|value| value.floor().max(0.0));
    let [fx, fy] = [place[0] - x, place[1] - y].map(|share| share.clamp(0.0, 1.0));
    let texel = |dx: u32, dy: u32| image.texel(x as u32 + dx, y as u32 + dy);
    let upper = texel(0, 0).lerp(texel(1, 0), fx);
    let lower = texel(0, 1).lerp(texel(1, 1), fx);
    upper.lerp(lower, fy)
}

/// The equal-area map from the sphere to the unit square (Clarberg 2008, *Fast Equal-Area Mapping
/// of the (Hemi)Sphere using SIMD*).
fn square(direction: Vec3) -> [f32; 2] {
    let [x, y, z] = direction.abs().to_array();
    let radius = (1.0 - z).max(0.0).sqrt();
    let (greater, less) = (x.max(y), x.min(y));
    let ratio = if greater == 0.0 { 0.0 } else { less / greater };
    let angle = ratio.atan() * FRAC_2_PI;
    let angle = if x < y { 1.0 - angle } else { angle };
    let v = angle * radius;
    let u = radius - v;
    let [u, v] = if direction.z < 0.0 {
        [1.0 - v, 1.0 - u]
    } else {
        [u, v]
    };
    [u.copysign(direction.x), v.copysign(direction.y)].map(|value| 0.5 * (value + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::{CounterRng, UniformSphere};

    /// The map fills the square evenly, and its axes are where they should be.
    #[test]
    fn the_octahedron_has_equal_areas() {
        assert_eq!(square(Vec3::Z), [0.5, 0.5]);
        assert_eq!(square(Vec3::X), [1.0, 0.5]);
        assert_eq!(square(Vec3::Y), [0.5, 1.0]);
        let corner = square(Vec3::NEG_Z);
        assert!(corner.iter().all(|&c| c == 0.0 || c == 1.0), "{corner:?}");
        let mut rng = CounterRng::new(3, 0, 0);
        let mut counts = [0; 16];
        const COUNT: u32 = 32_000;
        for _ in 0..COUNT {
            let [u, v] = square(UniformSphere::sample(rng.next_2d())).map(|c| ((c * 4.0) as usize).min(3));
            counts[4 * v + u] += 1;
        }
        // 2,000 ± 43 each: 6 standard deviations.
        assert!(
            counts.iter().all(|count: &u32| count.abs_diff(COUNT / 16) < 260),
            "{counts:?}"
        );
    }
}
