//! The options that methods take, and the parameters that they become.

use super::option::{MethodOption, MethodValues, any, one_of, within};
use crate::{
    CacheRule, CachedPathsOptions, CutTree, GuideKind, GuideSource, GuidedPathsOptions, LightChoosing,
    LightcutOptions, MAX_CACHE_PASSES, MAX_DIRECT_SAMPLES, MAX_MIXTURE_STEPS, MixtureOptions, MixtureSets,
    PathMapping, RestirPtOptions, RestirSuffixOptions, ShadowTargets, TILE_SIZES, VplGridOptions, VplOptions,
    WorldReuse,
};
use lightshed_caching::{Facets, Refinement};
use lightshed_guiding::Interpolation;
use lightshed_lights::{GridOptions, Levels};
use lightshed_resampling::PairedPattern;
use lightshed_sampling::PointSet;
use lightshed_scene::Scene;
use lightshed_scene::volume::FlightGuiding;

/// How emitters are chosen.
pub const LIGHTS: MethodOption = MethodOption::new(
    "lights",
    "HOW",
    "",
    |text| one_of(text, &LightChoosing::ALL.map(LightChoosing::name)),
    "How an emitter is chosen; by power and without regard to the point if not given",
);

/// The random numbers of a pixel's samples.
pub const POINTS: MethodOption = MethodOption::new(
    "points",
    "SET",
    "sobol",
    |text| one_of(text, &PointSet::ALL.map(PointSet::name)),
    "Random numbers of a pixel's samples: sobol, stratified over the samples, blue-noise, stratified over neighbouring pixels, too, or independent",
);

/// What guides directions.
pub const GUIDE: MethodOption = MethodOption::new(
    "guide",
    "WHAT",
    "none",
    |text| match text {
        "none" => Ok(()),
        _ => one_of(text, &GuideKind::ALL.map(GuideKind::name)),
    },
    "What guides directions: none, cdq (quadtrees of a few bits in an octree), sdtree (quadtrees with weights in a binary tree), \
     vmf (mixtures of lobes in an octree), mcmm (Markov chains of lobes in an octree), mcmm-grid (the same in a hash grid of bounded memory) or places (many small lights in an octree)",
);

/// Bits of a quadtree.
pub const GUIDE_BITS: MethodOption = MethodOption::new(
    "guide-bits",
    "BITS",
    "64",
    |text| match text.parse::<u32>() {
        Ok(bits) if bits.is_multiple_of(32) && (32..=1024).contains(&bits) => Ok(()),
        _ => Err(format!("{text} is not a multiple of 32 in 32..=1024")),
    },
    "Bits of a quadtree of --guide cdq",
);

/// Chains of a region.
pub const GUIDE_STATES: MethodOption = MethodOption::new(
    "guide-states",
    "N",
    "8",
    |text| match text.parse::<u32>() {
        Ok(states) if (1..=8).contains(&states) => Ok(()),
        _ => Err(format!("{text} is not in 1..=8")),
    },
    "Chains in a region of --guide mcmm or a cell of --guide mcmm-grid",
);

/// Memory of a hash grid.
pub const GUIDE_MEMORY: MethodOption = MethodOption::new(
    "guide-memory",
    "MIB",
    "8",
    |text| match text.parse::<f64>() {
        Ok(size) if size > 0.0 && size <= 65536.0 => Ok(()),
        _ => Err(format!("{text} is not over 0 to 65536")),
    },
    "Memory of the cells of --guide mcmm-grid in MiB; cells are as many as fit, by a power of two",
);

/// Whether quadtrees are multiplied by what surfaces reflect.
pub const GUIDE_PRODUCT: MethodOption = MethodOption::switch(
    "guide-product",
    "Multiply the directions of --guide cdq, of at most 128 bits, by what a surface reflects",
);

/// Frames that train a guide.
pub const GUIDE_TRAINING: MethodOption = MethodOption::new(
    "guide-training",
    "FRAMES",
    "32",
    any::<u32>,
    "Frames of four samples a pixel that train the guide; with --guide places all, if not given",
);

