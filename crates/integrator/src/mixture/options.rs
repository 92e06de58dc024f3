//! Options: how chains estimate.

use lightshed_guiding::{GuidingError, MarkovOptions};
use lightshed_resampling::Exchange;
use lightshed_sampling::PointSet;
use std::fmt;
use std::str::FromStr;

/// The techniques of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MixtureSets {
    /// The steps of a pixel: `n` rays a pixel and frame, `n²` densities.
    Temporal,
    /// The pixels of a tile in one step: one ray a pixel, `n` densities.
    Spatial,
}

impl MixtureSets {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Temporal, Self::Spatial];

    /// The name by which [`FromStr`] finds it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Temporal => "temporal",
            Self::Spatial => "spatial",
        }
    }
}

/// A name that none of [`MixtureSets::ALL`] has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownSets(String);

impl fmt::Display for UnknownSets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = MixtureSets::ALL.map(MixtureSets::name).join(", ");
        write!(f, "{} is not one of {names}", self.0)
    }
}

impl std::error::Error for UnknownSets {}

impl FromStr for MixtureSets {
    type Err = UnknownSets;

    fn from_str(name: &str) -> Result<Self, UnknownSets> {
        let found = Self::ALL.into_iter().find(|sets| sets.name() == name);
        found.ok_or_else(|| UnknownSets(name.to_owned()))
    }
}

/// The steps of [`Mixture`](crate::Mixture) in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MixtureOptions {
    /// What the techniques of a set are.
    pub sets: MixtureSets,
    /// Techniques of a set, and pixels of a tile: one of [`TILE_SIZES`].
    pub size: u32,
    /// Steps of a frame, 1 to [`MAX_MIXTURE_STEPS`]: rays of a pixel. Temporal sets have as many
    /// steps as `size` says if it is 0, spatial ones one.
    pub steps: u32,
    /// States of a pixel: one of [`STATES`], at most `size`. Each is a place of its own in the
    /// tile, which has so many times fewer pixels, and takes a ray of its own in each step. States
    /// of all pixels, of this frame and of the one before, take 64 bytes each.
    pub states: u32,
    /// Whether one emitter sample a set and pixel is merged, by the balance heuristic over all
    /// techniques. Without it, emitters are sampled only if nothing else finds them: points and
    /// directions.
    pub samples_emitters: bool,
    /// Whether states exchange places; **biased** if not.
    pub exchange: Exchange,
    /// How chains learn and wander.
    pub chains: MarkovOptions,
    /// Random numbers of camera rays over the frames.
    pub points: PointSet,
    /// Whether emitting surfaces that the camera may see get several separate camera rays a frame.
    pub visible_emission: bool,
}

/// Sizes of tiles.
pub const TILE_SIZES: [u32; 6] = [1, 2, 4, 8, 16, 32];

/// Numbers of states of a pixel.
pub const STATES: [u32; 4] = [1, 2, 4, 8];

/// Most steps of a frame.
pub const MAX_MIXTURE_STEPS: u32 = 64;

impl Default for MixtureOptions {
    /// Spatial sets of 32.
    fn default() -> Self {
        Self {
            sets: MixtureSets::Spatial,
            size: 32,
            steps: 0,
            states: 1,
            samples_emitters: false,
            exchange: Exchange::Traded,
            chains: MarkovOptions::default(),
            points: PointSet::Independent,
            visible_emission: false,
        }
    }
}

impl MixtureOptions {
    /// Steps of a frame, with the default worked out.
    pub fn steps_of_frame(&self) -> u32 {
        match (self.steps, self.sets) {
            (0, MixtureSets::Temporal) => self.size,
            (0, MixtureSets::Spatial) => 1,
            (steps, _) => steps,
        }
    }

    /// Width and height of a tile in pixels.
    pub(super) fn tile(&self) -> [usize; 2] {
        let bits = (self.size / self.states.max(1)).max(1).ilog2();
        [1 << bits.div_ceil(2), 1 << (bits / 2)]
    }

    /// # Errors
    /// [`MixtureError`] for options out of range.
    pub fn check(&self) -> Result<(), MixtureError> {
        if !TILE_SIZES.contains(&self.size) {
            return Err(MixtureError::Size(self.size));
        }
        if !STATES.contains(&self.states) || self.states > self.size {
            return Err(MixtureError::States(self.states));
        }
        if self.steps > MAX_MIXTURE_STEPS {
            return Err(MixtureError::Steps(self.steps));
        }
        self.chains.check().map_err(MixtureError::Chains)
    }
}

/// Why options are refused.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum MixtureError {
    /// The size of a set is none of [`TILE_SIZES`].
    Size(u32),
    /// The states of a pixel are none of [`STATES`], or more than a set has techniques.
    States(u32),
    /// Too many steps.
    Steps(u32),
    /// Options of the chains.
    Chains(GuidingError),
}

impl fmt::Display for MixtureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size(size) => write!(f, "sets of {size}: it must be 1, 2, 4, 8, 16 or 32"),
            Self::States(states) => {
                write!(
                    f,
                    "{states} states of a pixel: it must be 1, 2, 4 or 8, and no more than a set has"
                )
            }
            Self::Steps(steps) => write!(f, "{steps} steps of a frame: at most {MAX_MIXTURE_STEPS}"),
            Self::Chains(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for MixtureError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Chains(error) => Some(error),
            _ => None,
        }
    }
}
