//! Building, and building again.

use super::PerfectTree;
use super::order::{Keyed, sort};
use crate::block::{Node, NodeBlock, WIDTH};
use crate::light::check_lights;
use crate::parallel::{for_each_chunk, for_each_group, for_each_pair, reduce};
use crate::{Bounds, Light, LightError};
use lightshed_sampling::MortonGrid;

/// What is kept from one build to the next, so that the next allocates nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    keys: Vec<Keyed>,
    spare: Vec<Keyed>,
}

/// Lights or blocks that a thread takes at once.
const CHUNK: usize = 1 << 12;
/// Source blocks of three levels built at once: whole blocks of each of the three.
const GROUP: usize = 512;

impl PerfectTree {
    /// Builds the tree again for other lights, in the memory that it has: nothing is allocated unless there are more than ever
    /// before. The same lights give the same tree, bit for bit, whatever it was before and on any number of threads.
    ///
    /// # Errors
    ///
    /// See [`LightError`]; the tree is as it was then.
    pub fn rebuild(&mut self, lights: &[Light]) -> Result<(), LightError> {
        check_lights(lights)?;
        self.lay_out(lights.len());
        self.sort_lights(lights);
        self.fill_leaves(lights);
        self.build_levels();
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
        self.blocks.resize(blocks, NodeBlock::default());
        self.light_at.resize(count, 0);
        self.leaf_of.resize(count, 0);
    }

    /// Sorts the lights' centres along a Morton curve through their box.
    fn sort_lights(&mut self, lights: &[Light]) {
        let box_of = |lights: &[Light]| {
            lights.iter().fold(Bounds::EMPTY, |all, light| {
                all.union(&Bounds::of_point(light.bounds.center()))
            })
        };
        let all = reduce(lights, CHUNK, box_of, |a, b| a.union(&b)).unwrap_or_default();
        // Finite and in order, as all lights have been checked.
        let Ok(grid) = MortonGrid::new(all.min, all.max) else {
            return;
        };
        let Scratch { keys, spare } = &mut self.scratch;
        keys.resize(lights.len(), Keyed::default());
        spare.resize(lights.len(), Keyed::default());
        for_each_pair(keys, lights, CHUNK, |start, keys, lights| {
            for (i, (key, light)) in keys.iter_mut().zip(lights).enumerate() {
                *key = Keyed {
                    code: grid.encode63(light.bounds.center()),
                    index: (start + i) as u32,
                };
            }
        });
        sort(keys, spare);
        for (leaf, key) in keys.iter().enumerate() {
            self.light_at[leaf] = key.index;
            self.leaf_of[key.index as usize] = leaf as u32;
        }
    }

    /// Copies lights into the leaves, in order.
    fn fill_leaves(&mut self, lights: &[Light]) {
        let first = self.levels[self.depth() as usize] as usize;
        let light_at = &self.light_at;
        for_each_chunk(&mut self.blocks[first..], CHUNK / WIDTH, |start, blocks| {
            for (i, block) in blocks.iter_mut().enumerate() {
                let leaf = (start + i) * WIDTH;
                for lane in 0..WIDTH {
                    let light = light_at.get(leaf + lane).map(|&light| &lights[light as usize]);
                    block.set(lane, &light.map_or(Node::BOGUS, Node::leaf));
                }
            }
        });
    }

    /// Builds all inner levels, in groups of up to three from the level below them (Lin 2022 §4.4).
    fn build_levels(&mut self) {
        let mut source = self.depth() as usize;
        while source > 0 {
            let group = source.min(3);
            let (above, rest) = self.blocks.split_at_mut(self.levels[source] as usize);
            let end = self
                .levels
                .get(source + 1)
                .map_or(rest.len(), |&end| end as usize - self.levels[source] as usize);
            build_group(&rest[..end], above, &self.levels[source - group..source]);
            source -= group;
        }
    }
}

/// Builds the levels that start at `firsts` (the uppermost first) at the end of `above`, from `source`, the level below them.
fn build_group(source: &[NodeBlock], above: &mut [NodeBlock], firsts: &[u32]) {
    let origin = firsts[0] as usize;
    let mut rest = &mut above[origin..];
    let mut targets: [&mut [NodeBlock]; 3] = Default::default();
    // From the lowest to the uppermost.
    for (slot, &first) in targets.iter_mut().zip(firsts.iter().rev()) {
        let (before, level) = rest.split_at_mut(first as usize - origin);
        (*slot, rest) = (level, before);
    }
    let [one, two, three] = targets;
    for_each_group(source, GROUP, [one, two, three], &|source, [one, two, three]| {
        halve(source, one);
        halve(one, two);
        halve(two, three);
    });
}

/// A level from the one below it: node `i` is the union of nodes `2i` and `2i + 1`.
fn halve(below: &[NodeBlock], level: &mut [NodeBlock]) {
    for (i, block) in level.iter_mut().enumerate() {
        for lane in 0..WIDTH {
            let child = 2 * (i * WIDTH + lane);
            let from = |child: usize| {
                below
                    .get(child / WIDTH)
                    .map_or(Node::BOGUS, |b| b.node(child % WIDTH))
            };
            block.set(lane, &from(child).union(&from(child + 1)));
        }
    }
}
