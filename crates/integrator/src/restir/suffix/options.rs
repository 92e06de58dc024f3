//! Options of suffix reuse.

use crate::restir::pt::{PathMapping, RestirPtError, RestirPtOptions};
use lightshed_resampling::FinalGather;
use lightshed_scene::Scene;
use lightshed_shift::Connectability;
use std::fmt;

/// Parameters of [`RestirSuffix`](crate::RestirSuffix).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestirSuffixOptions {
    /// How suffixes are found and reused behind supporting prefixes. `path_starts_at_sensor` has no
    /// effect here. With `direct_samples`, prefixes find no light of paths of up to two edges.
    pub suffixes: RestirPtOptions,
    /// Confidence cap of the supporting prefixes' own temporal reuse, at least 1: approximately the
    /// number of frames that a supporting prefix stays. No effect without temporal reuse.
    pub prefix_cap: f32,
    /// Integration prefixes `N` of each pixel and frame.
    pub prefixes: u32,
    /// Camera rays that they start from, from 1 to `N`; the first is that of the supporting prefix,
    /// if every pixel has one.
    pub camera_rays: u32,
    /// How many of them trace a suffix of their own, from 1 to `N`; 1 is roulette (Kettunen 2023
    /// §7).
    pub canonical: u32,
    /// Supporting prefixes `M − 1` whose suffixes an integration prefix borrows; 0 for none.
    pub borrowed: u32,
    /// Side of the square of pixels that have one supporting prefix, from 1 to [`MAX_SPACING`]:
    /// fewer of them take less time. Neighbourhoods and pairs of suffixes count supporting
    /// prefixes, not pixels.
    pub spacing: u32,
    /// Search radius for supporting prefixes, as a share of the scene's size.
    pub search_radius: f32,
    /// Leaves of the tree of supporting prefixes that a search looks at, of eight prefixes each, at
    /// least 1. `u32::MAX` finds the nearest prefixes, fewer find near ones sooner.
    pub search_leaves: u32,
    /// The distance that a turn of the normal by about 57° counts in the search, as a share of the
    /// scene's size.
    pub normal_scale: f32,
}

/// Why options are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RestirSuffixError {
    /// Those of the suffixes.
    Suffixes(RestirPtError),
    /// No prefixes, or more than [`MAX_PREFIXES`], or a number of canonical suffixes that is not
    /// from 1 to that of prefixes.
    Prefixes(u32, u32),
    /// A number of camera rays that is not from 1 to that of prefixes.
    CameraRays(u32),
    /// A cap of prefixes below 1, or NaN.
    PrefixCap(f32),
    /// More borrowed suffixes than [`MAX_BORROWED`].
    Borrowed(u32),
    /// A spacing that is not from 1 to [`MAX_SPACING`].
    Spacing(u32),
    /// No leaves to search.
    SearchLeaves,
    /// Suffixes have no cells of space.
    World,
    /// A search radius or a scale of normals that is negative, infinite or NaN.
    Search(f32),
}

/// Most integration prefixes of a pixel and frame.
pub const MAX_PREFIXES: u32 = 1024;

/// Largest side of the square of pixels that have one supporting prefix.
pub const MAX_SPACING: u32 = 64;

/// Most suffixes that an integration prefix borrows.
pub const MAX_BORROWED: u32 = 32;

impl fmt::Display for RestirSuffixError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Suffixes(error) => write!(f, "{error}"),
            Self::Prefixes(prefixes, canonical) => write!(
                f,
                "{canonical} canonical suffixes of {prefixes} prefixes: it takes 1 to {MAX_PREFIXES} prefixes, and one \
                 suffix at least, one for each at most"
            ),
            Self::CameraRays(count) => {
                write!(
                    f,
                    "{count} camera rays are not between 1 and the number of prefixes"
                )
            }
            Self::PrefixCap(cap) => write!(f, "a confidence cap of {cap} for prefixes is not at least 1"),
            Self::Borrowed(count) => write!(f, "{count} borrowed suffixes are more than {MAX_BORROWED}"),
            Self::Spacing(side) => write!(f, "a spacing of {side} pixels is not between 1 and {MAX_SPACING}"),
            Self::World => f.write_str("suffixes are not reused from cells of space"),
            Self::SearchLeaves => write!(f, "a search looks at one leaf at least"),
            Self::Search(share) => write!(
                f,
                "a share of {share} of the scene's size is not finite and at least 0"
            ),
        }
    }
}