/// What a guide of resampled paths learns from.
pub const GUIDE_FROM: MethodOption = MethodOption::new(
    "guide-from",
    "WHAT",
    "paths",
    |text| one_of(text, &GuideSource::ALL.map(GuideSource::name)),
    "What the guide learns from: paths of the path tracer that do not shade, reservoirs (the paths that pixels hold after resampling, \
     which are forgotten whenever it has learnt), or both",
);

/// A guide that is trained for ever.
pub const GUIDE_ALWAYS: MethodOption = MethodOption::switch(
    "guide-always",
    "Train the guide by each frame for the next, without end, and never drop it",
);

/// How regions are blended.
pub const GUIDE_BORDERS: MethodOption = MethodOption::switch(
    "guide-borders",
    "Let a guide's regions end at their borders instead of blending them",
);

/// Whether flights are guided.
pub const GUIDE_SCATTER: MethodOption = MethodOption::switch(
    "guide-scatter",
    "Guide in media, too, whether a path scatters or passes",
);

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

/// States of a pixel.
pub const STATES: MethodOption = MethodOption::new(
    "states",
    "N",
    "1",
    |text| match text.parse() {
        Ok(states) if crate::STATES.contains(&states) => Ok(()),
        _ => Err(format!("{text} is none of {:?}", crate::STATES)),
    },
    "States of a pixel, each with a lobe and a ray in each step: 1, 2, 4 or 8, at most as many as a set has techniques",
);

/// Emitter samples beside the chains.
pub const SMIS_EMITTERS: MethodOption = MethodOption::switch(
    "smis-emitters",
    "Merge an emitter sample with each set; without, no list of lights is used but for points and directions",
);

/// Where paths end in a cache.
pub const CACHE: MethodOption = MethodOption::new(
    "cache",
    "RULE",
    "none",
    |text| match text {
        "none" => Ok(()),
        _ => text
            .parse::<CacheRule>()
            .map(|_| ())
            .map_err(|error| error.to_string()),
    },
    "Where paths end in a cache of radiance, which is biased: none, fixed[:EDGE], spread[:SHARE], variance:T (relative to the \
     squared brightness) or variance-absolute:T, as late as that bound on a sample's variance allows, or mse:S, where the error \
     of S samples is least",
);

/// Passes that fill a cache.
pub const CACHE_PASSES: MethodOption = MethodOption::new(
    "cache-passes",
    "N",
    "64",
    |text| within(text, 1..=MAX_CACHE_PASSES),
    "Passes that fill the cache of --cache before the first frame",
);

/// A cache that is updated for ever.
pub const CACHE_ALWAYS: MethodOption = MethodOption::switch(
    "cache-always",
    "Update the cache of --cache before each frame, too",
);

/// How large the cells of a cache are seen.
pub const CACHE_CELLS: MethodOption = MethodOption::new(
    "cache-cells",
    "ANGLE",
    "0.1",
    any::<f32>,
    "Side of the cells of --cache, seen from the camera, in radians; rounded down to a power of two times the finest",
);

/// Cells of a cache that are split.
pub const CACHE_REFINE: MethodOption = MethodOption::new(
    "cache-refine",
    "LEVELS",
    "0",
    |text| within(text, 0..=lightshed_caching::MAX_REFINEMENT),
    "How often cells of --cache are halved where their own bias dominates",
);

/// Records by direction.
pub const CACHE_FACETS: MethodOption = MethodOption::new(
    "cache-facets",
    "N",
    "0",
    |text| within(text, 0..=u32::from(lightshed_caching::MAX_FACETS)),
    "Records of --cache for glossy surfaces, in each of N² facets of directions; 0 if paths pass these surfaces",
);

/// Cells of a cache that are not interpolated.
pub const CACHE_BORDERS: MethodOption = MethodOption::switch(
    "cache-borders",
    "Let the cells of --cache end at their borders instead of looking them up at places moved at random",
);

/// Roulette of paths with a cache.
pub const CACHE_SURVIVAL: MethodOption = MethodOption::new(
    "cache-survival",
    "P",
    "1",
    any::<f32>,
    "Probability with which paths of --cache survive each vertex but their first",
);

/// How emission that the camera sees is found.
pub const VISIBLE: MethodOption = MethodOption::new(
    "visible",
    "HOW",
    "rays",
    |text| one_of(text, &["rays", "paths"]),
    "How emission that the camera sees directly is found: by rays of its own, several a sample where emitters may be seen, or by paths",
);

