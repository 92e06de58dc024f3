//! How trees learn.

use super::bits::MAX_QUADTREE_BITS;

/// How quadtrees of a few bits learn.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QuadtreeOptions {
    /// Bits of a tree: a multiple of 32, up to 1,024.
    pub bits: u32,
    /// Most leaves that an update moves in a tree.
    pub migrations: u32,
    /// A leaf is split if its load times this factor exceeds the load of the leaves that are given
    /// up for it; in (0, 1]. The thesis uses 0.1, against noise; samples of several frames need
    /// less.
    pub eagerness: f32,
    /// A leaf with fewer samples is not split.
    pub least_samples: u32,
    /// Number of samples that weigh as much as the assumption of uniform light.
    pub prior_samples: f32,
    /// Where leaves are.
    pub goal: QuadtreeGoal,
    /// Whether a region keeps the mean distance of its light, and each position sees its tree from
    /// there: 16 bytes more.
    pub parallax: bool,
    /// Whether the leaves are kept in a row, so that products with what receivers reflect can be
    /// sampled ([`SeenQuadtree::times`](super::SeenQuadtree::times)); for trees of at most
    /// [`MAX_PRODUCT_BITS`](super::MAX_PRODUCT_BITS).
    #[cfg_attr(feature = "serde", serde(default))]
    pub product: bool,
}

/// What decides where a tree has its leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum QuadtreeGoal {
    /// Leaves carry the same share of the samples' weights.
    EvenLoad,
    /// The mixture of the tree with the BSDF has the least variance.
    LeastVariance {
        /// Share of the tree in this mixture, in (0, 1].
        share: f32,
    },
}

impl Default for QuadtreeOptions {
    /// 64 bits; an update may change all of them.
    fn default() -> Self {
        Self {
            bits: 64,
            migrations: MAX_QUADTREE_BITS / 4,
            eagerness: 1.0,
            least_samples: 2,
            prior_samples: 16.0,
            goal: QuadtreeGoal::LeastVariance { share: 0.6 },
            parallax: true,
            product: false,
        }
    }
}
