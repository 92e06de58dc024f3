//! Selection of one of a region's buckets, and the probabilities of the cache alone.

use super::block::{LightBlock, Receiver};
use super::lists::{Lists, RegionHead};
use super::options::BucketRule;
use super::units::Units;
use super::walk::{Walk, find};
use lightshed_lanes::Lanes;

/// The buckets of a region for a receiver, and how one is selected.
pub(super) struct Buckets<'a> {
    lists: &'a Lists,
    units: &'a Units,
    head: &'a RegionHead,
    /// Weights of aggregates; `None` where the choice is uniform.
    weights: Option<Walk>,
}

impl<'a> Buckets<'a> {
    #[inline(always)]
    pub fn new<L: Lanes>(
        lists: &'a Lists,
        units: &'a Units,
        head: &'a RegionHead,
        to: &Receiver<'_>,
    ) -> Self {
        let grouped = lists.rule == BucketRule::Aggregates && head.buckets > 1;
        Self {
            lists,
            units,
            head,
            weights: match grouped {
                true => Some(Walk::new::<L>(lists.groups(head), to)),
                false => None,
            },
        }
    }

    /// Whether no bucket can be chosen.
    #[inline(always)]
    pub fn is_black(&self) -> bool {
        self.head.buckets == 0
            || self
                .weights
                .as_ref()
                .is_some_and(|weights| !(weights.total() > 0.0))
    }

    /// Selects a bucket by `u`; returns the rest of `u`.
    #[inline(always)]
    pub fn choose<L: Lanes>(&self, u: f64) -> (usize, f64) {
        match &self.weights {
            Some(weights) => weights.choose::<L>(u),
            None => {
                let scaled = u * f64::from(self.head.buckets);
                let bucket = (scaled as usize).min(self.head.buckets as usize - 1);
                (bucket, (scaled - bucket as f64).clamp(0.0, 1.0 - f64::EPSILON))
            }
        }
    }

    #[inline(always)]
    pub fn probability(&self, bucket: usize) -> f32 {
        match &self.weights {
            Some(weights) => weights.probability(bucket),
            None => 1.0 / self.head.buckets as f32,
        }
    }

    /// The bucket that holds a unit, if any does.
    #[inline(always)]
    pub fn of(&self, unit: u32) -> usize {
        match self.lists.rule {
            BucketRule::Hashed => (unit % self.head.buckets) as usize,
            BucketRule::Aggregates if self.head.buckets == 1 => 0,
            BucketRule::Aggregates => {
                let firsts = self.lists.firsts(self.head);
                firsts.partition_point(|&first| first <= unit).saturating_sub(1)
            }
        }
    }

    #[inline(always)]
    pub fn blocks(&self, bucket: usize) -> &'a [LightBlock] {
        self.lists.blocks(self.head, bucket)
    }

    /// `p_c` of a light, and whether any unit of its bucket has a weight.
    #[inline(always)]
    pub fn cached<L: Lanes>(&self, to: &Receiver<'_>, light: u32) -> (f32, bool) {
        let unit = self.units.of(light);
        let bucket = self.of(unit);
        let blocks = self.blocks(bucket);
        let walk = Walk::new::<L>(blocks, to);
        let within = find(blocks, unit).map_or(0.0, |i| walk.probability(i));
        let of_unit = self.probability(bucket) * within;
        let cached = if of_unit > 0.0 {
            of_unit * self.units.probability::<L>(to, light)
        } else {
            0.0
        };
        (cached, walk.total() > 0.0)
    }
}