/// Samples of emitters at a point.
pub const LIGHT_SAMPLES: MethodOption = MethodOption::new(
    "light-samples",
    "N",
    "1",
    |text| within(text, 1..=MAX_DIRECT_SAMPLES),
    "Samples of emitters, chosen as --lights says, at the point that a camera ray meets",
);

/// Samples of direct light beside resampled paths.
pub const DIRECT_SAMPLES: MethodOption = MethodOption::new(
    "direct-samples",
    "N",
    "",
    |text| within(text, 0..=MAX_DIRECT_SAMPLES),
    "Samples of direct light a frame, each behind a camera ray of its own, beside resampled longer paths: 4 of \
     restir-pt-offline, 8 of restir-suffix and 32 of its offline frames, if not given; 0 resamples direct light, too",
);

/// The shift mapping.
pub const SHIFT: MethodOption = MethodOption::new(
    "shift",
    "SHIFT",
    "hybrid",
    |text| one_of(text, &["hybrid", "reconnection"]),
    "How paths are carried between pixels: hybrid, by random replay up to the first vertices that can be reconnected, or \
     reconnection, to the second surface",
);

/// How long reservoirs are kept.
pub const CAP: MethodOption = MethodOption::new(
    "cap",
    "FRAMES",
    "",
    |text| match text.parse::<f32>() {
        Ok(cap) if cap >= 1.0 && cap.is_finite() => Ok(()),
        _ => Err(format!("{text} is not a finite number from 1 on")),
    },
    "Confidence cap of reuse from the frame before, at least 1, about the number of frames that a sample stays: 20 if not \
     given. A denoiser that averages over frames itself is left least error by about 5",
);

/// Reuse in pairs.
pub const PAIRS: MethodOption = MethodOption::new(
    "pairs",
    "BLOCK",
    "",
    |text| {
        PairedPattern::new(text.parse().unwrap_or(0))
            .map(|_| ())
            .map_err(|error| error.to_string())
    },
    "Reuse among pixels in three rounds of pairs that reuse from each other, within blocks of so many pixels (a power of \
     two), in place of neighbours in a disk",
);

/// Steps of Markov chains.
pub const MUTATIONS: MethodOption = MethodOption::new(
    "mutations",
    "N",
    "0",
    |text| within(text, 0..=64),
    "Steps of a Markov chain on each pixel's sample after reuse from the frame before: its point of an emitter, or the \
     vertex at which its path reconnects",
);

/// Candidates that know of each other.
pub const STRATIFIED: MethodOption = MethodOption::switch(
    "stratified",
    "Stratify a pixel's candidates for light: a lattice with one random shift",
);

/// Reconnections by the spread of paths.
pub const FOOTPRINT: MethodOption = MethodOption::new(
    "footprint",
    "PIXELS",
    "",
    |text| match text.parse::<f32>() {
        Ok(pixels) if pixels > 0.0 && pixels.is_finite() => Ok(()),
        _ => Err(format!("{text} is not a positive number of pixels")),
    },
    "Reconnect paths where they spread over the area of so many pixels, in place of a least distance of vertices and a \
     least roughness of lobes",
);

/// Where reservoirs are.
pub const RESERVOIRS: MethodOption = MethodOption::new(
    "reservoirs",
    "WHERE",
    "screen",
    |text| one_of(text, &["screen", "world", "both"]),
    "Where reservoirs are that pixels reuse from: screen (neighbours and the frame before), world (cells of space, which \
     stay when the camera moves) or both",
);

/// Size of cells.
pub const WORLD_CELLS: MethodOption = MethodOption::new(
    "world-cells",
    "PIXELS",
    "16",
    any::<f32>,
    "Side of the cells of --reservoirs world, in pixels of the middle of the image, rounded down to a power of two times \
     the finest",
);

/// How far cells are trusted.
pub const WORLD_CAP: MethodOption = MethodOption::new(
    "world-cap",
    "M",
    "320",
    any::<f32>,
    "Most confidence of what a cell holds, in candidates of a pixel and frame",
);

