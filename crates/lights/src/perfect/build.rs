//! Building, and building again.

use super::tree::PerfectTree;
use crate::block::{NodeBlock, WIDTH};
use crate::light::check_lights;
use crate::{Light, LightError};
use lightshed_lanes::{LaneChoice, LaneKernel, Lanes, prefetch};
use lightshed_sampling::parallel::join;
use lightshed_spatial::SortedIndices;

/// Levels that are built for a part of the leaves while that part is in the cache, including the
/// level of the leaves.
const LOW_LEVELS: usize = 10;
/// Blocks of leaves in such a part: one block of the last of these levels.
const PART: usize = 1 << (LOW_LEVELS - 1);
/// Lights in such a part.
pub(super) const PART_LIGHTS: usize = PART * WIDTH;
/// How many lights ahead are prefetched.
const PREFETCH_DISTANCE: usize = 32;

impl PerfectTree {
    /// Builds the tree again for other lights, reusing its memory: it allocates only if there are
    /// more lights than ever before. The same lights give the same tree, bit for bit, whatever it
    /// held before and on any number of threads.
    ///
    /// # Errors
    ///
    /// See [`LightError`]; the tree is then unchanged.
    pub fn rebuild(&mut self, lights: &[Light]) -> Result<(), LightError> {
        check_lights(lights)?;
        self.lay_out(lights.len());
        self.order
            .encode(lights, |light| light.bounds, self.options.curve);
        let Self {
            blocks,
            levels,
            light_at,
            leaf_of,
            order,
            ..
        } = self;
        let sorted = order.sort();
        join(
            || {
                for (place, leaf) in (0..leaf_of.len()).zip(0..) {
                    if let Some(light) = sorted.get(place) {
                        leaf_of[light] = leaf;
                    }
                }
            },
            || build_levels(blocks, levels, light_at, lights, Some(sorted)),
        );
        self.note_costs();
        Ok(())
    }

    /// Sizes of all levels.
    fn lay_out(&mut self, count: usize) {
        let depth = count.next_power_of_two().trailing_zeros();
        self.levels.clear();
        let mut blocks = 0;
        for level in 0..=depth {
            self.levels.push(blocks as u32);
            let nodes = count.div_ceil(1 << (depth - level));
            blocks += nodes.div_ceil(WIDTH);
        }
        self.blocks.resize(blocks, NodeBlock::BOGUS);
        self.light_at.resize(count, 0);
        self.leaf_of.resize(count, 0);
    }
}

/// All levels, from the leaves to the root; in the order of `light_at` if there is no other.
pub(super) fn build_levels(
    blocks: &mut [NodeBlock],
    levels: &[u32],
    light_at: &mut [u32],
    lights: &[Light],
    sorted: Option<SortedIndices>,
) {
    // The lowest levels, that of the leaves first; missing levels are empty.
    let mut low: [&mut [NodeBlock]; LOW_LEVELS] = Default::default();
    let mut above = &mut *blocks;
    for (slot, &first) in low.iter_mut().zip(levels.iter().rev()) {
        (above, *slot) = above.split_at_mut(first as usize);
    }
    build_low(&Leaves { lights, sorted }, 0, &mut low, light_at);
    // The rest are few.
    for level in (1..levels.len()).rev().skip(LOW_LEVELS - 1) {
        let (above, below) = blocks.split_at_mut(levels[level] as usize);
        let end = levels
            .get(level + 1)
            .map_or(below.len(), |&end| (end - levels[level]) as usize);
        LaneChoice::best().run(BuildParents {
            below: &below[..end],
            level: &mut above[levels[level - 1] as usize..],
        });
    }
}

struct Leaves<'a> {
    lights: &'a [Light],
    sorted: Option<SortedIndices<'a>>,
}

/// Builds the lowest levels above the leaves from position `first` on; each part while it is in the
/// cache.
fn build_low(source: &Leaves, first: usize, low: &mut [&mut [NodeBlock]; LOW_LEVELS], light_at: &mut [u32]) {
    let count = low[0].len();
    if count > PART {
        let middle = count.div_ceil(2 * PART) * PART;
        let mut left: [&mut [NodeBlock]; LOW_LEVELS] = Default::default();
        let mut right: [&mut [NodeBlock]; LOW_LEVELS] = Default::default();
        for (level, blocks) in low.iter_mut().enumerate() {
            (left[level], right[level]) = std::mem::take(blocks).split_at_mut(middle >> level);
        }
        let (light_at_left, light_at_right) = light_at.split_at_mut(middle * WIDTH);
        join(
            || build_low(source, first, &mut left, light_at_left),
            || build_low(source, first + middle * WIDTH, &mut right, light_at_right),
        );
        return;
    }
    let [leaves, above @ ..] = low;
    LaneChoice::best().run(BuildLeaves {
        source,
        first,
        leaves,
        light_at,
    });
    let mut below: &[NodeBlock] = leaves;
    for level in above.iter_mut().filter(|level| !level.is_empty()) {
        LaneChoice::best().run(BuildParents { below, level });
        below = level;
    }
}

/// Copies lights into leaves, in order.
struct BuildLeaves<'a> {
    source: &'a Leaves<'a>,
    first: usize,
    leaves: &'a mut [NodeBlock],
    light_at: &'a mut [u32],
}

impl LaneKernel for BuildLeaves<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Leaves { lights, sorted } = self.source;
        if let Some(sorted) = sorted {
            for (place, light_at) in (self.first..).zip(self.light_at.iter_mut()) {
                *light_at = sorted.get(place).unwrap_or(0) as u32;
            }
        }
        for (i, (block, indices)) in self
            .leaves
            .iter_mut()
            .zip(self.light_at.chunks(WIDTH))
            .enumerate()
        {
            for later in self
                .light_at
                .iter()
                .skip(i * WIDTH + PREFETCH_DISTANCE)
                .take(WIDTH)
            {
                // A light covers one cache line or two.
                let light = &lights[*later as usize];
                prefetch(&light.bounds);
                prefetch(&light.cone);
            }
            let mut eight = [None; WIDTH];
            for (slot, &light) in eight.iter_mut().zip(indices) {
                *slot = Some(&lights[light as usize]);
            }
            *block = NodeBlock::leaves::<L>(&eight);
        }
    }
}

/// A level from the one below it: node `i` is the union of nodes `2i` and `2i + 1`.
struct BuildParents<'a> {
    below: &'a [NodeBlock],
    level: &'a mut [NodeBlock],
}

impl LaneKernel for BuildParents<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (block, pair) in self.level.iter_mut().zip(self.below.chunks(2)) {
            *block = match pair {
                [first, second] => NodeBlock::halved::<L>(first, second),
                [first] => NodeBlock::halved::<L>(first, &NodeBlock::BOGUS),
                _ => NodeBlock::BOGUS,
            };
        }
    }
}
