//! Exploration: finding lights that no cache knows.

use super::tree_cache::LightTreeCache;
use crate::GuidingError;
use crate::error::check_option;
use glam::Vec3;
use lightshed_lights::{Light, LightChoice, LightError, LightSampler, ShadingPoint};
use lightshed_sampling::AliasTable;

/// The weights of the three heuristics in an [`ExplorationTable`]. Not negative, at least one
/// positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExplorationWeights {
    /// Energy of a light.
    pub energy: f32,
    /// Change of its energy and its position since the previous frame.
    pub change: f32,
    /// Distance to the eye, in place of the distance to the visible points.
    pub distance: f32,
}

impl Default for ExplorationWeights {
    fn default() -> Self {
        Self {
            energy: 0.5,
            change: 0.25,
            distance: 0.25,
        }
    }
}

/// One distribution of lights for all points (§5.4.3), an alias table over the blend
/// `Σ_h w_h p_h` of three distributions, each in proportion to
///
/// - energy: intensity `I`,
/// - change: `|I − I'| + min(I, I') ‖c − c'‖ / (‖c − c'‖ + r)`, where `c'` and `I'`
///   are those of the previous frame and `r` is the radius of the light;
/// - distance: `I / max(‖c − eye‖, r)²`.
///
/// A distribution without information (nothing changed) is ignored. Every light that is on has a
/// positive probability.
#[derive(Clone, Debug)]
pub struct ExplorationTable {
    table: AliasTable,
}

/// The least share of the energy's distribution.
const MIN_ENERGY_WEIGHT: f32 = 1e-3;

impl ExplorationTable {
    /// A table of `lights`; `before` are the same lights in the previous frame (`None` if there was
    /// none).
    ///
    /// # Errors
    ///
    /// [`GuidingError::Option`] for weights that are negative or not finite;
    /// [`GuidingError::Lights`] if no light is on.
    pub fn new(
        lights: &[Light],
        before: Option<&[Light]>,
        eye: Vec3,
        weights: ExplorationWeights,
    ) -> Result<Self, GuidingError> {
        for (name, weight) in [
            ("energy", weights.energy),
            ("change", weights.change),
            ("distance", weights.distance),
        ] {
            let sound = weight >= 0.0 && weight.is_finite();
            check_option(sound, name, weight.into(), "finite and not negative")?;
        }
        let radius = |light: &Light| f64::from(0.5 * light.bounds.diagonal().length()).max(1e-9);
        let energy = |light: &Light| f64::from(light.intensity);
        let change = |i: usize, light: &Light| {
            let Some(old) = before.and_then(|before| before.get(i)) else {
                // A light that did not exist before has changed completely.
                return if before.is_some() { energy(light) } else { 0.0 };
            };
            let moved = f64::from((light.bounds.center() - old.bounds.center()).length());
            (energy(light) - energy(old)).abs()
                + energy(light).min(energy(old)) * moved / (moved + radius(light))
        };
        let near = |light: &Light| {
            let distance = f64::from((light.bounds.center() - eye).length()).max(radius(light));
            energy(light) / (distance * distance)
        };
        let columns: [Vec<f64>; 3] = [
            lights.iter().map(energy).collect(),
            lights
                .iter()
                .enumerate()
                .map(|(i, light)| change(i, light))
                .collect(),
            lights.iter().map(near).collect(),
        ];
        let shares = [
            weights.energy.max(MIN_ENERGY_WEIGHT),
            weights.change,
            weights.distance,
        ];
        let mut blend = vec![0.0; lights.len()];
        for (column, share) in columns.iter().zip(shares) {
            let total: f64 = column.iter().sum();
            if total > 0.0 && total.is_finite() {
                let factor = f64::from(share) / total;
                blend
                    .iter_mut()
                    .zip(column)
                    .for_each(|(sum, value)| *sum += factor * value);
            }
        }
        let table = AliasTable::new(&blend).map_err(|_| GuidingError::Lights(LightError::Empty))?;
        Ok(Self { table })
    }

    fn sample(&self, u: u64) -> LightChoice {
        let (light, pmf) = self.table.sample(u);
        LightChoice { light, pmf }
    }

    /// Probability of a light, at every point.
    pub fn pmf(&self, light: u32) -> f32 {
        self.table.pmf(light)
    }
}

/// What explores.
#[derive(Clone, Debug)]
pub(super) enum Explorer {
    Table(ExplorationTable),
    Tree(Box<LightTreeCache>),
}

impl Explorer {
    #[inline(always)]
    pub fn sample(&self, at: &ShadingPoint, u: u64) -> Option<LightChoice> {
        match self {
            Self::Table(table) => Some(table.sample(u)),
            Self::Tree(tree) => tree.sample(at, u),
        }
    }

    #[inline(always)]
    pub fn pmf(&self, at: &ShadingPoint, light: u32) -> f32 {
        match self {
            Self::Table(table) => table.pmf(light),
            Self::Tree(tree) => tree.pmf(at, light),
        }
    }
}