/// Pixels that bring something to a cell.
pub const WORLD_BRING: MethodOption = MethodOption::new(
    "world-bring",
    "N",
    "16",
    any::<u32>,
    "Most pixels of a frame whose candidates a cell takes",
);

/// Reservoirs that a pixel reads.
pub const WORLD_READS: MethodOption = MethodOption::new(
    "world-reads",
    "N",
    "2",
    |text| within(text, 1..=lightshed_caching::MAX_READS),
    "Reservoirs of cells that a pixel reads in a frame",
);

/// Integration prefixes.
pub const PREFIXES: MethodOption = MethodOption::new(
    "prefixes",
    "N",
    "",
    |text| within(text, 1..=crate::MAX_PREFIXES),
    "Integration prefixes of a pixel and frame: 8, or 32 offline, if not given",
);

/// Camera rays of integration prefixes.
pub const CAMERA_RAYS: MethodOption = MethodOption::new(
    "camera-rays",
    "N",
    "",
    |text| within(text, 1..=crate::MAX_PREFIXES),
    "Camera rays of a pixel and frame that integration prefixes start from: 4, or 8 offline, if not given",
);

/// Canonical suffixes.
pub const CANONICAL: MethodOption = MethodOption::new(
    "canonical",
    "K",
    "",
    |text| within(text, 1..=crate::MAX_PREFIXES),
    "Integration prefixes that trace a suffix of their own: 4 if not given; roulette leaves the others none",
);

/// Borrowed suffixes.
pub const BORROWED: MethodOption = MethodOption::new(
    "borrowed",
    "N",
    "",
    |text| within(text, 0..=crate::MAX_BORROWED),
    "Supporting prefixes whose suffixes an integration prefix borrows: 1, or 3 offline, if not given",
);

/// Spacing of supporting prefixes.
pub const SPACING: MethodOption = MethodOption::new(
    "spacing",
    "PIXELS",
    "1",
    |text| within(text, 1..=crate::MAX_SPACING),
    "Side of the square of pixels that have one supporting prefix",
);

/// Most scattering vertices.
pub const SCATTERINGS: MethodOption = MethodOption::new(
    "scatterings",
    "N",
    "",
    |text| within(text, 1..=crate::MAX_SCATTERINGS),
    "Most scattering vertices of a path; as many as the longest path allows if not given",
);

/// Subtrees of a cut.
pub const CUT_SUBTREES: MethodOption = MethodOption::new(
    "cut-subtrees",
    "N",
    "8",
    any::<u32>,
    "Subtrees of a cut: emitter samples of a pixel and frame",
);

/// Pixels that share a cut.
pub const CUT_BLOCK: MethodOption = MethodOption::new(
    "cut-block",
    "K",
    "8",
    any::<u32>,
    "Side of the pixel blocks that share a cut",
);

/// Pixels that divide a cut.
pub const CUT_INTERLEAVING: MethodOption = MethodOption::new(
    "cut-interleaving",
    "M",
    "1",
    any::<u32>,
    "Side of the pixel blocks that divide a cut among themselves",
);

/// The tree that is cut.
pub const CUT_TREE: MethodOption = MethodOption::new(
    "cut-tree",
    "TREE",
    "perfect",
    |text| one_of(text, &CUT_TREES.map(|(name, _)| name)),
    "The tree that is cut: perfect, bvh, curve-bvh or agglomerative-bvh",
);

/// Names of the trees that can be cut.
const CUT_TREES: [(&str, CutTree); 4] = [
    ("perfect", CutTree::Perfect),
    ("bvh", CutTree::Bvh),
    ("curve-bvh", CutTree::CurveBvh),
    ("agglomerative-bvh", CutTree::AgglomerativeBvh),
];

/// Building the tree again.
pub const CUT_REBUILD: MethodOption =
    MethodOption::switch("cut-rebuild", "Build the tree that is cut again for every frame");

/// Light paths.
pub const VPL_PATHS: MethodOption =
    MethodOption::new("vpl-paths", "N", "10000", any::<u32>, "Light paths of a frame");

/// Clamping of near lights.
pub const VPL_CLAMP: MethodOption = MethodOption::new(
    "vpl-clamp",
    "SHARE",
    "0.01",
    any::<f32>,
    "Lights nearer than this share of the scene's extent count as if they were that far: clamping bias",
);

