//! Options of guides and their training.

use crate::volume::volpath::VolumeTracking;
use lightshed_guiding::{
    FieldOptions, GuidingError, HashCellsOptions, MAX_LOBES, MarkovOptions, PlaceOptions, QuadtreeOptions,
    VmfFitOptions, WeightedTreeOptions,
};
use lightshed_sampling::PointSet;
use lightshed_scene::volume::FlightGuiding;
use std::fmt;
use std::str::FromStr;

/// What a guide learns in each region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GuideKind {
    /// Quadtrees of a few bits in an octree.
    Quadtree,
    /// Quadtrees with weights in a binary tree: an SD-tree.
    SdTree,
    /// Mixtures of eight von Mises–Fisher lobes in an octree.
    Vmf,
    /// Eight Markov chains, each with a lobe, in an octree.
    Mixture,
    /// A few Markov chains in each cell of a hash grid, in a bounded memory.
    MixtureGrid,
    /// Dozens of lobes towards places in an octree, for many small lights.
    Places,
}

impl GuideKind {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Quadtree,
        Self::SdTree,
        Self::Vmf,
        Self::Mixture,
        Self::MixtureGrid,
        Self::Places,
    ];

    /// The name by which [`FromStr`] finds it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quadtree => "cdq",
            Self::SdTree => "sdtree",
            Self::Vmf => "vmf",
            Self::Mixture => "mcmm",
            Self::MixtureGrid => "mcmm-grid",
            Self::Places => "places",
        }
    }

    /// What a vertex with a guide costs beyond one without, in times of a ray of a scene of few
    /// triangles, with the shading at its end. The constants are measured, see `docs/guiding.md`.
    pub(crate) fn look_up_cost(self) -> f64 {
        match self {
            Self::Quadtree => 1.7,
            Self::SdTree => 2.0,
            Self::Vmf => 1.8,
            Self::Mixture | Self::MixtureGrid => 2.6,
            Self::Places => 4.0,
        }
    }
}

/// A name that none of [`GuideKind::ALL`] has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownGuide(String);

impl fmt::Display for UnknownGuide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = GuideKind::ALL.map(GuideKind::name).join(", ");
        write!(f, "{} is not one of {names}", self.0)
    }
}

impl std::error::Error for UnknownGuide {}

impl FromStr for GuideKind {
    type Err = UnknownGuide;

    fn from_str(name: &str) -> Result<Self, UnknownGuide> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| UnknownGuide(name.to_owned()))
    }
}

/// How paths are guided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidedPathsOptions {
    /// What is learnt.
    pub kind: GuideKind,
    /// How trees of a few bits learn.
    pub quadtree: QuadtreeOptions,
    /// How trees with weights learn.
    pub weighted: WeightedTreeOptions,
    /// How mixtures are fitted.
    pub vmf: VmfFitOptions,
    /// How chains learn and wander.
    pub chains: MarkovOptions,
    /// Chains in each region or cell, 1 to [`MAX_LOBES`].
    pub states: u32,
    /// Cells of a hash grid; [`memory`](Self::memory) decides on how many there are.
    pub cells: HashCellsOptions,
    /// Bytes of the cells of a hash grid with what they know. Samples that wait for an update come
    /// on top of it.
    pub memory: usize,
    /// How places are learnt.
    pub places: PlaceOptions,
    /// How regions are divided and shares are learnt.
    pub field: FieldOptions,
    /// Frames that train; the guide learns after the first, the second, the fourth and so on.
    pub training: u32,
    /// Most frames from one time that it learns to the next, from 1 on.
    pub learn_within: u32,
    /// Whether the guide learns after every frame instead, without end; for moving scenes.
    pub every_frame: bool,
    /// The random numbers of a pixel's samples.
    pub points: PointSet,
    /// Samples in each pixel of a frame: an even number.
    pub samples: u32,
    /// Samples in each pixel of a frame that trains, besides: of the BSDF alone. They do not shade,
    /// and the field learns from those that find what it does not know.
    pub exploring: u32,
    /// Most samples that wait for an update; of more, some are left out.
    pub max_recorded: u32,
    /// Whether a guide that gains less than it costs is dropped once it is trained.
    pub may_drop: bool,
    /// First edge at which roulette may end a guided path; the scene's if that is later. A guide
    /// samples bright directions often and with small weights, and roulette by these weights would
    /// end just the paths that find light.
    pub roulette_depth: u32,
    /// First edge at which roulette by what a path is worth may end a guided path, see
    /// [`Visit`](lightshed_guiding::Visit); none where that is later than all edges.
    pub worth_depth: u32,
    /// Separate rays for directly visible emission, as
    /// [`PathTracer::with_visible_emission`](crate::PathTracer::with_visible_emission) has; not in
    /// media.
    pub visible_emission: bool,
    /// How paths fly through media; `None` sees no media, as [`PathTracer`](crate::PathTracer).
    pub volume: Option<VolumeTracking>,
    /// How flights through media are guided between colliding and passing; `None` leaves that to
    /// the medium.
    pub flights: Option<FlightGuiding>,
}

impl GuidedPathsOptions {
    /// The defaults of a kind of guide.
    pub fn new(kind: GuideKind) -> Self {
        Self {
            kind,
            quadtree: QuadtreeOptions::default(),
            weighted: WeightedTreeOptions::default(),
            vmf: VmfFitOptions::default(),
            chains: MarkovOptions {
                survival: 0.5,
                ..MarkovOptions::default()
            },
            states: MAX_LOBES as u32,
            cells: HashCellsOptions::default(),
            memory: 8 << 20,
            places: PlaceOptions::default(),
            field: match kind {
                GuideKind::Places => places_field(),
                _ => FieldOptions::default(),
            },
            training: match kind {
                // What is not known yet is nearly all of the noise.
                GuideKind::Places => u32::MAX,
                _ => 32,
            },
            learn_within: match kind {
                GuideKind::Places => 64,
                _ => u32::MAX,
            },
            every_frame: false,
            points: PointSet::Sobol,
            samples: 4,
            exploring: match kind {
                GuideKind::Places => 4,
                _ => 0,
            },
            max_recorded: 1 << 23,
            may_drop: true,
            roulette_depth: 12,
            worth_depth: 2,
            visible_emission: true,
            volume: None,
            flights: None,
        }
    }
}

/// Places mean the same from everywhere, so regions are large; they only differ in what is visible
/// from there, and how bright. What is left of the noise is of lights that no region knows yet, so
/// half of the directions look for them.
fn places_field() -> FieldOptions {
    FieldOptions {
        split_above: 4096,
        collapse_below: 2048,
        max_share: 0.5,
        ..FieldOptions::default()
    }
}

/// Why paths cannot be guided.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum GuideError {
    /// The samples of a frame are not an even number from 2 to 1,024.
    Samples(u32),
    /// Worlds that another guide has used.
    Used,
    /// Options of the guide, or a scene without extent.
    Guiding(GuidingError),
}

impl fmt::Display for GuideError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Samples(samples) => {
                write!(
                    f,
                    "{samples} samples in each pixel of a frame: it must be an even number in 2..=1024"
                )
            }
            Self::Used => f.write_str("another guide has used these worlds"),
            Self::Guiding(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for GuideError {}

impl From<GuidingError> for GuideError {
    fn from(error: GuidingError) -> Self {
        Self::Guiding(error)
    }
}
