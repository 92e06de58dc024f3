//! Options of a light cache.

use crate::GuidingError;
use crate::error::check_option;

/// Most lights of a bucket.
pub const MAX_BUCKET: usize = 64;

/// How lights that do not fit into one bucket are divided, and how a bucket is selected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum BucketRule {
    /// By the remainder of the light's number, in a power of two of buckets that are selected
    /// uniformly (§5.4.2). The cost of a selection is bounded; its quality falls with the number
    /// of buckets.
    Hashed,
    /// In the order of a curve through all lights, so that a bucket is a group of near lights. A
    /// bucket is selected by the total weight of its lights. The cost of a selection is bounded by
    /// two walks.
    #[default]
    Aggregates,
}

/// How lights are found that a cache does not know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Exploration {
    /// By one table for all points, over energy, change and distance from the eye (§5.4.3). Its
    /// density is known for every light at no cost, so both techniques find cached lights:
    /// `p = f p_e + (1 − f) p_c`.
    Table,
    /// By a light tree that learns, too ([`LightTreeCache`](crate::LightTreeCache)), for the
    /// receiver. Its density costs a descent of the tree, so it is used only for lights that are
    /// not cached: `p = (1 − f) p_c` of a light that `p_c` reaches, `f p_e` of others. If the
    /// tree selects a cached light, that is a sample of value zero.
    #[default]
    Tree,
}

/// Parameters of a [`LightCache`](crate::LightCache).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LightCacheOptions {
    /// Lights, or groups of lights, of a bucket, a multiple of 8 up to [`MAX_BUCKET`].
    pub bucket: u32,
    /// Most buckets of a region, a power of two.
    pub max_buckets: u32,
    /// How lights are divided among buckets.
    pub rule: BucketRule,
    /// Extent of a group of lights that is learnt and selected as one, as a share of the extent of
    /// all lights; 0 for single lights. Hashed buckets hold single lights.
    pub unit_size: f32,
    /// How unknown lights are found.
    pub exploration: Exploration,
    /// Share of samples that explore if it is not learnt; above 0, at most 1.
    pub share: f32,
    /// Learns the share of samples that explore, region by region; at least `share`.
    pub learn_share: bool,
    /// Multiplies the weight of a light by the root of the share of a region's samples that saw it.
    pub learn_visibility: bool,
    /// Weighs lights by the lobe of glossy receivers, a linearly transformed cosine (§5.4.2), in
    /// place of the cosine alone ([`Gloss`](lightshed_lights::Gloss)).
    #[cfg_attr(feature = "serde", serde(default))]
    pub lobes: bool,
    /// The number of buckets is reduced only if no bucket is fuller than this part of its capacity:
    /// above 0, at most 1.
    pub hysteresis: f32,
    /// Share of earlier samples that an update keeps, 0 to 1: zero forgets the lights of the
    /// previous frame.
    pub persistence: f32,
    /// Updates with samples in a region after which a light that nobody has seen there is
    /// forgotten.
    pub max_age: u32,
    /// A region is divided if an update has more samples in it.
    pub split_above: u32,
    /// Regions are joined again if an update has fewer samples in all eight of them.
    pub join_below: u32,
    /// Most regions.
    pub max_regions: u32,
    /// Of the tree that explores.
    pub tree: LightTreeCacheOptions,
    /// Uses the lights of regions that share a face.
    pub merge_neighbours: bool,
}

/// When regions are divided and joined.
#[derive(Clone, Copy, Debug)]
pub(super) struct RegionOptions {
    pub split_above: u32,
    pub join_below: u32,
    pub max_regions: u32,
}

impl RegionOptions {
    fn check(&self) -> Result<(), GuidingError> {
        check_option(
            self.split_above >= 8,
            "split_above",
            self.split_above.into(),
            "at least 8",
        )?;
        let join = self.join_below <= self.split_above / 2;
        check_option(
            join,
            "join_below",
            self.join_below.into(),
            "at most half of split_above",
        )
    }
}

impl Default for LightCacheOptions {
    /// Persistent caches with aggregates, explored by a light tree.
    fn default() -> Self {
        Self {
            bucket: 32,
            max_buckets: 32,
            rule: BucketRule::Aggregates,
            unit_size: 1.0 / 64.0,
            exploration: Exploration::Tree,
            share: 0.005,
            learn_share: true,
            learn_visibility: true,
            lobes: false,
            hysteresis: 0.75,
            persistence: 0.9,
            max_age: 32,
            split_above: 512,
            join_below: 128,
            max_regions: 1 << 20,
            merge_neighbours: true,
            tree: LightTreeCacheOptions::default(),
        }
    }
}