impl std::error::Error for RestirSuffixError {}

impl From<RestirPtError> for RestirSuffixError {
    fn from(error: RestirPtError) -> Self {
        Self::Suffixes(error)
    }
}

impl RestirSuffixOptions {
    /// A frame at a time, with reuse from the frame before (Kettunen 2023 §8): eight integration
    /// prefixes behind four camera rays, each with one borrowed suffix and every other one with a
    /// suffix of its own.
    pub fn real_time(mapping: PathMapping) -> Self {
        Self {
            suffixes: RestirPtOptions {
                direct_samples: 8,
                ..RestirPtOptions::real_time(mapping)
            },
            prefix_cap: 8.0,
            prefixes: 8,
            camera_rays: 4,
            canonical: 4,
            borrowed: 1,
            spacing: 1,
            search_radius: 0.2,
            search_leaves: 2,
            normal_scale: 0.1,
        }
    }

    /// Independent frames to be averaged: eight trees behind each supporting prefix, two rounds
    /// with 6 neighbours, and 32 prefixes with three borrowed suffixes each.
    pub fn offline(mapping: PathMapping) -> Self {
        let suffixes = RestirPtOptions {
            candidates: 8,
            rounds: 2,
            path_starts_at_sensor: false,
            direct_samples: 32,
            ..RestirPtOptions::offline_published(mapping)
        };
        Self {
            suffixes,
            prefixes: 32,
            camera_rays: 8,
            canonical: 4,
            borrowed: 3,
            search_leaves: u32::MAX,
            ..Self::real_time(mapping)
        }
    }

    /// Where prefixes end in a scene, how suffixes are shifted, and the gather.
    pub(super) fn checked(
        &self,
        scene: &Scene,
    ) -> Result<(Connectability, Connectability, FinalGather), RestirSuffixError> {
        let connectability = self.suffixes.connectability(scene)?;
        if self.suffixes.world.is_some() {
            return Err(RestirSuffixError::World);
        }
        if !(self.prefix_cap >= 1.0) {
            return Err(RestirSuffixError::PrefixCap(self.prefix_cap));
        }
        if self.borrowed > MAX_BORROWED {
            return Err(RestirSuffixError::Borrowed(self.borrowed));
        }
        if !(1..=MAX_SPACING).contains(&self.spacing) {
            return Err(RestirSuffixError::Spacing(self.spacing));
        }
        if self.search_leaves == 0 {
            return Err(RestirSuffixError::SearchLeaves);
        }
        for share in [self.search_radius, self.normal_scale] {
            if !(share >= 0.0 && share.is_finite()) {
                return Err(RestirSuffixError::Search(share));
            }
        }
        let gather =
            FinalGather::new(self.prefixes, self.canonical).filter(|_| self.prefixes <= MAX_PREFIXES);
        let gather = gather.ok_or(RestirSuffixError::Prefixes(self.prefixes, self.canonical))?;
        if !(1..=self.prefixes).contains(&self.camera_rays) {
            return Err(RestirSuffixError::CameraRays(self.camera_rays));
        }
        // Unlike paths, prefixes that could not be reconnected at the second vertex continue to a
        // vertex where they can.
        let ends = Connectability::hybrid(self.suffixes.min_roughness, connectability.min_distance())
            .map_err(|_| RestirPtError::Roughness(self.suffixes.min_roughness))?;
        Ok((ends, connectability, gather))
    }
}
