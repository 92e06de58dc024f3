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
    /// Whether trees follow the root of the second moment instead of the mean.
    pub second_moment: bool,
}

impl Default for QuadtreeOptions {
    /// 64 bits; an update may change all of them.
    fn default() -> Self {
        Self {
            bits: 64,
            migrations: MAX_QUADTREE_BITS / 4,
            eagerness: 1.0,
            least_samples: 4,
            prior_samples: 16.0,
            second_moment: false,
        }
    }
}
