//! How a cache is kept.

use super::error::{CachingError, check_option};
use lightshed_spatial::LevelGridOptions;

/// How long a record keeps what it has learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum History {
    /// The last two windows of passes count, all of their passes equally. Windows are 1, 2, 4, …
    /// passes long, up to `longest`: values from before radiance had propagated are forgotten soon,
    /// and values older than `2 · longest` passes have no influence.
    Windows {
        /// Passes of the longest window.
        longest: u32,
    },
    /// The weight of a pass falls by a factor with each that follows.
    Exponential {
        /// The factor, in 0 to 1.
        keep: f64,
    },
}

/// Most samples of a vertex in a pass.
pub const MAX_UPDATE_SAMPLES: u32 = 64;

/// How a [`RadianceCache`](crate::RadianceCache) is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RadianceCacheOptions {
    /// Its cells.
    pub cells: LevelGridOptions,
    /// Most records. Each takes about 500 bytes, used or not, and four vertices.
    pub slots: usize,
    /// Independent samples of one vertex of each record in a pass; 2 to 64. A single one would give
    /// no variance.
    pub samples: u32,
    /// What becomes of older passes.
    pub history: History,
    /// A record is removed if no vertex was found in its cell for this number of passes.
    pub max_age: u32,
    /// Number of passes from which a record answers; before, it has too little information.
    pub min_passes: u32,
    /// One in this number of the vertices that samples find is kept for later passes, if the record
    /// already exists.
    pub keep_one_in: u32,
    /// Cells that are split where bias dominates; `None` for cells of the sizes of
    /// [`cells`](Self::cells) alone.
    pub refinement: Option<Refinement>,
}

/// Most times that a cell is split.
pub const MAX_REFINEMENT: u32 = 4;

/// When cells are split in halves along each axis.
///
/// A cell's squared bias (eq. 7.17) is estimated from the means of its vertices. It is split if
/// that estimate is certain (above three times its own standard deviation, as vertices with
/// normally distributed means would have it) and a share of the squared radiance. With more passes
/// smaller biases become certain.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Refinement {
    /// How often a cell is split, one in another; 1 to 4.
    pub levels: u32,
    /// Least squared bias of cells that are split, as a share of their squared radiance.
    pub least_bias: f64,
    /// Share of the slots in use beyond which no cell is split.
    pub most_load: f64,
}

impl Default for Refinement {
    /// Cells of down to a quarter of the side, where the bias is a tenth of the radiance, in at
    /// most half of the slots.
    fn default() -> Self {
        Self {
            levels: 2,
            least_bias: 0.01,
            most_load: 0.5,
        }
    }
}

impl Refinement {
    fn check(&self) -> Result<(), CachingError> {
        let levels = (1..=MAX_REFINEMENT).contains(&self.levels);
        check_option(levels, "levels", f64::from(self.levels), "from 1 to 4")?;
        let bias = self.least_bias >= 0.0 && self.least_bias.is_finite();
        check_option(bias, "least_bias", self.least_bias, "finite and not negative")?;
        let load = (0.0..=1.0).contains(&self.most_load);
        check_option(load, "most_load", self.most_load, "from 0 to 1")
    }
}

impl RadianceCacheOptions {
    /// 2¹⁶ records, 16 samples in a pass, windows of up to 32 passes.
    pub fn new(cells: LevelGridOptions) -> Self {
        Self {
            cells,
            slots: 1 << 16,
            samples: 16,
            history: History::Windows { longest: 32 },
            max_age: 64,
            min_passes: 2,
            keep_one_in: 16,
            refinement: None,
        }
    }

    /// Whether a cache can have these options, without a check of cells and slots.
    pub(crate) fn check(&self) -> Result<(), CachingError> {
        let samples = (2..=MAX_UPDATE_SAMPLES).contains(&self.samples);
        check_option(samples, "samples", f64::from(self.samples), "from 2 to 64")?;
        match self.history {
            History::Windows { longest } => {
                check_option(longest > 0, "longest", f64::from(longest), "positive")?;
            }
            History::Exponential { keep } => {
                check_option((0.0..=1.0).contains(&keep), "keep", keep, "from 0 to 1")?;
            }
        }
        if let Some(refinement) = &self.refinement {
            refinement.check()?;
        }
        check_option(self.max_age > 0, "max_age", f64::from(self.max_age), "positive")?;
        let one_in = f64::from(self.keep_one_in);
        check_option(self.keep_one_in > 0, "keep_one_in", one_in, "positive")
    }
}
