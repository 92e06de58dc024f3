//! The lists of all regions, one after the other.

use super::block::LightBlock;
use super::buckets::RegionLights;
use super::options::BucketRule;

/// Buckets of all regions, as selections read them.
#[derive(Clone, Debug)]
pub(super) struct Lists {
    pub rule: BucketRule,
    /// Of each slot.
    pub heads: Vec<RegionHead>,
    pub blocks: Vec<LightBlock>,
    starts: Vec<u32>,
    firsts: Vec<u32>,
    pub groups: Vec<LightBlock>,
}

/// Position of a region's lights, and its share of exploration.
#[derive(Clone, Copy, Debug)]
pub(super) struct RegionHead {
    pub buckets: u32,
    /// Numbers below this explore.
    pub explore_below: u64,
    pub first_block: u32,
    first_start: u32,
    pub first_group: u32,
    /// Blocks of the buckets as groups.
    pub groups: u32,
}

impl RegionHead {
    pub const UNKNOWN: Self = Self {
        buckets: 0,
        explore_below: u64::MAX,
        first_block: 0,
        first_start: 0,
        first_group: 0,
        groups: 0,
    };

    /// Whether the cache is useless here.
    #[inline(always)]
    pub fn explores_always(&self) -> bool {
        self.explore_below == u64::MAX
    }

    /// The share of samples that explore.
    #[inline(always)]
    pub fn share(&self) -> f32 {
        (self.explore_below as f64 / 18_446_744_073_709_551_616.0) as f32
    }
}

impl Lists {
    /// For this number of slots, none of which has a light.
    pub fn new(rule: BucketRule, slots: usize) -> Self {
        Self {
            rule,
            heads: vec![RegionHead::UNKNOWN; slots],
            blocks: Vec::new(),
            starts: Vec::new(),
            firsts: Vec::new(),
            groups: Vec::new(),
        }
    }

    /// Without slots, reusing memory.
    pub fn clear(&mut self) {
        self.heads.clear();
        self.blocks.clear();
        self.starts.clear();
        self.firsts.clear();
        self.groups.clear();
    }

    /// Appends the lights of the next slot.
    pub fn push(&mut self, made: &RegionLights) {
        self.heads.push(RegionHead {
            buckets: made.buckets(),
            explore_below: 0,
            first_block: self.blocks.len() as u32,
            first_start: self.starts.len() as u32,
            first_group: self.groups.len() as u32,
            groups: made.groups.len() as u32,
        });
        self.blocks.extend_from_slice(&made.blocks);
        self.starts.extend_from_slice(&made.starts);
        self.groups.extend_from_slice(&made.groups);
        // As many as starts, so that one offset serves both.
        self.firsts.extend_from_slice(&made.firsts);
        self.firsts.resize(self.starts.len(), u32::MAX);
    }

    /// The units of a bucket.
    #[inline(always)]
    pub fn blocks(&self, head: &RegionHead, bucket: usize) -> &[LightBlock] {
        let place = head.first_start as usize + bucket;
        let first = head.first_block;
        &self.blocks[(first + self.starts[place]) as usize..(first + self.starts[place + 1]) as usize]
    }

    /// The first block of each bucket from the region's first one, and the end; empty without
    /// lights.
    pub fn starts(&self, head: &RegionHead) -> &[u32] {
        let count = head.buckets + u32::from(head.buckets > 0);
        &self.starts[head.first_start as usize..(head.first_start + count) as usize]
    }

    /// The first unit of each bucket.
    #[inline(always)]
    pub fn firsts(&self, head: &RegionHead) -> &[u32] {
        &self.firsts[head.first_start as usize..(head.first_start + head.buckets) as usize]
    }

    /// The buckets as groups.
    #[inline(always)]
    pub fn groups(&self, head: &RegionHead) -> &[LightBlock] {
        &self.groups[head.first_group as usize..(head.first_group + head.groups) as usize]
    }
}
