//! Options: where paths end, and how the cache is filled.

use crate::guided::{GuideError, GuidedPathsOptions};
use lightshed_caching::{CachingError, Facets, RadianceCacheOptions, Termination};
use lightshed_sampling::PointSet;
use lightshed_scene::Scene;
use lightshed_spatial::LevelGridOptions;
use std::fmt;
use std::str::FromStr;

/// Most passes that fill a cache before the first frame.
pub const MAX_CACHE_PASSES: u32 = 1 << 16;

/// A [`Termination`] by its text: `fixed` or `fixed@EDGE`, `spread` or `spread@SHARE`, `variance@T`
/// relative to the squared brightness, `variance-absolute@T`, `mse@S`. A colon may replace the at
/// sign, which is needed where colons separate options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheRule(pub Termination);

impl FromStr for CacheRule {
    type Err = CachedPathsError;

    fn from_str(text: &str) -> Result<Self, CachedPathsError> {
        let unknown = || CachedPathsError::Rule(text.to_owned());
        let (name, number) = match text.split_once(['@', ':']) {
            Some((name, number)) => (name, Some(number.parse::<f32>().map_err(|_| unknown())?)),
            None => (text, None),
        };
        let margin = Termination::MARGIN;
        let rule = match (name, number) {
            ("fixed", None) => Termination::Fixed { depth: 2 },
            ("fixed", Some(depth)) if depth.fract() == 0.0 && (0.0..1e6).contains(&depth) => {
                Termination::Fixed { depth: depth as u32 }
            }
            ("spread", share) => Termination::Spread {
                share: share.unwrap_or(0.01),
            },
            ("variance", Some(threshold)) => Termination::Variance {
                threshold,
                relative: true,
            },
            ("variance-absolute", Some(threshold)) => Termination::variance(threshold),
            ("mse", Some(target)) => Termination::Mse { target, margin },
            _ => return Err(unknown()),
        };
        rule.check()?;
        Ok(Self(rule))
    }
}

/// How paths end in a cache.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CachedPathsOptions {
    /// Where they end.
    pub rule: Termination,
    /// How the cache is kept.
    pub cache: RadianceCacheOptions,
    /// Passes that fill it before the first frame.
    pub passes: u32,
    /// Whether a further pass comes before each later frame.
    pub every_frame: bool,
    /// Whether the positions of look-ups are moved at random by up to half a cell, which
    /// interpolates between cells on average.
    pub jitter: bool,
    /// How the directions of glossy surfaces are told apart: `None` if these surfaces have no
    /// records and paths pass them.
    pub facets: Option<Facets>,
    /// Probability with which a path survives each vertex except its first, by roulette: 1 for
    /// none.
    pub survival: f32,
    /// The random numbers of a pixel's samples.
    pub points: PointSet,
    /// Whether separate rays estimate emission that the camera sees directly.
    pub visible_emission: bool,
    /// Samples in each pixel of a frame.
    pub samples: u32,
    /// What guides directions, if anything does. The passes train the guide by their samples, up to
    /// the middle of all passes before the first frame; so the later half measures local variances
    /// of the guide that frames use. How long and by which samples a guide trains otherwise
    /// ([`training`](GuidedPathsOptions::training), `every_frame`, `samples`, `may_drop`, `volume`)
    /// has no effect.
    pub guide: Option<GuidedPathsOptions>,
}

impl CachedPathsOptions {
    /// A rule in a scene, with a cache of up to 2¹⁷ records whose cells have a size of two to three
    /// degrees. A pass takes four samples of each of a record's vertices: smaller cells with fewer
    /// samples have the same noise over a surface and less bias.
    pub fn new(rule: Termination, scene: &Scene) -> Self {
        let cells = LevelGridOptions {
            growth: 0.05,
            ..LevelGridOptions::new(scene.extent() / 700.0)
        };
        Self {
            rule,
            cache: RadianceCacheOptions {
                slots: 1 << 17,
                samples: 4,
                ..RadianceCacheOptions::new(cells)
            },
            passes: 64,
            every_frame: false,
            jitter: true,
            facets: None,
            survival: 1.0,
            points: PointSet::Sobol,
            visible_emission: true,
            samples: 1,
            guide: None,
        }
    }

    pub(super) fn check(&self) -> Result<(), CachedPathsError> {
        self.rule.check()?;
        if self.passes > MAX_CACHE_PASSES {
            return Err(CachedPathsError::Passes(self.passes));
        }
        if !(self.survival > 0.0 && self.survival <= 1.0) {
            return Err(CachedPathsError::Survival(self.survival));
        }
        Ok(())
    }
}

/// Why paths cannot end in a cache.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum CachedPathsError {
    /// No rule is called so.
    Rule(String),
    /// A probability of survival that is not above 0 and at most 1.
    Survival(f32),
    /// More passes than [`MAX_CACHE_PASSES`].
    Passes(u32),
    /// Options of the rule or the cache.
    Caching(CachingError),
    /// Options of the guide, or a scene that cannot be guided.
    Guide(GuideError),
}

impl fmt::Display for CachedPathsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rule(text) => write!(
                f,
                "{text} is not one of fixed[:EDGE], spread[:SHARE], variance:T, variance-absolute:T, mse:S"
            ),
            Self::Survival(survival) => {
                write!(f, "a survival of {survival}: it must be above 0 and at most 1")
            }
            Self::Passes(passes) => {
                write!(f, "{passes} passes: there may be {MAX_CACHE_PASSES}")
            }
            Self::Caching(error) => write!(f, "{error}"),
            Self::Guide(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for CachedPathsError {}

impl From<CachingError> for CachedPathsError {
    fn from(error: CachingError) -> Self {
        Self::Caching(error)
    }
}

impl From<GuideError> for CachedPathsError {
    fn from(error: GuideError) -> Self {
        Self::Guide(error)
    }
}
