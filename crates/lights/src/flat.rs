//! Samplers that ignore the receiver: uniform, or by intensity.

use crate::light::check_lights;
use crate::weighing::Receiver;
use crate::{Light, LightChoice, LightError, LightSampler};
use lightshed_sampling::AliasTable;

/// All lights with the same probability: `p(i) = 1 / n`.
#[derive(Clone, Debug)]
pub struct UniformLights {
    count: u32,
    pmf: f32,
}

impl UniformLights {
    /// `count` lights.
    ///
    /// # Errors
    ///
    /// [`LightError::Empty`], [`LightError::TooMany`].
    pub fn new(count: usize) -> Result<Self, LightError> {
        match count {
            0 => Err(LightError::Empty),
            _ if count > crate::MAX_LIGHTS => Err(LightError::TooMany(count)),
            _ => Ok(Self {
                count: count as u32,
                pmf: 1.0 / count as f32,
            }),
        }
    }
}

impl<R: Receiver> LightSampler<R> for UniformLights {
    fn light_count(&self) -> usize {
        self.count as usize
    }

    #[inline]
    fn sample(&self, _: &R, u: u64) -> Option<LightChoice> {
        Some(LightChoice {
            light: ((u128::from(u) * u128::from(self.count)) >> 64) as u32,
            pmf: self.pmf,
        })
    }

    #[inline]
    fn pmf(&self, _: &R, light: u32) -> f32 {
        if light < self.count { self.pmf } else { 0.0 }
    }
}

/// In proportion to intensity, by an alias table: `p(i) = I_i / Σ I`. For a diffuse light the
/// intensity is the mean over directions, a quarter of the greatest.
#[derive(Clone, Debug)]
pub struct PowerLights {
    /// `None` if no light shines.
    table: Option<AliasTable>,
    count: usize,
}

impl PowerLights {
    /// # Errors
    ///
    /// See [`LightError`].
    pub fn new(lights: &[Light]) -> Result<Self, LightError> {
        check_lights(lights)?;
        let weights: Vec<f64> = lights.iter().map(mean_intensity).collect();
        let shines = weights.iter().any(|&w| w > 0.0);
        let table = shines
            .then(|| AliasTable::new(&weights))
            .transpose()
            .map_err(|_| LightError::Overflow)?;
        Ok(Self {
            table,
            count: lights.len(),
        })
    }
}

/// A light's intensity, comparable between lights that emit in all directions and diffuse ones.
fn mean_intensity(light: &Light) -> f64 {
    let share = if light.cone.is_some() { 0.25 } else { 1.0 };
    share * f64::from(light.intensity)
}

impl<R: Receiver> LightSampler<R> for PowerLights {
    fn light_count(&self) -> usize {
        self.count
    }

    #[inline]
    fn sample(&self, _: &R, u: u64) -> Option<LightChoice> {
        let (light, pmf) = self.table.as_ref()?.sample(u);
        Some(LightChoice { light, pmf })
    }

    #[inline]
    fn pmf(&self, _: &R, light: u32) -> f32 {
        self.table.as_ref().map_or(0.0, |table| table.pmf(light))
    }
}
