//! Stochastic MIS among Markov chain mixtures.

use super::super::option::{MethodOption, MethodValues, one_of, within};
use super::STATES;
use crate::{MAX_MIXTURE_STEPS, MixtureOptions, MixtureSets, TILE_SIZES};

/// What techniques of a set are.
pub const SMIS: MethodOption = MethodOption::new(
    "smis",
    "SETS",
    "spatial",
    |text| one_of(text, &MixtureSets::ALL.map(MixtureSets::name)),
    "What a set of techniques is: temporal, the steps of a pixel, or spatial, the pixels of a tile",
);

/// Techniques of a set.
pub const SMIS_SIZE: MethodOption = MethodOption::new(
    "smis-size",
    "N",
    "",
    |text| match text.parse() {
        Ok(size) if TILE_SIZES.contains(&size) => Ok(()),
        _ => Err(format!("{text} is none of {TILE_SIZES:?}")),
    },
    "Techniques of a set: 1, 2, 4, 8, 16 or 32; 8 of temporal sets and 32 of spatial ones if not given",
);

/// Steps of a frame.
pub const SMIS_STEPS: MethodOption = MethodOption::new(
    "smis-steps",
    "N",
    "",
    |text| within(text, 1..=MAX_MIXTURE_STEPS),
    "Rays of a pixel in a frame; as many as a temporal set has, and one with spatial sets, if not given",
);

/// Emitter samples beside the chains.
pub const SMIS_EMITTERS: MethodOption = MethodOption::switch(
    "smis-emitters",
    "Merge an emitter sample with each set; without, no list of lights is used but for points and directions",
);

impl MethodValues {
    /// Parameters of Markov chain mixtures.
    pub fn mixture_options(&self) -> MixtureOptions {
        let mut options = MixtureOptions::default();
        options.sets = self.get(&SMIS).unwrap_or(options.sets);
        let size = match options.sets {
            MixtureSets::Temporal => 8,
            MixtureSets::Spatial => options.size,
        };
        options.size = self.get(&SMIS_SIZE).unwrap_or(size);
        options.steps = self.get(&SMIS_STEPS).unwrap_or(options.steps);
        options.states = self.get(&STATES).unwrap_or(options.states);
        options.samples_emitters = self.is_on(&SMIS_EMITTERS);
        (options.points, options.visible_emission) = (self.points(), self.visible_emission());
        options
    }
}
