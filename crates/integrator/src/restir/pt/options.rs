//! Options of ReSTIR PT.

use crate::MAX_DIRECT_SAMPLES;
use crate::restir::world::WorldReuse;
use lightshed_caching::CachingError;
use lightshed_resampling::{PairedPattern, Pattern, PatternError};
use lightshed_sampling::PointSet;
use lightshed_scene::{Material, Scene};
use lightshed_shift::Connectability;
use std::fmt;

/// The shift mapping between pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathMapping {
    /// `y₂ = x₂`: cheap, good for rough surfaces.
    Reconnection,
    /// Random replay up to the first connectable pair of vertices: good for glossy surfaces, too.
    /// In a scene of diffuse surfaces it equals the reconnection.
    Hybrid,
}

/// The pixels that a pixel reuses from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Neighbourhood {
    /// `count` pixels of a disk of this radius, in pixels, other ones for every pixel and round.
    Disk {
        /// In pixels.
        radius: f32,
        /// How many; 0 for no reuse.
        count: u32,
    },
    /// All pixels of the square of side `2 · radius + 1`.
    Window {
        /// In pixels.
        radius: u32,
    },
}

/// Parameters of [`RestirPt`](crate::RestirPt).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestirPtOptions {
    /// Trees of candidates for each pixel of a frame.
    pub candidates: u32,
    /// Rounds of spatial reuse.
    pub rounds: u32,
    /// Which neighbours take part in a round.
    pub neighbourhood: Neighbourhood,
    /// Confidence cap `M_c` of temporal reuse; `None` for independent frames.
    pub temporal_cap: Option<f32>,
    /// Whether each path has its own position in the pixel, so that a frame has as many positions
    /// as candidates. Otherwise all paths of a frame share one, which saves rays and is required
    /// for temporal reuse.
    pub path_starts_at_sensor: bool,
    /// The shift.
    pub mapping: PathMapping,
    /// Least roughness of lobes for a reconnection by the hybrid shift, as GGX's `α`.
    pub min_roughness: f32,
    /// Least distance of vertices for a reconnection by the hybrid shift, as a share of the scene's
    /// size.
    pub min_distance: f32,
    /// Whether emitting surfaces that the camera may see get several separate camera rays a frame.
    /// Not for paths that start at the sensor.
    pub visible_emission: bool,
    /// Samples of direct light for each pixel of a frame, by path tracing: one of the emitters and
    /// one of the BSDF behind a camera ray of their own, weighed together. Only longer paths are
    /// resampled then. 0 if direct light is resampled with the rest.
    pub direct_samples: u32,
    /// Random numbers over the frames of the camera rays that all paths of a frame share.
    /// Stratified ones reduce the noise of edges in the mean of frames.
    pub points: PointSet,
    /// Rounds of spatial reuse in pairs of pixels that reuse from each other, within blocks of this
    /// many pixels, a power of two; `None` for the neighbourhood. A shift serves two pixels, but
    /// the last round shades by the single remaining sample, not by the sum over all.
    pub pairs: Option<u32>,
    /// Reservoirs in cells of space, which pixels read after reuse from the frame before and before
    /// spatial reuse; without rounds of the latter they shade by the sum over what they read. A
    /// cell keeps its site, the whole space of paths behind what one of its pixels saw, and is
    /// merged by the same shift: unbiased. Not for paths that start at the sensor.
    pub world: Option<WorldReuse>,
    /// Reconnections by the spread of paths ([`Footprint`](lightshed_shift::Footprint)), in place
    /// of `min_roughness` and `min_distance`: the least area is that of so many pixels at the
    /// path's first vertex. `None` for the fixed thresholds.
    pub footprint: Option<f32>,
    /// Steps of a Markov chain on each pixel's path after reuse from the frame before
    /// ([`PathMutator`](lightshed_shift::PathMutator)).
    pub mutations: u32,
}

/// Why options are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RestirPtError {
    /// No candidates, or more than [`MAX_CANDIDATES`].
    Candidates(u32),
    /// More rounds than [`MAX_ROUNDS`].
    Rounds(u32),
    /// Neighbours or a radius that make no pattern.
    Pattern(PatternError),
    /// A cap below 1, or NaN.
    TemporalCap(f32),
    /// Temporal reuse of paths that start at the sensor.
    TemporalSensor,
    /// Cells of space for paths that start at the sensor, which have no place.
    WorldSensor,
    /// Cells of space are refused.
    World(CachingError),
    /// A least roughness outside of `(0, 1]`.
    Roughness(f32),
    /// A least distance outside of `[0, 1]`.
    Distance(f32),
    /// More samples of direct light than [`MAX_DIRECT_SAMPLES`].
    DirectSamples(u32),
    /// A footprint that is not a positive number of pixels.
    Footprint(f32),
    /// A footprint for paths that start at the sensor, which have no common first vertex.
    FootprintSensor,
    /// More steps of Markov chains than [`MAX_STEPS`].
    Mutations(u32),
}

