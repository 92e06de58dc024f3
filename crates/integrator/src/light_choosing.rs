//! Ways to select a finite emitter, by name.

use std::fmt;
use std::str::FromStr;

/// How one of the finite emitters is selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LightChoosing {
    /// All alike.
    Uniform,
    /// In proportion to intensity, for any point.
    Power,
    /// By a perfect binary light tree.
    Tree,
    /// By a perfect binary tree of meshes, each of which has one of its own.
    TwoLevel,
    /// By a light BVH.
    Bvh,
    /// By a light BVH that is quick to build, along a curve.
    CurveBvh,
    /// By a light BVH joined from the bottom up, which takes long to build.
    AgglomerativeBvh,
    /// By a light BVH whose upper levels are of a stochastic subset of the lights.
    StochasticBvh,
    /// By a light BVH whose near nodes are opened first.
    OpenBvh,
    /// By a perfect binary light tree whose near nodes are opened first.
    OpenTree,
    /// By a light BVH along a curve whose near nodes are opened first.
    OpenCurveBvh,
    /// Among the lights that are visible from there, as paths have learnt before, by a
    /// [`LightCache`](lightshed_guiding::LightCache) with a light BVH.
    Vlc,
    /// The same; for glossy surfaces, its weights know the lobe.
    VlcLobes,
    /// None but points and directions, which nothing else finds: surfaces and environments are left
    /// to the directions that paths take, and no list of them is used. Only for methods whose
    /// directions find them; [`ALL`](Self::ALL) does not have it, and no name leads to it.
    Unfound,
}

impl LightChoosing {
    /// All of them but [`Unfound`](Self::Unfound).
    pub const ALL: [Self; 13] = [
        Self::Uniform,
        Self::Power,
        Self::Tree,
        Self::TwoLevel,
        Self::Bvh,
        Self::CurveBvh,
        Self::AgglomerativeBvh,
        Self::StochasticBvh,
        Self::OpenBvh,
        Self::OpenTree,
        Self::OpenCurveBvh,
        Self::Vlc,
        Self::VlcLobes,
    ];

    /// The name by which [`FromStr`] finds it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Power => "power",
            Self::Tree => "tree",
            Self::TwoLevel => "two-level",
            Self::Bvh => "bvh",
            Self::CurveBvh => "curve-bvh",
            Self::AgglomerativeBvh => "agglomerative-bvh",
            Self::StochasticBvh => "stochastic-bvh",
            Self::OpenBvh => "open-bvh",
            Self::OpenTree => "open-tree",
            Self::OpenCurveBvh => "open-curve-bvh",
            Self::Vlc => "vlc",
            Self::VlcLobes => "vlc-lobes",
            Self::Unfound => "none",
        }
    }

    /// Whether it learns from paths.
    pub(crate) fn learns(self) -> bool {
        matches!(self, Self::Vlc | Self::VlcLobes)
    }

    /// Whether it asks for the point that is lit.
    pub fn knows_the_point(self) -> bool {
        !matches!(self, Self::Uniform | Self::Power | Self::Unfound)
    }
}

/// A name that none of [`LightChoosing::ALL`] has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownLightChoosing(String);

impl fmt::Display for UnknownLightChoosing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no light sampler is called {:?}", self.0)
    }
}

impl std::error::Error for UnknownLightChoosing {}

impl FromStr for LightChoosing {
    type Err = UnknownLightChoosing;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| UnknownLightChoosing(name.to_owned()))
    }
}