/// Lights that stay.
pub const VPL_FIXED: MethodOption = MethodOption::switch("vpl-fixed", "Every frame has the same lights");

/// Some lights instead of all.
pub const VPL_SUBSET: MethodOption = MethodOption::new(
    "vpl-subset",
    "N",
    "",
    any::<u32>,
    "Lights that a point looks at instead of all",
);

/// Accuracy of the hierarchy.
pub const ALPHA: MethodOption = MethodOption::new("alpha", "A", "1", any::<f32>, "Accuracy of the hierarchy");

/// Levels of the hierarchy.
pub const LEVELS: MethodOption = MethodOption::new(
    "levels",
    "N",
    "",
    any::<u32>,
    "Levels of the hierarchy; as many as the lights ask for if not given",
);

/// The level at a point.
pub const FIRST_LEVEL: MethodOption = MethodOption::new(
    "first-level",
    "LEVEL",
    "1",
    any::<u32>,
    "Use the lights themselves near a point (0) or start from the first grid (1)",
);

/// Shadow rays.
pub const SHADOW_SAMPLES: MethodOption = MethodOption::new(
    "shadow-samples",
    "N",
    "4",
    any::<u32>,
    "Shadow rays a pixel; 0 for no indirect shadows",
);

/// Ends of shadow rays.
pub const SHADOW_SPREAD: MethodOption = MethodOption::switch(
    "shadow-spread",
    "End shadow rays in the spread of a grid light instead of at a light that it stands for",
);

/// The shadow filter.
pub const SHADOW_FILTER: MethodOption = MethodOption::new(
    "shadow-filter",
    "N",
    "4",
    any::<u32>,
    "Iterations of the shadow filter",
);

/// Pixels that share the lights.
pub const INTERLEAVE: MethodOption = MethodOption::new(
    "interleave",
    "N",
    "1",
    any::<u32>,
    "Side of the pixel blocks that share the lights: 1, 2 or 4",
);

impl MethodValues {
    /// How emitters are chosen, if not by power.
    pub fn light_choosing(&self) -> Option<LightChoosing> {
        self.get(&LIGHTS)
    }

    /// The random numbers of a pixel's samples: stratified unless told otherwise.
    pub fn points(&self) -> PointSet {
        self.get(&POINTS).unwrap_or(PointSet::Sobol)
    }

    /// The same, if told.
    pub fn points_given(&self) -> Option<PointSet> {
        self.has(&POINTS).then(|| self.points())
    }

    /// How paths are guided, if they are.
    pub fn guided_paths(&self) -> Option<GuidedPathsOptions> {
        let mut options = GuidedPathsOptions::new(self.get(&GUIDE)?);
        options.quadtree.bits = self.get(&GUIDE_BITS).unwrap_or(options.quadtree.bits);
        options.states = self.get(&GUIDE_STATES).unwrap_or(options.states);
        let bytes = |size: f64| (size * f64::from(1 << 20)) as usize;
        options.memory = self.get(&GUIDE_MEMORY).map_or(options.memory, bytes);
        options.quadtree.product = self.is_on(&GUIDE_PRODUCT);
        options.training = self.guide_training_given().unwrap_or(options.training);
        if self.is_on(&GUIDE_ALWAYS) {
            (options.every_frame, options.may_drop) = (true, false);
        }
        if self.is_on(&GUIDE_BORDERS) {
            options.field.interpolation = Interpolation::None;
        }
        options.flights = self.is_on(&GUIDE_SCATTER).then(FlightGuiding::default);
        options.points = self.points();
        options.visible_emission = self.visible_emission();
        Some(options)
    }

    /// How candidates are guided that are resampled, if they are: by fewer samples a frame, which
    /// do not shade.
    pub fn guided_candidates(&self) -> Option<GuidedPathsOptions> {
        let options = self.guided_paths()?;
        Some(GuidedPathsOptions {
            samples: 2,
            ..options
        })
    }

    /// What a guide of resampled paths learns from.
    pub fn guide_source(&self) -> GuideSource {
        let name = self.get::<String>(&GUIDE_FROM).unwrap_or_default();
        let mut all = GuideSource::ALL.into_iter();
        all.find(|source| source.name() == name).unwrap_or_default()
    }