/// Most trees of candidates for each pixel of a frame.
pub const MAX_CANDIDATES: u32 = 4096;

/// Samples of direct light beside an offline frame, which costs some nine paths.
const DIRECT_SAMPLES: u32 = 4;

/// Most rounds of spatial reuse.
pub const MAX_ROUNDS: u32 = 64;

/// Most steps of Markov chains for each pixel of a frame.
pub const MAX_STEPS: u32 = 64;

impl fmt::Display for RestirPtError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Candidates(count) => write!(f, "{count} candidates are not between 1 and {MAX_CANDIDATES}"),
            Self::Rounds(count) => write!(f, "{count} rounds of reuse are more than {MAX_ROUNDS}"),
            Self::Pattern(error) => write!(f, "{error}"),
            Self::TemporalCap(cap) => write!(f, "a confidence cap of {cap} is not at least 1"),
            Self::TemporalSensor => {
                f.write_str("paths that start at the sensor cannot be reused from the frame before")
            }
            Self::WorldSensor => {
                f.write_str("paths that start at the sensor cannot be reused from cells of space")
            }
            Self::World(error) => error.fmt(f),
            Self::Roughness(alpha) => write!(f, "a least roughness of {alpha} does not lie in (0, 1]"),
            Self::DirectSamples(count) => {
                write!(
                    f,
                    "{count} samples of direct light are more than {MAX_DIRECT_SAMPLES}"
                )
            }
            Self::Footprint(pixels) => {
                write!(f, "a footprint of {pixels} pixels is not a positive number")
            }
            Self::FootprintSensor => f.write_str("paths that start at the sensor have no footprint"),
            Self::Mutations(steps) => write!(f, "{steps} steps of Markov chains are more than {MAX_STEPS}"),
            Self::Distance(share) => write!(f, "a least distance of {share} does not lie in [0, 1]"),
        }
    }
}

impl std::error::Error for RestirPtError {}

impl RestirPtOptions {
    /// A frame at a time, with reuse from the frame before (Lin 2022 §6.7.3): one tree, a cap of
    /// 20, and one round with 3 neighbours within 20 pixels.
    pub fn real_time(mapping: PathMapping) -> Self {
        Self {
            candidates: 1,
            rounds: 1,
            neighbourhood: Neighbourhood::Disk {
                radius: 20.0,
                count: 3,
            },
            temporal_cap: Some(20.0),
            path_starts_at_sensor: false,
            mapping,
            min_roughness: 0.2,
            min_distance: 0.02,
            direct_samples: 0,
            points: PointSet::Independent,
            visible_emission: false,
            pairs: None,
            world: None,
            footprint: None,
            mutations: 0,
        }
    }

    /// Independent frames to be averaged, for the least error in equal time: 3 trees behind one
    /// camera ray, and two rounds with 4 neighbours within 2 pixels. In the same time an image has
    /// more frames than by [`offline_published`](Self::offline_published), so more camera rays,
    /// which the edges of visible surfaces need. Direct light is path traced.
    pub fn offline(mapping: PathMapping) -> Self {
        Self {
            candidates: 3,
            rounds: 2,
            neighbourhood: Neighbourhood::Disk {
                radius: 2.0,
                count: 4,
            },
            temporal_cap: None,
            direct_samples: DIRECT_SAMPLES,
            ..Self::real_time(mapping)
        }
    }

    /// Independent frames as published (Lin 2022 §6.5.5, §B.7): 32 trees, each with a camera ray
    /// of its own, and three rounds with 6 neighbours within 10 pixels.
    pub fn offline_published(mapping: PathMapping) -> Self {
        Self {
            candidates: 32,
            rounds: 3,
            neighbourhood: Neighbourhood::Disk {
                radius: 10.0,
                count: 6,
            },
            temporal_cap: None,
            path_starts_at_sensor: true,
            ..Self::real_time(mapping)
        }
    }