impl LightCacheOptions {
    /// The cache as the thesis describes it: hashed buckets, an exploration table with a tenth of
    /// the samples, nothing kept from earlier frames.
    pub fn thesis() -> Self {
        Self {
            rule: BucketRule::Hashed,
            unit_size: 0.0,
            exploration: Exploration::Table,
            share: 0.1,
            learn_share: false,
            learn_visibility: false,
            persistence: 0.0,
            max_age: 0,
            split_above: 4096,
            join_below: 2048,
            ..Self::default()
        }
    }

    pub(super) fn regions(&self) -> RegionOptions {
        RegionOptions {
            split_above: self.split_above,
            join_below: self.join_below,
            max_regions: self.max_regions,
        }
    }

    /// # Errors
    ///
    /// [`GuidingError::Option`] names the first option that is out of its range.
    pub fn check(&self) -> Result<(), GuidingError> {
        let unit = |x: f32| x > 0.0 && x <= 1.0;
        let bucket = self.bucket.is_multiple_of(8) && (8..=MAX_BUCKET as u32).contains(&self.bucket);
        check_option(
            bucket,
            "bucket",
            self.bucket.into(),
            "a multiple of 8 from 8 to 64",
        )?;
        let buckets = self.max_buckets.is_power_of_two() && self.max_buckets <= MAX_BUCKET as u32;
        check_option(
            buckets,
            "max_buckets",
            self.max_buckets.into(),
            "a power of two up to 64",
        )?;
        let size = (0.0..=1.0).contains(&self.unit_size);
        check_option(size, "unit_size", self.unit_size.into(), "0 to 1")?;
        check_option(unit(self.share), "share", self.share.into(), "above 0, at most 1")?;
        check_option(
            unit(self.hysteresis),
            "hysteresis",
            self.hysteresis.into(),
            "above 0, at most 1",
        )?;
        let persistence = (0.0..=1.0).contains(&self.persistence);
        check_option(persistence, "persistence", self.persistence.into(), "0 to 1")?;
        self.regions().check()?;
        self.tree.check()
    }
}

/// Parameters of a [`LightTreeCache`](crate::LightTreeCache).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LightTreeCacheOptions {
    /// A region is divided if it has more samples than this, including those left from earlier
    /// updates.
    pub split_above: u32,
    /// Eight regions are joined when they have fewer samples together.
    pub join_below: u32,
    /// Most regions.
    pub max_regions: u32,
    /// Number of samples through a node from which its children have their own factors.
    pub split_row: f32,
    /// Most nodes with factors in a region.
    pub max_rows: u32,
    /// Number of samples for which a node's mean counts in each of its children: at least 1.
    pub prior_count: f32,
    /// Least factor, relative to the greatest of its siblings: it ensures exploration. Above 0, at
    /// most 1.
    pub least_factor: f32,
    /// Share of earlier samples that an update keeps, 0 to 1.
    pub persistence: f32,
}

impl Default for LightTreeCacheOptions {
    fn default() -> Self {
        Self {
            split_above: 1024,
            join_below: 256,
            max_regions: 1 << 20,
            split_row: 16.0,
            max_rows: 64,
            prior_count: 4.0,
            least_factor: 1.0 / 16.0,
            persistence: 0.9,
        }
    }
}

impl LightTreeCacheOptions {
    pub(super) fn regions(&self) -> RegionOptions {
        RegionOptions {
            split_above: self.split_above,
            join_below: self.join_below,
            max_regions: self.max_regions,
        }
    }

    /// # Errors
    ///
    /// [`GuidingError::Option`] names the first option that is out of its range.
    pub fn check(&self) -> Result<(), GuidingError> {
        self.regions().check()?;
        let count = |x: f32| (1.0..=1e6).contains(&x);
        check_option(
            count(self.split_row),
            "split_row",
            self.split_row.into(),
            "1 to a million",
        )?;
        check_option(
            count(self.prior_count),
            "prior_count",
            self.prior_count.into(),
            "1 to a million",
        )?;
        let rows = (1..=1 << 16).contains(&self.max_rows);
        check_option(rows, "max_rows", self.max_rows.into(), "1 to 65,536")?;
        let factor = self.least_factor >= 1e-3 && self.least_factor <= 1.0;
        check_option(factor, "least_factor", self.least_factor.into(), "0.001 to 1")?;
        let persistence = (0.0..=1.0).contains(&self.persistence);
        check_option(persistence, "persistence", self.persistence.into(), "0 to 1")
    }
}
