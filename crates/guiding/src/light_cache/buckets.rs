//! Division of a region's lights among buckets.

use super::block::{LightBlock, WeighedLight};
use super::entries::Visible;
use super::options::{BucketRule, LightCacheOptions};

/// A region's lights in the order of the walk.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RegionLights {
    /// Bucket after bucket, each in its own blocks.
    pub blocks: Vec<LightBlock>,
    /// First block of each bucket, and the end of the last one. Empty without lights.
    pub starts: Vec<u32>,
    /// Of aggregates each bucket's first unit …
    pub firsts: Vec<u32>,
    /// … and the buckets as groups.
    pub groups: Vec<LightBlock>,
}

/// A unit of a region: its number, and its weight data.
#[derive(Clone, Copy, Debug)]
pub(super) struct RegionLight {
    number: u32,
    seen_count: f32,
    light: WeighedLight,
}

impl RegionLights {
    /// Number of buckets.
    pub fn buckets(&self) -> u32 {
        (self.starts.len() as u32).saturating_sub(1)
    }

    /// Divides the visible units among buckets; there were `before` of them. `lights` has the
    /// weight data of each unit.
    pub fn new(
        visible: &[Visible],
        lights: &[WeighedLight],
        before: u32,
        options: &LightCacheOptions,
    ) -> Self {
        let shining = visible
            .iter()
            .filter(|seen| lights[seen.unit as usize].intensity > 0.0);
        let mut chosen: Vec<RegionLight> = shining
            .map(|seen| {
                let mut light = lights[seen.unit as usize];
                if options.learn_visibility {
                    light.intensity *= seen.visibility.sqrt();
                }
                RegionLight {
                    number: seen.unit,
                    seen_count: seen.seen_count,
                    light,
                }
            })
            .collect();
        let mut made = Self::default();
        if chosen.is_empty() {
            return made;
        }
        match options.rule {
            BucketRule::Hashed => made.hash(&chosen, before, options),
            BucketRule::Aggregates => made.aggregate(&mut chosen, before, options),
        }
        made.starts.push(made.blocks.len() as u32);
        made
    }

    /// Buckets by the remainder: as many as fit are merged from the bottom up (§5.4.2).
    fn hash(&mut self, chosen: &[RegionLight], before: u32, options: &LightCacheOptions) {
        let count = merged_count(chosen.iter().map(|light| light.number), before, options);
        for bucket in 0..count {
            let inside = chosen.iter().filter(|light| light.number % count == bucket);
            let mut inside: Vec<RegionLight> = inside.copied().collect();
            strongest(&mut inside, options.bucket as usize);
            self.push(&inside);
        }
    }

    /// Buckets of equal size along the curve, in whose order units are numbered.
    fn aggregate(&mut self, chosen: &mut Vec<RegionLight>, before: u32, options: &LightCacheOptions) {
        strongest(chosen, (options.bucket * options.max_buckets) as usize);
        let count = run_count(chosen.len() as u32, before, options) as usize;
        let total = chosen.len();
        let mut groups = Vec::new();
        for bucket in 0..count {
            let inside = &chosen[bucket * total / count..(bucket + 1) * total / count];
            self.firsts
                .push(inside.first().map_or(u32::MAX, |light| light.number));
            self.push(inside);
            let members: Vec<WeighedLight> = inside.iter().map(|light| light.light).collect();
            groups.push(WeighedLight::group(&members));
        }
        if count > 1 {
            let groups = groups
                .iter()
                .enumerate()
                .map(|(bucket, group)| (bucket as u32, group));
            LightBlock::push_all(&mut self.groups, groups);
        }
    }

    fn push(&mut self, bucket: &[RegionLight]) {
        self.starts.push(self.blocks.len() as u32);
        LightBlock::push_all(
            &mut self.blocks,
            bucket.iter().map(|light| (light.number, &light.light)),
        );
    }
}

/// Keeps the `most` units that were seen most often, in their order.
fn strongest(lights: &mut Vec<RegionLight>, most: usize) {
    if lights.len() > most {
        let mut counts: Vec<(f32, u32)> = lights
            .iter()
            .map(|light| (-light.seen_count, light.number))
            .collect();
        counts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let last = counts[most - 1];
        lights.retain(|light| {
            let key = (-light.seen_count, light.number);
            key.0.total_cmp(&last.0).then(key.1.cmp(&last.1)).is_le()
        });
    }
}

/// Capacity of a bucket if there are `count` buckets and there were `before`.
fn capacity(count: u32, before: u32, options: &LightCacheOptions) -> u32 {
    if count < before {
        (options.bucket as f32 * options.hysteresis) as u32
    } else {
        options.bucket
    }
}

/// The number of buckets by remainders: halved as long as none overflows.
fn merged_count(numbers: impl Iterator<Item = u32> + Clone, before: u32, options: &LightCacheOptions) -> u32 {
    let mut count = options.max_buckets;
    while count > 1 {
        let half = count / 2;
        let mut loads = vec![0u32; half as usize];
        numbers
            .clone()
            .for_each(|number| loads[(number % half) as usize] += 1);
        if loads.iter().any(|&load| load > capacity(half, before, options)) {
            break;
        }
        count = half;
    }
    count
}

/// The number of runs of `total` lights: the least without overflow.
fn run_count(total: u32, before: u32, options: &LightCacheOptions) -> u32 {
    let fits = |&count: &u32| total.div_ceil(count) <= capacity(count, before, options);
    (1..options.max_buckets).find(fits).unwrap_or(options.max_buckets)
}
