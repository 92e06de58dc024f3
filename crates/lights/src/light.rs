//! A light as samplers know it.

use crate::{Bounds, OrientationCone};
use lightshed_sampling::parallel::reduce;
use std::fmt;

/// A light, or a group of lights: its position, its intensity, and its directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// A box around all points that emit.
    pub bounds: Bounds,
    /// Greatest radiant intensity over all directions, power per steradian, as one number (a
    /// luminance): `I` of a point light, `L A` of a flat diffuse surface of area `A`, and
    /// `π r² L` of a diffuse sphere, because only its visible disk counts. Zero for a light that
    /// is off.
    pub intensity: f32,
    /// Orientation of the light; `None` for all directions alike.
    pub cone: Option<OrientationCone>,
}

/// Most lights in one structure.
pub const MAX_LIGHTS: usize = 1 << 28;

/// Lights that a thread checks at once.
const CHUNK: usize = 1 << 13;

/// Why lights are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LightError {
    /// There are none.
    Empty,
    /// More than [`MAX_LIGHTS`].
    TooMany(usize),
    /// The bounds of this light are not finite, or not in order.
    Bounds(usize),
    /// The intensity of this light is negative or not finite.
    Intensity(usize),
    /// The cone of this light has an axis that is not of unit length, or an angle out of [0, π].
    Cone(usize),
    /// The intensities add up to more than the largest finite number.
    Overflow,
}

impl fmt::Display for LightError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "there are no lights"),
            Self::TooMany(count) => write!(f, "{count} lights are more than the {MAX_LIGHTS} allowed"),
            Self::Bounds(light) => write!(f, "light {light}: its bounds must be finite and in order"),
            Self::Intensity(light) => {
                write!(f, "light {light}: its intensity must be finite and not negative")
            }
            Self::Cone(light) => {
                write!(
                    f,
                    "light {light}: its cone needs a unit axis and angles from 0 to pi"
                )
            }
            Self::Overflow => write!(f, "the intensities of all lights overflow when added"),
        }
    }
}

impl std::error::Error for LightError {}

impl Light {
    /// Whether it is invalid by itself, and why. `index` goes into the error.
    ///
    /// # Errors
    ///
    /// [`LightError::Bounds`], [`LightError::Intensity`], [`LightError::Cone`].
    #[inline]
    pub fn check(&self, index: usize) -> Result<(), LightError> {
        if !self.bounds.is_valid() {
            return Err(LightError::Bounds(index));
        }
        if !(self.intensity >= 0.0 && self.intensity.is_finite()) {
            return Err(LightError::Intensity(index));
        }
        match &self.cone {
            Some(cone) if !cone.is_valid() => Err(LightError::Cone(index)),
            _ => Ok(()),
        }
    }

    /// Its cone, [`OrientationCone::ALL`] if it has none.
    #[inline]
    pub fn cone_or_all(&self) -> OrientationCone {
        self.cone.unwrap_or(OrientationCone::ALL)
    }
}

/// Checks all lights, for constructors.
///
/// # Errors
///
/// The first of [`LightError`]'s cases that applies.
pub fn check_lights(lights: &[Light]) -> Result<(), LightError> {
    match lights.len() {
        0 => return Err(LightError::Empty),
        count if count > MAX_LIGHTS => return Err(LightError::TooMany(count)),
        _ => (),
    }
    let (sound, total) =
        reduce(lights, CHUNK, sound_and_total, |a, b| (a.0 & b.0, a.1 + b.1)).unwrap_or((true, 0.0));
    if !sound {
        // A second pass finds which one.
        lights
            .iter()
            .enumerate()
            .try_for_each(|(i, light)| light.check(i))?;
    }
    if total <= f64::from(f32::MAX) {
        Ok(())
    } else {
        Err(LightError::Overflow)
    }
}

/// Whether all lights are valid by themselves, and the sum of their intensities: all tests of all
/// lights, without branches.
fn sound_and_total(lights: &[Light]) -> (bool, f64) {
    let mut sound = true;
    let mut total = 0.0;
    for light in lights {
        let Bounds { min, max } = light.bounds;
        for axis in 0..3 {
            sound &= (f32::MIN <= min[axis]) & (min[axis] <= max[axis]) & (max[axis] <= f32::MAX);
        }
        sound &= (0.0 <= light.intensity) & (light.intensity <= f32::MAX);
        total += f64::from(light.intensity);
        if let Some(cone) = &light.cone {
            sound &= cone.is_valid();
        }
    }
    (sound, total)
}