    /// The same with reservoirs in cells of space, beside reuse among pixels and in time (`both`)
    /// or in its place.
    #[must_use]
    pub fn with_world(self, world: WorldReuse, both: bool) -> Self {
        let options = Self {
            world: Some(world),
            ..self
        };
        match both {
            true => options,
            false => Self {
                temporal_cap: None,
                rounds: 0,
                ..options
            },
        }
    }

    /// Number of the frame whose pixels are kept until frame number `frame`: without reuse in time,
    /// one is enough.
    pub(crate) fn kept_frame(&self, frame: u32) -> u32 {
        if self.temporal_cap.is_some() { frame } else { 0 }
    }

    /// The pairs; `None` without spatial reuse in pairs.
    pub(crate) fn paired(&self) -> Result<Option<PairedPattern>, RestirPtError> {
        let pairs = self.pairs.filter(|_| self.rounds > 0).map(PairedPattern::new);
        pairs.transpose().map_err(RestirPtError::Pattern)
    }

    /// The neighbours; `None` without spatial reuse.
    pub(crate) fn pattern(&self) -> Result<Option<Pattern>, RestirPtError> {
        let pattern = match self.neighbourhood {
            _ if self.rounds == 0 => return Ok(None),
            Neighbourhood::Disk { count: 0, .. } => return Ok(None),
            Neighbourhood::Disk { radius, count } => Pattern::disk(radius, count),
            Neighbourhood::Window { radius } => Pattern::window(radius),
        };
        pattern.map(Some).map_err(RestirPtError::Pattern)
    }

    /// The thresholds for a scene.
    pub(crate) fn connectability(&self, scene: &Scene) -> Result<Connectability, RestirPtError> {
        self.thresholds(scene.extent(), scene.materials().iter().all(is_diffuse))
    }

    /// The thresholds of connectability for a scene of this size, in which all materials scatter by
    /// diffuse lobes alone or not.
    ///
    /// # Errors
    /// [`RestirPtError`] for options out of range.
    pub fn thresholds(&self, extent: f32, is_diffuse: bool) -> Result<Connectability, RestirPtError> {
        if !(1..=MAX_CANDIDATES).contains(&self.candidates) {
            return Err(RestirPtError::Candidates(self.candidates));
        }
        if self.rounds > MAX_ROUNDS {
            return Err(RestirPtError::Rounds(self.rounds));
        }
        if self.direct_samples > MAX_DIRECT_SAMPLES {
            return Err(RestirPtError::DirectSamples(self.direct_samples));
        }
        if let Some(cap) = self.temporal_cap
            && !(cap >= 1.0)
        {
            return Err(RestirPtError::TemporalCap(cap));
        }
        if self.temporal_cap.is_some() && self.path_starts_at_sensor {
            return Err(RestirPtError::TemporalSensor);
        }
        if let Some(world) = &self.world {
            world.check().map_err(RestirPtError::World)?;
            if self.path_starts_at_sensor {
                return Err(RestirPtError::WorldSensor);
            }
        }
        if self.mutations > MAX_STEPS {
            return Err(RestirPtError::Mutations(self.mutations));
        }
        if let Some(pixels) = self.footprint {
            if !(pixels > 0.0 && pixels.is_finite()) {
                return Err(RestirPtError::Footprint(pixels));
            }
            if self.path_starts_at_sensor {
                return Err(RestirPtError::FootprintSensor);
            }
        }
        if !(0.0..=1.0).contains(&self.min_distance) {
            return Err(RestirPtError::Distance(self.min_distance));
        }
        let min_distance = self.min_distance * extent;
        // Among diffuse surfaces every pair of vertices is connectable, unless it is too close:
        // replay gains nothing there.
        if self.mapping == PathMapping::Reconnection || is_diffuse {
            Connectability::reconnection(min_distance).map_err(|_| RestirPtError::Distance(self.min_distance))
        } else {
            Connectability::hybrid(self.min_roughness, min_distance)
                .map_err(|_| RestirPtError::Roughness(self.min_roughness))
        }
    }
}

/// Whether a material scatters by diffuse lobes alone.
fn is_diffuse(material: &Material) -> bool {
    match material {
        Material::Diffuse { .. } => true,
        Material::Blend { first, second, .. } => is_diffuse(first) && is_diffuse(second),
        Material::TwoSided { front, back } => is_diffuse(front) && back.as_deref().is_none_or(is_diffuse),
        _ => false,
    }
}
