//! Options of resampled direct light.

use crate::restir::passes::MAX_ROUNDS;
use crate::restir::world::WorldReuse;
use lightshed_caching::CachingError;
use lightshed_resampling::{PairedPattern, Pattern, PatternError};
use lightshed_sampling::PointSet;
use std::fmt;

/// Options of a [`RestirDi`](super::RestirDi) frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RestirDiSettings {
    /// Candidates of the emitters' sampler for each pixel and frame, besides one of the BSDF; at
    /// least 1.
    pub emitter_candidates: u32,
    /// Whether a pixel reuses its reservoir of the previous frame.
    pub temporal_reuse: bool,
    /// Rounds of spatial reuse.
    pub spatial_rounds: u32,
    /// Neighbours in a round; at least 1.
    pub neighbours: u32,
    /// They lie within this many pixels; positive.
    pub radius_pixels: f32,
    /// Greatest confidence of a pixel's history, in frames; positive.
    pub confidence_cap: f32,
    /// Bitterli et al.'s cheaper variant, **biased**: samples merge with weights `c_i / Σ c_j`,
    /// without asking whether other techniques could have produced them, and targets ignore
    /// occlusion. Edges of shadows and of surfaces darken.
    pub biased: bool,
    /// Random numbers of camera rays over the frames. Stratified ones reduce the noise of edges in
    /// the mean of frames.
    pub points: PointSet,
    /// Whether a pixel's candidates are stratified: their numbers are those of a lattice with one
    /// random shift, by the numbers of `points`.
    pub stratified: bool,
    /// Whether emitting surfaces that the camera may see get several separate camera rays a frame.
    pub visible_emission: bool,
    /// Steps of a Markov chain on each pixel's emitter after temporal reuse (Sawhney et al. 2022),
    /// a shadow ray each: they separate pixels and frames that hold the same endpoint. Not for
    /// biased settings, whose targets ignore occlusion.
    pub mutations: u32,
    /// Rounds of spatial reuse in pairs of pixels that reuse from each other, within blocks of this
    /// many pixels, a power of two; `None` for neighbours in a disk. They shade by the single
    /// remaining sample, not by the sum over all.
    pub pairs: Option<u32>,
    /// Reservoirs in cells of space, which pixels read after reuse from the frame before and before
    /// spatial reuse; without rounds of the latter they shade by the sum over what they read.
    /// **Biased settings** shade by what they read and by nothing else: the cells' sites alone
    /// decide which light there is, and a pixel that brings nothing to a cell draws no candidates.
    pub world: Option<WorldReuse>,
}

impl RestirDiSettings {
    /// Unbiased: 32 candidates, temporal reuse with cap 20, one round with 3 neighbours within 30
    /// pixels.
    pub const UNBIASED: Self = Self {
        emitter_candidates: 32,
        temporal_reuse: true,
        spatial_rounds: 1,
        neighbours: 3,
        radius_pixels: 30.0,
        confidence_cap: 20.0,
        biased: false,
        points: PointSet::Independent,
        stratified: false,
        visible_emission: false,
        mutations: 0,
        pairs: None,
        world: None,
    };
    /// Biased: as before, with two rounds of 5 neighbours, which trace no rays.
    pub const BIASED: Self = Self {
        spatial_rounds: 2,
        neighbours: 5,
        biased: true,
        ..Self::UNBIASED
    };

    /// The same with reservoirs in cells of space, beside reuse among pixels and in time (`both`)
    /// or in its place.
    #[must_use]
    pub fn with_world(self, world: WorldReuse, both: bool) -> Self {
        let settings = Self {
            world: Some(world),
            ..self
        };
        match both {
            true => settings,
            false => Self {
                temporal_reuse: false,
                spatial_rounds: 0,
                ..settings
            },
        }
    }

    /// The pattern of neighbours, if the settings are valid.
    ///
    /// # Errors
    /// [`RestirDiError`] for settings out of range.
    pub fn check(&self) -> Result<Pattern, RestirDiError> {
        if !(1..=1 << 16).contains(&self.emitter_candidates) {
            return Err(RestirDiError::Candidates);
        }
        if self.spatial_rounds > MAX_ROUNDS {
            return Err(RestirDiError::Rounds);
        }
        // Also refuses NaN.
        if !(self.confidence_cap > 0.0) {
            return Err(RestirDiError::ConfidenceCap);
        }
        if let Some(world) = &self.world {
            world.check().map_err(RestirDiError::World)?;
        }
        if let Some(block) = self.pairs {
            PairedPattern::new(block).map_err(RestirDiError::Pattern)?;
        }
        Pattern::disk(self.radius_pixels, self.neighbours).map_err(RestirDiError::Pattern)
    }

    /// The pairs of a frame, if reuse is in pairs.
    pub(super) fn paired(&self) -> Option<PairedPattern> {
        // They have been checked. A biased merge knows no pairs.
        self.pairs
            .filter(|_| !self.biased)
            .and_then(|block| PairedPattern::new(block).ok())
    }
}

impl Default for RestirDiSettings {
    /// [`RestirDiSettings::UNBIASED`].
    fn default() -> Self {
        Self::UNBIASED
    }
}

/// Why settings are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RestirDiError {
    /// No candidates, or more than 65,536.
    Candidates,
    /// More than 64 rounds.
    Rounds,
    /// Neighbours or radius out of range.
    Pattern(PatternError),
    /// The confidence cap is not positive, or NaN.
    ConfidenceCap,
    /// Cells of space are refused.
    World(CachingError),
}

impl fmt::Display for RestirDiError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Candidates => f.write_str("candidates must number between 1 and 65536"),
            Self::Rounds => f.write_str("at most 64 rounds of spatial reuse are possible"),
            Self::Pattern(error) => error.fmt(f),
            Self::World(error) => error.fmt(f),
            Self::ConfidenceCap => f.write_str("the confidence cap must be positive"),
        }
    }
}

impl std::error::Error for RestirDiError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Pattern(error) => Some(error),
            Self::World(error) => Some(error),
            _ => None,
        }
    }
}
