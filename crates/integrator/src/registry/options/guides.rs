//! What a guide is and how it learns.

use super::super::option::{MethodOption, MethodValues, any, one_of};
use crate::{GuideKind, GuideSource, GuidedPathsOptions};
use lightshed_guiding::Interpolation;
use lightshed_scene::volume::FlightGuiding;

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

impl MethodValues {
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
}