    /// The frames that train a guide, if told.
    pub fn guide_training_given(&self) -> Option<u32> {
        self.get(&GUIDE_TRAINING).filter(|_| self.has(&GUIDE_TRAINING))
    }

    /// Where paths end in a cache, if they do.
    pub fn cache_rule(&self) -> Option<CacheRule> {
        self.get(&CACHE)
    }

    /// Whether the cells of a cache are neither split nor separated by direction.
    pub(super) fn cache_has_plain_cells(&self) -> bool {
        [&CACHE_REFINE, &CACHE_FACETS]
            .iter()
            .all(|option| self.get(option).unwrap_or(0u32) == 0)
    }

    /// How paths end in a cache of a scene, if they do.
    pub fn cached_paths(&self, scene: &Scene) -> Option<CachedPathsOptions> {
        let mut options = CachedPathsOptions::new(self.cache_rule()?.0, scene);
        options.passes = self.get(&CACHE_PASSES).unwrap_or(options.passes);
        options.every_frame = self.is_on(&CACHE_ALWAYS);
        options.cache.cells.growth = self.get(&CACHE_CELLS).unwrap_or(options.cache.cells.growth);
        options.cache.refinement = match self.get(&CACHE_REFINE).unwrap_or(0) {
            0 => None,
            levels => Some(Refinement {
                levels,
                ..Refinement::default()
            }),
        };
        options.facets = Facets::new(self.get(&CACHE_FACETS).unwrap_or(0)).ok();
        options.jitter = !self.is_on(&CACHE_BORDERS);
        options.survival = self.get(&CACHE_SURVIVAL).unwrap_or(options.survival);
        options.points = self.points();
        options.visible_emission = self.visible_emission();
        Some(options)
    }

    /// Whether emission that the camera sees directly has rays of its own.
    pub fn visible_emission(&self) -> bool {
        self.get::<String>(&VISIBLE).is_none_or(|how| how == "rays")
    }

    /// The same, if told.
    pub fn visible_given(&self) -> Option<bool> {
        self.has(&VISIBLE).then(|| self.visible_emission())
    }

    /// Samples of emitters at a point.
    pub fn light_samples(&self) -> u32 {
        self.get(&LIGHT_SAMPLES).unwrap_or(1)
    }

    /// Samples of direct light beside resampled paths.
    pub fn direct_samples(&self, default: u32) -> u32 {
        self.get(&DIRECT_SAMPLES).unwrap_or(default)
    }

    /// Most scattering vertices of a path through media.
    pub fn scatterings(&self, default: u32) -> u32 {
        self.get(&SCATTERINGS).unwrap_or(default)
    }

    /// The shift mapping of ReSTIR path tracing.
    pub fn path_mapping(&self) -> PathMapping {
        match self.get::<String>(&SHIFT).as_deref() {
            Some("reconnection") => PathMapping::Reconnection,
            _ => PathMapping::Hybrid,
        }
    }

    /// Reservoirs in cells of space, if there are any, and whether reuse among pixels goes on
    /// beside them.
    pub fn world_reuse(&self) -> Option<(WorldReuse, bool)> {
        let both = match self.get::<String>(&RESERVOIRS).as_deref() {
            Some("world") => false,
            Some("both") => true,
            _ => return None,
        };
        let mut reuse = WorldReuse::default();
        reuse.cell_pixels = self.get(&WORLD_CELLS).unwrap_or(reuse.cell_pixels);
        reuse.reads = self.get(&WORLD_READS).unwrap_or(reuse.reads);
        reuse.contributors = self.get(&WORLD_BRING).unwrap_or(reuse.contributors);
        reuse.confidence_cap = self.get(&WORLD_CAP).unwrap_or(reuse.confidence_cap);
        Some((reuse, both))
    }

    /// The confidence cap of reuse from the frame before.
    pub fn temporal_cap(&self, default: Option<f32>) -> Option<f32> {
        self.get(&CAP).or(default)
    }

