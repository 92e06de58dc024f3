//! Reports of a renderer to a light cache, and measures of the cache.

use lightshed_lights::ShadingPoint;

/// A light that was sampled from a point, and the result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRecord {
    /// The point.
    pub at: ShadingPoint,
    /// The light.
    pub light: u32,
    /// Probability of the actual selection there, including exploration.
    pub pmf: f32,
    /// The light's contribution. `contribution / pmf` is what was added to an estimate: divided by
    /// the density of the position on the light, but not by the probability of the selection. Zero
    /// if the light was hidden. As one number (a luminance).
    pub contribution: f32,
    /// Whether nothing was between the point and the light.
    pub visible: bool,
}

impl LightRecord {
    /// Whether it can be learnt from.
    pub(super) fn is_sound(&self) -> bool {
        self.at.position.is_finite()
            && self.pmf > 0.0
            && self.pmf <= 1.0
            && self.contribution >= 0.0
            && self.contribution.is_finite()
    }
}

/// Which part of a cache is worth its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum CacheUse {
    /// None: the tree is as good without its learnt factors.
    #[default]
    Nothing,
    /// The tree with its learnt factors, but not the lists of visible lights.
    Tree,
    /// All of it.
    Lists,
}

/// Second moments that judge the parts of a cache, see
/// [`LightCache::moments`](crate::LightCache::moments). Those of several passes add up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CacheMoments {
    /// Of the tree without learnt factors.
    pub plain: f64,
    /// Of the tree with it.
    pub tree: f64,
    /// Of the whole cache.
    pub lists: f64,
}

/// Factors by which lists, and learnt factors of the tree, must lower second moments to be worth
/// their cost.
const LISTS_COST: f64 = 1.05;
const TREE_COST: f64 = 1.06;

impl CacheMoments {
    /// The sum of both.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            plain: self.plain + other.plain,
            tree: self.tree + other.tree,
            lists: self.lists + other.lists,
        }
    }

    /// Which part of the cache is worth its cost.
    pub fn use_of(&self) -> CacheUse {
        if self.lists * LISTS_COST < self.tree.min(self.plain) {
            CacheUse::Lists
        } else if self.tree * TREE_COST < self.plain {
            CacheUse::Tree
        } else {
            CacheUse::Nothing
        }
    }
}

/// Contents of a cache after an update.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightCacheReport {
    /// Regions.
    pub regions: usize,
    /// Lights of all regions together.
    pub lights: usize,
    /// Buckets of all regions together.
    pub buckets: usize,
    /// Lights that a region saw for the first time.
    pub found: usize,
    /// Mean share of exploration over the update's samples.
    pub share: f32,
}
