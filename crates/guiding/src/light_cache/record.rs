//! What a renderer tells a light cache, and what that says of itself.

use lightshed_lights::ShadingPoint;

/// A light that was asked from a point, and what came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRecord {
    /// The point.
    pub at: ShadingPoint,
    /// The light.
    pub light: u32,
    /// Probability with which it was really chosen there, exploration included.
    pub pmf: f32,
    /// What the light sent, of which `contribution / pmf` is what was added to an estimate: with
    /// the density of the place on the light, but without the probability of the choice. Zero if
    /// the light was hidden. As one number (a luminance).
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

/// How much of a cache is worth its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CacheUse {
    /// Nothing: its tree is as good without what was learnt.
    #[default]
    Nothing,
    /// The tree with what it has learnt, but not the lists of visible lights.
    Tree,
    /// All of it.
    Lists,
}

/// Second moments by which the parts of a cache are judged, see
/// [`LightCache::moments`](crate::LightCache::moments). Those of several passes add up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CacheMoments {
    /// Of the tree without what was learnt.
    pub plain: f64,
    /// Of the tree with it.
    pub tree: f64,
    /// Of the whole cache.
    pub lists: f64,
}

/// By what factor lists have to lessen second moments to be worth their cost, and what the tree has
/// learnt.
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

    /// How much of the cache is worth its cost.
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

/// What a cache holds after an update.
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