    /// Whether candidates are stratified, or reuse is in pairs, by footprints, or followed by steps
    /// of Markov chains.
    pub fn is_decorrelated(&self) -> bool {
        self.is_on(&STRATIFIED)
            || self.get::<u32>(&PAIRS).is_some()
            || self.get::<f32>(&FOOTPRINT).is_some()
            || self.get(&MUTATIONS).is_some_and(|steps: u32| steps > 0)
    }

    /// Parameters of suffix reuse.
    pub fn restir_suffix_options(&self, default: RestirSuffixOptions) -> RestirSuffixOptions {
        let prefixes = self.get(&PREFIXES).unwrap_or(default.prefixes);
        RestirSuffixOptions {
            suffixes: RestirPtOptions {
                direct_samples: self.direct_samples(default.suffixes.direct_samples),
                visible_emission: self.visible_emission(),
                temporal_cap: self.temporal_cap(default.suffixes.temporal_cap),
                ..default.suffixes
            },
            prefixes,
            camera_rays: self
                .get(&CAMERA_RAYS)
                .unwrap_or(default.camera_rays.min(prefixes)),
            canonical: self.get(&CANONICAL).unwrap_or(default.canonical.min(prefixes)),
            borrowed: self.get(&BORROWED).unwrap_or(default.borrowed),
            spacing: self.get(&SPACING).unwrap_or(default.spacing),
            ..default
        }
    }

    /// Parameters of stochastic lightcuts.
    pub fn lightcut_options(&self) -> LightcutOptions {
        let default = LightcutOptions::default();
        let tree = self.get::<String>(&CUT_TREE);
        let tree = CUT_TREES.iter().find(|(name, _)| Some(*name) == tree.as_deref());
        LightcutOptions {
            subtrees: self.get(&CUT_SUBTREES).unwrap_or(default.subtrees),
            block: self.get(&CUT_BLOCK).unwrap_or(default.block),
            interleaving: self.get(&CUT_INTERLEAVING).unwrap_or(default.interleaving),
            rebuild: self.is_on(&CUT_REBUILD),
            tree: tree.map_or(default.tree, |&(_, tree)| tree),
            ..default
        }
    }

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

    /// Whether Markov chain mixtures have spatial sets of one step and one state a frame, as they
    /// do if nothing else is told.
    pub(super) fn has_spatial_step(&self) -> bool {
        let options = self.mixture_options();
        options.sets == MixtureSets::Spatial && options.steps_of_frame() == 1 && options.states == 1
    }

    /// Virtual point lights of a scene: as many bounces as its longest path has room for.
    pub fn vpl_options(&self, scene: &Scene) -> VplOptions {
        let default = VplOptions::default();
        VplOptions {
            paths: self.get(&VPL_PATHS).unwrap_or(default.paths),
            bounces: scene.settings().max_depth.unwrap_or_default().saturating_sub(2),
        }
    }

    /// Least distance that a virtual point light of a scene counts with, in the scene's units.
    pub fn vpl_min_distance(&self, scene: &Scene) -> f32 {
        self.get(&VPL_CLAMP).unwrap_or(0.01) * scene.extent()
    }

    /// Parameters of indirect light by a lighting grid hierarchy.
    pub fn vpl_grid_options(&self, scene: &Scene) -> VplGridOptions {
        let default = VplGridOptions::new(self.vpl_min_distance(scene));
        VplGridOptions {
            lights: self.vpl_options(scene),
            grid: GridOptions {
                alpha: self.get(&ALPHA).unwrap_or(1.0),
                levels: self.get(&LEVELS).map_or(Levels::Auto, Levels::Count),
                ..GridOptions::default()
            },
            first_level: self.get(&FIRST_LEVEL).unwrap_or(default.first_level),
            shadow_samples: self.get(&SHADOW_SAMPLES).unwrap_or(default.shadow_samples),
            shadow_targets: if self.is_on(&SHADOW_SPREAD) {
                ShadowTargets::Spread
            } else {
                ShadowTargets::Represented
            },
            filter_iterations: self.get(&SHADOW_FILTER).unwrap_or(default.filter_iterations),
            interleaving: self.get(&INTERLEAVE).unwrap_or(default.interleaving),
            fixed_lights: self.is_on(&VPL_FIXED),
            ..default
        }
    }
}
